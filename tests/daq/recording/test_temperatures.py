"""Temperatures of the drives: read where the description says, kept with the run."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import robots
from daq.check.recorded import reported_celsius
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from daq.recording.steady_clock import SteadyClock
from daq.recording.temperatures import Temperature, drive_temperatures
from drivers import ArmSession, Channel, DriveError
from drivers.simulated import SimulatedArm
from robots import Robot
from tests.daq.captures import facts, outcome, samples


@given(
    st.builds(
        Temperature,
        st.integers(0, 2**31 * 10**9 - 1),
        st.text(st.characters(exclude_characters="\x00", exclude_categories=["Cs"]), max_size=20),
        st.floats(allow_nan=False),
    )
)
def test_a_reading_comes_back(reading: Temperature) -> None:
    assert Temperature.decode(reading.encode()) == reading


def with_temperatures(robot: Robot, folder: Path, index: int) -> Robot:
    """The arm whose first two drives say how warm they are."""
    head, *drives = robot.source_text.split("[[drive]]")
    line = f"\ntemperature = {{ index = {index}, per_count = 0.1 }}"
    drives = [line + drive if number < 2 else drive for number, drive in enumerate(drives)]
    (folder / "robot.toml").write_text("[[drive]]".join([head, *drives]), encoding="utf-8")
    (folder / robot.urdf).write_bytes(robot.urdf_path.read_bytes())
    return robots.load(folder)


def test_the_simulated_drives_tell_theirs(
    tx40: Robot, channel: Channel, tmp_path: Path, no_leftovers: None, caplog: pytest.LogCaptureFixture
) -> None:
    robot = with_temperatures(tx40, tmp_path, 0x2200)
    without = with_temperatures(tx40, tmp_path, 0x2FFF)
    path = tmp_path / "run.mcap"
    with SimulatedArm("tx40", channel, 1):
        with ArmSession(robot, channel) as session:
            readings = drive_temperatures(session, SteadyClock())
        with ArmSession(without, channel) as session:
            with pytest.raises(DriveError, match="2FFF:00"):
                session.temperatures()
            assert drive_temperatures(session, SteadyClock()) == ()
    assert "temperatures are not recorded: drive of joint joint_1" in caplog.text
    assert [reading.joint for reading in readings] == ["joint_1", "joint_2"]
    assert all(15.0 < reading.celsius < 60.0 for reading in readings)
    with Recorder(path, robot, facts(robot)) as recorder:
        recorder.write(samples(0, 20))
        recorder.write_temperatures(readings)
        recorder.finish(outcome(20))
    assert read_capture(path).temperatures == readings
    assert reported_celsius(path, robot) is None, "four joints have none"


def test_the_temperature_of_a_run_is_the_mean_of_what_each_drive_reported(
    tx40: Robot, tmp_path: Path
) -> None:
    path = tmp_path / "run.mcap"
    with Recorder(path, tx40, facts(tx40)) as recorder:
        recorder.write(samples(0, 20))
        for apart in (-1.0, 1.0):
            readings = [
                Temperature(1_000, joint.name, 20.0 + k + apart) for k, joint in enumerate(tx40.joint)
            ]
            recorder.write_temperatures(tuple(readings))
        recorder.finish(outcome(20))
    assert reported_celsius(path, tx40) == (20.0, 21.0, 22.0, 23.0, 24.0, 25.0)
