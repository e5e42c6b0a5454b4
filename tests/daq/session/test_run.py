"""armhil run on simulated drives: refused, approached, paused, stopped, aborted, recorded, catalogued."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daq.catalogue import leases, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import identity_of_capture
from daq.catalogue.values import ArmMismatch, LeaseHeld
from daq.recording.reader import read_capture
from daq.recording.trajectory_file import trajectory_text
from daq.recording.who import user
from daq.session.bench import opened, refuse_strangers
from daq.session.cell import Cell
from daq.session.keyboard import pressed
from daq.session.motions import read_trajectory, slowed
from daq.session.recorded_runs import Recording, unconducted
from daq.session.run import RunRequest, run_trajectory
from daq.session.session_error import NotMoved, SessionError
from daq.session.spool import spool_path
from daq.session.states import Conduct, SessionState, Wish
from daq.session.streaming import Nobody, period_ends
from daq.text.progress import Silent
from drivers import Channel, Samples, StreamResult
from robots import Robot
from tests.daq.calls import Call
from tests.daq.catalogue.entries import identity
from tests.daq.session.motions import order, refusing, there_and_back, written
from trajectories import Trajectory

S = SessionState


class Conductor:
    """Watches a stream and makes a wish once a row has come; resumes a pause once the arm rests."""

    def __init__(self, wishes: dict[int, Wish]) -> None:
        self._wishes = dict(wishes)
        self.states: list[SessionState] = []
        self.result: StreamResult | None = None

    def begin(self, title: str, trajectory: Trajectory, conduct: Conduct) -> None:
        self._conduct = conduct

    def samples(self, samples: Samples) -> None:
        for row in [row for row in self._wishes if len(samples) and samples.cycle[-1] >= row]:
            key = self._wishes.pop(row)[0]
            assert pressed(key, self._conduct)
        self.note()

    def note(self) -> None:
        state = self._conduct.state
        if not self.states or self.states[-1] is not state:
            self.states.append(state)
        if state is S.PAUSED:
            assert self._conduct.wish("resume")

    def end(self, result: StreamResult | None) -> None:
        self.result = result


@pytest.fixture
def motion(emps: Robot) -> Trajectory:
    return there_and_back(emps, periods=3)


def test_periods_end_where_the_arm_rests(emps: Robot, motion: Trajectory, tmp_path: Path) -> None:
    rows = period_ends(motion)
    assert len(rows) in (2, 3), "the last one may be where the motion ends"
    assert np.abs(motion.velocity[list(rows)]).max() < 0.01 * np.abs(motion.velocity).max()
    read = read_trajectory(written(tmp_path, emps, motion), emps)
    assert period_ends(read) == rows and np.array_equal(read.position, motion.position)
    slow = slowed(read, 0.1)
    assert np.abs(slow.velocity[list(period_ends(slow))]).max() < 0.01 * np.abs(slow.velocity).max()
    assert np.abs(slow.velocity).max() == pytest.approx(0.1 * np.abs(motion.velocity).max(), rel=1e-3)
    assert slow.speed == pytest.approx(0.1)
    assert period_ends(replace(motion, repeat=None)) == ()


@pytest.mark.slow
def test_pause_stop_and_abort_on_the_bus(
    emps: Robot, bench: Channel, motion: Trajectory, tmp_path: Path, passed: None
) -> None:
    """One session, three streams: each wish does what it says, and the catalogue and the captures agree."""
    period = period_ends(motion)[0]
    arm_order = order(emps, bench)
    with Catalogue() as catalogue, opened(arm_order, catalogue, Silent(), "drive", Cell()) as arm:
        start = np.asarray(motion.position[0])
        assert np.abs(arm.session.actual_position() - start).max() < 0.02

        def drive(name: str, wishes: dict[int, Wish]) -> tuple[Conductor, StreamResult, Path]:
            conductor, path = Conductor(wishes), tmp_path / f"{name}.mcap"

            @contextmanager
            def conducting() -> Iterator[Conduct]:
                conduct = Conduct()
                # While it rests no samples come, so something else has to look: as the keyboard would.
                over = threading.Event()

                def look() -> None:
                    while not over.wait(0.05):
                        if conduct.state is S.PAUSED:
                            conductor.note()

                looking = threading.Thread(target=look)
                looking.start()
                try:
                    yield conduct
                finally:
                    over.set()
                    looking.join()

            recording = Recording(arm, arm_order, catalogue, conductor, conducting, "noted")
            _, result = recording.record("run", name, motion, path)
            return conductor, result, path

        paused, result, path = drive("pause", {period // 4: "pause"})
        assert paused.states == [S.RUNNING, S.PAUSING, S.PAUSED, S.RUNNING]
        assert result.outcome == "completed" and result.cycles > len(motion.time), "two ramps more"
        (rest,) = result.pauses
        assert period // 4 < rest < period, "now, and not where the period ends"
        capture = read_capture(path)
        assert capture.pauses == (rest,) and len(capture.samples) == result.cycles
        before, after = capture.segments()
        assert (len(before), len(before) + len(after)) == (rest, result.cycles)
        np.testing.assert_array_equal(before.reference[-1], after.reference[0])
        planned = emps.counts_per_output_unit * motion.position[-period:]
        driven = emps.counts_per_output_unit * after.reference[-period:]
        assert np.abs(planned - driven).max() <= 0.5 + 1e-6, "to the last count as planned"
        assert capture.run["note"] == "noted" and capture.run["operator"] == user()
        assert capture.trajectory["file"] == trajectory_text(motion, emps), "the whole motion, exactly"

        stopped, result, path = drive("stop", {period // 2: "stop"})
        assert stopped.states[-1] is S.STOPPING and result.outcome == "stopped"
        assert period <= result.cycles < period + 200, "it finished its period, and not the next one"
        capture = read_capture(path)
        assert np.abs(capture.samples.position[-1] - start).max() < 0.01
        told = "by the operator, key s, at the end of the period"
        assert capture.outcome is not None and capture.outcome["reason"] == told
        assert capture.outcome["ending"] == "the arm is at rest and its torque is off"

        aborted, result, path = drive("abort", {period // 4: "abort"})
        assert (aborted.states[-1], result.outcome, result.reason) == (
            S.ABORTING,
            "stopped",
            "by the operator, key a",
        )
        assert result.cycles < period, "it came to rest at once"

        last, middle, first = runs.every(catalogue, kind="run")
        assert [run.outcome for run in (first, middle, last)] == ["completed", "stopped", "stopped"]
        assert [run.reason for run in (middle, last)] == [told, "by the operator, key a"]
        assert last.facts["ending"] == "the arm is at rest and its torque is off"
        assert first.capture == str(tmp_path / "pause.mcap") and first.note == "noted"
        assert last.capture_sha256 == read_capture(path).sha256
        assert last.facts["cycles"] == result.cycles and last.arm == "emps"
        assert identity_of_capture(read_capture(path)) == arm.identity

        # While it is held, nobody else gets it; the bus has one master anyway.
        with pytest.raises(LeaseHeld, match="arm emps: is driven by"):
            leases.take(catalogue, first.arm_id, 60, holder="somebody")
    with Catalogue() as catalogue:
        assert leases.holder_of(catalogue, first.arm_id) is None


@pytest.mark.slow
def test_the_command_refuses_asks_approaches_and_records(
    emps: Robot,
    bench: Channel,
    tmp_path: Path,
    armhil: Call,
    passed: None,
) -> None:
    motion = there_and_back(emps, distance=-0.022)
    beside = Trajectory.sampled(motion.motion.parts[1], emps.bus.cycle_time, family="ruckig")  # type: ignore[attr-defined]
    path = written(tmp_path, emps, beside)

    def call(*options: object) -> tuple[int, str, str]:
        arguments = ["run", "emps", path, "--channel", bench.name, *options]
        return armhil(*arguments)

    code, _, err = call("--out", tmp_path / "a", "--yes")
    assert code == 2 and "give --approach to go there slowly" in err.splitlines()[-1]
    assert not (tmp_path / "a" / "capture.mcap").exists()
    code, _, err = call("--out", tmp_path / "n", "--approach")
    told = "asks before the arm moves; give --yes where nobody can answer"
    assert (code, err.splitlines()[-1]) == (2, f"armhil: {told}")
    code, out, err = call("--out", tmp_path / "b", "--approach", "--yes", "--json", "--note", "second")
    assert code == 0, err
    answer = json.loads(out)
    assert (answer["outcome"], answer["cycles"], answer["run"]) == ("completed", len(beside.time), 9)
    names = {path.name for path in (tmp_path / "b").iterdir()}
    assert names == {"approach.mcap", "approach.live", "capture.mcap", "capture.live"}
    lines = [
        json.loads(line) for line in spool_path(tmp_path / "b" / "capture.mcap").read_text().splitlines()
    ]
    assert [line["kind"] for line in (lines[0], lines[1], lines[-1])] == ["begin", "samples", "end"]
    assert lines[0]["cycles"] == answer["cycles"] and lines[-1]["outcome"] == "completed", "others look on"
    with Catalogue() as catalogue:
        run, move = runs.every(catalogue, kind="run")
    assert (run.stage, move.stage, run.note) == ("", "approach", "second")
    way = read_capture(tmp_path / "b" / "approach.mcap").samples
    speed = np.abs(np.diff(way.reference, axis=0)).max() / emps.bus.cycle_time
    assert speed <= 0.1 * emps.velocity_limits[0] + 1e-6


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        ({"speed": 0.0}, "speed is 0.0; allowed: above 0, up to 1"),
        ({"speed": 1.5}, "speed is 1.5; allowed: above 0, up to 1"),
    ],
)
def test_refused_before_anything_is_opened(
    emps: Robot, channel: Channel, tmp_path: Path, edit: dict[str, float], told: str
) -> None:
    path = written(tmp_path, emps, there_and_back(emps))
    request = RunRequest(order(emps, channel), path, tmp_path, **edit)
    with pytest.raises(Exception, match=told):
        run_trajectory(request, Silent(), Nobody(), unconducted)


def test_a_motion_that_breaks_a_limit_is_refused(emps: Robot, channel: Channel, tmp_path: Path) -> None:
    time = np.arange(0.0, 1.0, emps.bus.cycle_time)
    far = 0.9 * emps.upper[0] * np.sin(np.pi * np.minimum(time, 0.9) / 0.9) ** 4
    names = ",".join(["time", *(joint.name for joint in emps.joint)])
    path = tmp_path / "wild.csv"
    np.savetxt(path, np.column_stack([time, far]), delimiter=",", header=names, comments="")
    request = RunRequest(order(emps, channel), path, tmp_path)
    with pytest.raises(SessionError, match="must not be driven"):
        run_trajectory(request, Silent(), Nobody(), unconducted)


def test_no_room_on_the_disk_is_told_before_anything_moves(
    emps: Robot, channel: Channel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Full:
        free = 1000

    monkeypatch.setattr("daq.session.estimates.shutil.disk_usage", lambda _: Full)
    request = RunRequest(order(emps, channel), written(tmp_path, emps, there_and_back(emps)), tmp_path)
    with pytest.raises(SessionError, match="0 MB are free; needed"):
        run_trajectory(request, Silent(), Nobody(), unconducted)


def test_nothing_moves_without_a_yes(emps: Robot, bench: Channel, tmp_path: Path, passed: None) -> None:
    asked: list[str] = []

    path = written(tmp_path, emps, there_and_back(emps))
    with Catalogue() as catalogue:
        request = RunRequest(
            order(emps, bench), path, tmp_path, catalogue=catalogue, confirm=refusing(asked), approach=True
        )
        with pytest.raises(NotMoved):
            run_trajectory(request, Silent(), Nobody(), unconducted)
        assert runs.every(catalogue, kind="run") == ()
    (question,) = asked
    assert (
        question.startswith("emps is going to move for ")
        and "ruckig, seed 4" in question
        and not list(tmp_path.glob("*.mcap"))
    )


def test_drives_of_another_arm_are_told_before_anything_moves(emps: Robot) -> None:
    with Catalogue() as catalogue:
        refuse_strangers(catalogue, identity(), "bus")
        runs.begin(catalogue, identity(), "run")
        refuse_strangers(catalogue, identity(), "bus")
        with pytest.raises(ArmMismatch) as told:
            refuse_strangers(catalogue, identity(first=200), "socketcan:can0")
        assert str(told.value) == (
            "socketcan:can0: the drive of joint 1 has serial number 200; arm tx40 of the catalogue has 100:"
            " this is another arm; where it is meant to be, give --new-arm"
        )
        runs.begin(catalogue, identity(first=200), "run")
        refuse_strangers(catalogue, identity(first=200), "bus")
