"""A drive that searches its home under the eyes of the master."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import robots
from drivers import ArmSession, Channel, DriveError, Request, Samples
from drivers.cia402 import objects
from drivers.frames.job import HomingJob
from drivers.session.following_windows import homing_job
from drivers.setup.homing import Homing, end_homing, prepare_homing
from drivers.setup.profiles import Profile, known_profiles
from drivers.simulated import EmergencyAt, Faults, PlantTruth, SimulatedArm, nominal_truth
from drivers.simulated.device import described_devices
from drivers.simulated.in_process import InProcessBus, InProcessRun, stream_in_process
from drivers.simulated.quirks import KINDS
from robots import Robot
from tests.drivers.setup.test_setup import drives

AXIS = 2


@pytest.fixture(scope="module")
def truth(tx40: Robot) -> PlantTruth:
    return nominal_truth(tx40)


def search(
    robot: Robot,
    truth: PlantTruth,
    method: int,
    *,
    job: HomingJob | None = None,
    faults: Faults | None = None,
    requests: dict[int, Request] | None = None,
) -> InProcessRun:
    """One search of the third drive, in virtual time."""

    def setup(bus: InProcessBus) -> None:
        dictionary = bus.group.drives[AXIS].dictionary
        dictionary.write(objects.MODE, 0, bytes([objects.HOMING]))
        dictionary.write(objects.HOMING_METHOD, 0, bytes([method]))

    bounds = job or HomingJob(AXIS, travel=2 * robot.drive[AXIS].encoder_counts, seconds=20.0)
    home = np.array(robot.home)[None, :]
    return stream_in_process(
        robot, truth, home, faults or Faults(), requests=requests, homing=bounds, setup=setup
    )


@pytest.mark.parametrize("method", [33, 34, 37])
def test_a_search_ends_with_the_home_found_and_the_arm_disabled(
    tx40: Robot, truth: PlantTruth, method: int
) -> None:
    run = search(tx40, truth, method)
    assert run.result is not None and run.result.outcome == "completed", run.result
    drive = run.bus.group.drives[AXIS]
    assert drive.homing.attained and not run.bus.powered
    scale = tx40.counts_per_output_unit
    moved = run.bus.group.bench.plant.drive_position() * scale
    moved -= tx40.transmission_matrix @ tx40.home * scale
    turn = tx40.drive[AXIS].encoder_counts
    assert abs(moved[AXIS]) < (1.5 * turn if method != 37 else 200)
    assert (np.abs(np.delete(moved, AXIS)) < 300).all(), "the others hold"
    # What the drive reads now is the way from the index that it found.
    read = drive.dictionary.integer(0x6064)
    where = run.bus.group.bench.plant.drive_position()[AXIS] * scale[AXIS]
    if method == 37:
        assert abs(read) < 200
    else:
        assert (where - read) / turn == pytest.approx(round((where - read) / turn), abs=0.001)


@pytest.mark.parametrize(
    ("method", "job", "outcome", "words"),
    [
        (
            34,
            HomingJob(AXIS, 20, 20.0),
            "aborted",
            r"joint_3 moved \d+ counts without finding its home; allowed: 20",
        ),
        (34, HomingJob(AXIS, 200_000, 0.2), "aborted", "joint_3 has not found its home in 0.2 s"),
        (17, None, "fault", r"joint_3 reports a homing error \(statusword 0x.*, bit 13\)"),
    ],
)
def test_a_search_without_an_end_is_ended(
    tx40: Robot, truth: PlantTruth, method: int, job: HomingJob | None, outcome: str, words: str
) -> None:
    run = search(tx40, truth, method, job=job)
    assert run.result is not None and run.result.outcome == outcome
    assert re.search(words, run.result.reason), run.result.reason
    assert not run.bus.powered


@pytest.mark.parametrize(
    ("kind", "outcome", "words"),
    [
        ("cia402", "completed", ""),
        ("negated_home, told so", "completed", ""),
        ("negated_home", "aborted", r"found its home but reads -?\d+ counts there; homing.position is -?\d+"),
        ("homed_untruly", "aborted", r"found its home but reads -?\d+ counts there; homing.position is"),
        ("fast_homing", "aborted", r"counts in \S+ s of its search; it was told \d+ counts per second"),
    ],
)
def test_a_search_ends_where_it_was_meant(
    tx40: Robot, truth: PlantTruth, kind: str, outcome: str, words: str
) -> None:
    homing = Homing("joint_3", 34, 0.7, travel=1.0, share=0.02)
    job = homing_job(tx40, homing)

    def setup(bus: InProcessBus) -> None:
        dictionary = bus.group.drives[AXIS].dictionary
        speed, acceleration = homing.pace(tx40)
        size = abs(tx40.counts_per_output_unit[AXIS])
        dictionary.set(objects.MODE, 0, objects.HOMING)
        dictionary.set(objects.HOMING_METHOD, 0, homing.method)
        dictionary.set(objects.HOMING_SPEEDS, 2, round(speed * size))
        dictionary.set(objects.HOMING_ACCELERATION, 0, round(acceleration * size))
        offset = homing.offset(tx40)
        dictionary.set(objects.HOME_OFFSET, 0, -offset if "told" in kind else offset)

    run = stream_in_process(
        tx40,
        truth,
        np.array(tx40.home)[None, :],
        homing=job,
        setup=setup,
        devices=described_devices(tx40, KINDS[kind.partition(",")[0]]),
    )
    assert run.result is not None and run.result.outcome == outcome, run.result
    assert re.search(words, run.result.reason), run.result.reason
    assert not run.bus.powered
    moved = run.bus.group.bench.plant.drive_position() - tx40.transmission_matrix @ tx40.home
    assert abs(moved[AXIS]) < np.deg2rad(15.0)
    if outcome == "completed":
        assert abs(run.bus.group.drives[AXIS].dictionary.integer(0x6064) - job.home) <= job.near


def test_a_drive_that_shows_its_mode_late_is_homed_and_led_back(
    tx40: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    late = Profile("own", "", vendor=0, mode_shown_when_enabled=True)
    monkeypatch.setitem(known_profiles(), "own", late)
    made, channel = described_devices(tx40, KINDS["mode_shown_late"]), Channel("virtual", "late mode")
    with drives(tx40, channel, devices=made) as group, ArmSession(tx40, channel) as session:
        sdo, report = session._connection.drives[AXIS], session.drives[AXIS]
        modes = []
        prepare_homing(sdo, tx40, Homing("joint_3", 34, 0.0, travel=1.0), report.settings, report.profile)
        modes.append(group.drives[AXIS].dictionary.integer(objects.MODE))
        end_homing(sdo, report.mode, report.profile)
        modes.append(group.drives[AXIS].dictionary.integer(objects.MODE))
    assert modes == [objects.HOMING, objects.CYCLIC_SYNCHRONOUS_POSITION]


@pytest.mark.parametrize("negated", [False, True])
def test_the_home_offset_of_a_kind_of_drive(tx40: Robot, negated: bool) -> None:
    homing, channel = Homing("joint_3", 34, 0.7, travel=1.0), Channel("virtual", f"offset {negated}")
    profile = Profile("own", "", home_offset_negated=negated)
    with drives(tx40, channel) as group, ArmSession(tx40, channel) as session:
        sdo = session._connection.drives[AXIS]
        prepare_homing(sdo, tx40, homing, session.drives[AXIS].settings, profile)
        offset = group.drives[AXIS].dictionary.integer(objects.HOME_OFFSET)
    assert offset == (-1 if negated else 1) * homing.offset(tx40) != 0


@pytest.mark.parametrize("request_", [Request.ABORT, Request.HALT])
def test_a_search_is_stopped_on_request(tx40: Robot, truth: PlantTruth, request_: Request) -> None:
    run = search(tx40, truth, 34, requests={60: request_})
    assert run.result is not None and run.result.outcome == "stopped"
    assert not run.bus.powered and not run.bus.group.drives[AXIS].homing.attained


def test_a_fault_of_another_drive_ends_a_search(tx40: Robot, truth: PlantTruth) -> None:
    run = search(tx40, truth, 34, faults=Faults(emergencies=(EmergencyAt(5, 60, 0x2310),)))
    assert run.result is not None and run.result.outcome == "fault"
    assert "joint_5" in run.result.reason and not run.bus.powered


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"joint": "elbow"}, "no joint 'elbow' to home; allowed: joint_1, "),
        ({"method": 0}, "homing method 0; allowed: 1 to 37"),
        ({"share": 0.2}, "homing at 0.2 of the limits; allowed: above 0, at most 0.05"),
        ({"travel": 0.0}, "homing: travel is 0; allowed: above 0"),
        ({"seconds": float("inf")}, "homing: seconds is inf; allowed: above 0"),
        ({"position": float("nan")}, "homing: position is nan; allowed: a finite number"),
    ],
)
def test_what_cannot_be_searched_for_is_refused(tx40: Robot, changes: dict[str, object], words: str) -> None:
    homing = replace(Homing("joint_1", 37, 0.0, 0.1), **changes)  # type: ignore[arg-type]
    with pytest.raises(DriveError, match=words):
        homing.axis(tx40)


@pytest.fixture
def forgetful(tmp_path: Path) -> Robot:
    """The arm with a third drive that loses its position with the supply."""
    folder = tmp_path / "tx40"
    shutil.copytree(Path(robots.__file__).parent / "tx40", folder)
    text = (folder / "robot.toml").read_text(encoding="utf-8")
    parts = text.split("[[drive]]\n")
    parts[1 + AXIS] = 'position_reference = "homing"\n' + parts[1 + AXIS]
    (folder / "robot.toml").write_text("[[drive]]\n".join(parts), encoding="utf-8")
    return robots.load(folder / "robot.toml")


def test_an_arm_that_forgot_is_homed_attested_and_streamed(
    forgetful: Robot, new_channel: Callable[[], Channel]
) -> None:
    channel = new_channel()
    at = float((forgetful.transmission_matrix @ forgetful.home)[AXIS])
    still = np.tile(np.array(forgetful.home), (50, 1))
    source = str(forgetful.folder / "robot.toml")
    with SimulatedArm(source, channel, seed=1), ArmSession(forgetful, channel, allow_jog=True) as session:
        assert abs(session.actual_position()[AXIS]) < 1e-3, "it woke up at zero"
        with pytest.raises(DriveError, match=r"joint_3: its drive's position is lost with the supply"):
            session.stream(still, lambda samples: None)
        with pytest.raises(DriveError, match=r"joint_3 stands at 1.5\d* but its drive says"):
            session.attest_position(forgetful.home)
        result = session.home(Homing("joint_3", 37, at, travel=0.01))
        assert result.outcome == "completed", result.reason
        with pytest.raises(DriveError, match="attest where the arm stands"):
            session.stream(still, lambda samples: None)
        session.attest_position(forgetful.home)
        assert session.home(Homing("joint_3", 37, at, travel=0.01)).outcome == "completed"
        with pytest.raises(DriveError, match="attest where the arm stands"):
            session.stream(still, lambda samples: None)  # what was attested before is another position
        session.attest_position(forgetful.home)
        batches: list[Samples] = []
        assert session.stream(still, batches.append).outcome == "completed"
        np.testing.assert_allclose(Samples.concatenate(batches).position[-1], forgetful.home, atol=2e-3)


def test_nothing_is_homed_unless_it_was_allowed(tx40: Robot) -> None:
    session = ArmSession(tx40, Channel("virtual", "never opened"))
    with pytest.raises(DriveError, match="homing is not allowed in this session"):
        session.home(Homing("joint_3", 37, 0.0, travel=0.01))
