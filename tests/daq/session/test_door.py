"""Every way to move an arm × everything that stands against it: none moves unmeant.

The drives are real ones as far as the commands know; they live in this process. A column is a function that
brings about what stands against a motion; see ``AGAINST``.
"""

from __future__ import annotations

import ast
import json
import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import daq
import robots
from daq.catalogue import leases, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import ArmIdentity, ArmMismatch
from daq.diagnosis import live
from daq.files.checksum import file_sha256
from daq.session.admission import NOT_COMMISSIONED_SPEED
from daq.session.attestation import keep_attestation
from daq.session.bench import ArmOrder, opened
from daq.session.cell import Cell
from daq.session.held_keys import HeldKeys
from daq.session.hold_to_run import hold_to_run
from daq.session.jog import HandRequest
from daq.session.motion_words import speed_share
from daq.session.recorded_runs import Recording, unconducted
from daq.session.session_error import RunInterrupted, SessionError
from daq.session.watching import Nobody
from daq.text.progress import Silent
from drivers import ArmSession, BusError, Channel, StreamResult
from drivers.bus import last_rest, lockout, state_folder
from drivers.bus.lockout import Lockout
from drivers.session import arm_session
from robots import Robot
from robots.errors import UserError
from tests.daq.calls import Call
from tests.daq.session.commissioned import commissioned, real_identity
from tests.daq.session.motions import order, there_and_back, written
from tests.daq.session.test_hold_to_run import Fingers, view_of
from tests.drivers.setup.test_setup import drives
from trajectories import approach


@dataclass(frozen=True)
class Bench:
    """An arm whose drives answer, and a motion for it; ``moved`` are the streams that were begun."""

    robot: Robot
    channel: Channel
    motion: Path
    identity: ArmIdentity
    moved: list[str]
    told: list[float]
    """Largest speeds of those streams, as shares of the limits."""


@pytest.fixture
def bench(emps: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    shutil.copytree(emps.folder, tmp_path / "arm")
    text = (tmp_path / "arm" / "robot.toml").read_text(encoding="utf-8")
    keys = f"[[drive]]\nhoming = {{ method = 37, position = {emps.home[0]}, travel = 0.001 }}\n"
    (tmp_path / "arm" / "robot.toml").write_text(text.replace("[[drive]]\n", keys), encoding="utf-8")
    robot = robots.load(tmp_path / "arm" / "robot.toml")
    motion = there_and_back(robot, distance=0.01, speed=1.0)
    moved: list[str] = []
    told: list[float] = []

    def streamed(job: Any, *_: object) -> StreamResult:
        moved.append("homing" if job.homing is not None else "stream")
        speed = np.abs(np.diff(job.units.position(job.reference), axis=0)) / job.cycle_time
        told.append(float((speed / job.velocity).max(initial=0.0)))
        return StreamResult("stopped", "this test looks no further", 0, 0, 0)

    # Everything up to the process that would move the arm is as it is.
    monkeypatch.setattr(arm_session, "run_stream", streamed)
    monkeypatch.setattr(ArmSession, "_refuse_stream", ArmSession._refuse_unacknowledged)
    for module in (lockout, last_rest):
        monkeypatch.setattr(module, "keeps_notes", lambda _: True)
    monkeypatch.setenv(state_folder.VARIABLE, str(tmp_path / "state"))
    monkeypatch.setattr(live, "plan", lambda *_, **__: motion)
    channel = Channel("virtual", f"door-{tmp_path.name}")
    with drives(robot, channel):
        yield Bench(robot, channel, written(tmp_path, robot, motion), real_identity(robot, 0), moved, told)


WAYS: dict[str, Callable[[Bench], tuple[object, ...]]] = {
    "run": lambda bench: ("run", bench.robot.folder, bench.motion),
    "jog": lambda bench: ("jog", bench.robot.folder, "--joint", 1, "--by", "2mm"),
    "home": lambda bench: ("home", bench.robot.folder, "--joint", 1),
    "commission": lambda bench: ("commission", bench.robot.folder, "--trajectory", bench.motion, "--move"),
    "check": lambda bench: ("check", bench.robot.folder, "--trajectory", bench.motion),
    "diagnose": lambda bench: ("diagnose", "--live", bench.robot.folder, "--duration", 4),
}
"""Every command that may move an arm; all but check, which asks nobody, get ``--yes``."""


def as_it_should_be(bench: Bench, identity: ArmIdentity | None = None) -> None:
    identity = identity or bench.identity
    commissioned(identity, trajectory_sha256=file_sha256(bench.motion))
    with Catalogue() as catalogue:
        its = order(bench.robot, bench.channel, str(bench.robot.folder))
        keep_attestation(catalogue, identity, np.array(bench.robot.home), its, "")


def never_commissioned(bench: Bench) -> None:
    """Nothing is known of it."""


def other_description(bench: Bench) -> None:
    as_it_should_be(bench, replace(bench.identity, description_sha256="e" * 64))


def other_urdf(bench: Bench) -> None:
    """A mass that somebody has edited since."""
    as_it_should_be(bench)
    text = bench.robot.urdf_path.read_text(encoding="utf-8")
    edited = re.sub(r'(<mass value=")[^"]*"', r'\g<1>4.75"', text)
    assert edited != text
    bench.robot.urdf_path.write_text(edited, encoding="utf-8")


def other_serial(bench: Bench) -> None:
    as_it_should_be(bench, replace(bench.identity, serials=(4711,)))


def other_cell(bench: Bench) -> None:
    commissioned(bench.identity, trajectory_sha256=file_sha256(bench.motion), cell_sha256="c" * 64)


def up_to_the_slow_run(bench: Bench) -> None:
    commissioned(bench.identity, trajectory_sha256=file_sha256(bench.motion), until="slow run")


def unacknowledged(bench: Bench) -> None:
    """The note of a stream whose processes were killed is all that is left of it."""
    as_it_should_be(bench)
    Lockout(bench.channel, bench.robot.name).begin()


def kept_at_rest(bench: Bench, **changes: object) -> None:
    """The record of the last rest, changed: what it said before the arm was moved, or its encoder turned."""
    as_it_should_be(bench)
    with ArmSession(bench.robot, bench.channel) as session:
        assert session.position_doubt is None
        session._memory.keep_rest()
    (record,) = state_folder.places()[0].glob("rest-*.json")
    record.write_text(json.dumps(json.loads(record.read_text()) | changes), encoding="utf-8")


def shifted_zero(bench: Bench) -> None:
    """The drives were off, nobody moved it, and it reads 50 mm from where it came to rest."""
    kept_at_rest(bench, position=[bench.robot.home[0] + 0.05])


def other_home_offset(bench: Bench) -> None:
    """607C is another one than at the last rest."""
    kept_at_rest(bench, offsets=[4711])


def leased(bench: Bench) -> None:
    as_it_should_be(bench)
    with Catalogue() as catalogue:
        (arm,) = {run.arm_id for run in runs.every(catalogue)}
        leases.take(catalogue, arm, 600.0, holder="somebody")


AGAINST: dict[str, tuple[Callable[[Bench], None], str]] = {
    "never commissioned": (never_commissioned, "has not been commissioned: `armhil commission "),
    "other description": (
        other_description,
        "was commissioned with another description (",
    ),
    "other URDF": (other_urdf, "was commissioned with another description ("),
    "other serial": (other_serial, "this is another arm; where it is meant to be, give --new-arm"),
    "other cell": (other_cell, "give --cell as it was given there"),
    "up to the slow run": (up_to_the_slow_run, "has not been commissioned: `armhil commission "),
    "unacknowledged": (unacknowledged, "look at the arm, then `armhil acknowledge "),
    "shifted zero": (shifted_zero, "its zero has moved, or it was moved while nothing drove it; look where"),
    "other home offset": (
        other_home_offset,
        "look where it stands and attest that (`armhil home`, or --stands",
    ),
    "leased": (leased, "is driven by somebody"),
}
"""What stands against a motion: how it comes about, and what is told. Add a column here."""

_NOT_ATTESTED = "nobody has compared the drives' positions with this arm"
_OTHERWISE: dict[tuple[str, str], str | None] = {
    ("commission", "never commissioned"): _NOT_ATTESTED,
    ("commission", "other description"): _NOT_ATTESTED,
    ("commission", "other URDF"): _NOT_ATTESTED,
    ("commission", "other cell"): _NOT_ATTESTED,
    ("commission", "up to the slow run"): None,  # what it is there for: the full run follows
    ("home", "other cell"): None,  # a search is too small for a cell to matter
    ("home", "shifted zero"): None,  # what it is there for: it ends with a look at where the arm stands
    ("home", "other home offset"): None,
}
"""Where a way is meant to go on, or told something else."""


def call(bench: Bench, armhil: Call, way: str, folder: Path, *more: object) -> tuple[int, str]:
    where = ("--interface", "virtual", "--channel", bench.channel.name, "--out", folder / "out")
    yes = () if way == "check" else ("--yes",)
    code, _, err = armhil(*WAYS[way](bench), *where, *yes, *more)
    return code, err.strip().splitlines()[-1]


@pytest.mark.slow
@pytest.mark.parametrize("against", AGAINST)
@pytest.mark.parametrize("way", WAYS)
def test_none_moves_unmeant(bench: Bench, armhil: Call, tmp_path: Path, way: str, against: str) -> None:
    comes_about, told = AGAINST[against]
    comes_about(bench)
    # A commissioned arm has nothing left to be driven through, unless a stage is asked for again.
    again = (
        ("--from", "warm-up")
        if way == "commission" and comes_about in (shifted_zero, other_home_offset)
        else ()
    )
    code, line = call(bench, armhil, way, tmp_path, *again)
    otherwise = _OTHERWISE.get((way, against), told)
    if otherwise is None:
        assert bench.moved, line
        return
    assert bench.moved == [], line
    assert code == 2 and line.startswith("armhil: ") and otherwise in line


@pytest.mark.slow
@pytest.mark.parametrize("against", [*AGAINST, ""])
def test_nor_does_a_key_that_is_held(bench: Bench, tmp_path: Path, against: str) -> None:
    comes_about, told = AGAINST.get(against, (as_it_should_be, "this test looks no further"))
    comes_about(bench)
    view = view_of(bench.robot)
    keys = cast(HeldKeys, Fingers(view, hold="+", way=1.0))
    as_it_is_now = robots.load(bench.robot.folder / "robot.toml")
    its = order(as_it_is_now, bench.channel, str(bench.robot.folder))
    with Catalogue() as catalogue:
        request = HandRequest(its, tmp_path, catalogue=catalogue)
        with pytest.raises((UserError, RunInterrupted)) as error:
            hold_to_run(request, Silent(), keys, view)
    assert bench.moved == ([] if against else ["stream"])
    assert told in str(error.value)


@pytest.mark.slow
@pytest.mark.parametrize("against", AGAINST)
def test_acknowledging_moves_nothing_and_opens_no_other_door(
    bench: Bench, armhil: Call, tmp_path: Path, against: str
) -> None:
    comes_about, told = AGAINST[against]
    comes_about(bench)
    where = ("--interface", "virtual", "--channel", bench.channel.name)
    armhil("acknowledge", bench.robot.folder, *where, "--yes")
    assert bench.moved == []
    _, line = call(bench, armhil, "run", tmp_path)
    if against == "unacknowledged":
        assert bench.moved == ["stream"], line
    else:
        assert bench.moved == [] and told in line


@pytest.mark.slow
def test_a_demo_does_not_move_drives_that_it_did_not_start(
    bench: Bench, armhil: Call, tmp_path: Path
) -> None:
    as_it_should_be(bench)
    where = ("--interface", "virtual", "--channel", bench.channel.name, "--out", tmp_path / "out")
    code, _, err = armhil("demo", "emps", *where, "--duration", 4, "--evaluations", 50, "--periods", 1)
    assert (code, bench.moved) == (2, []), err
    assert err.strip().splitlines()[-1].startswith("armhil: "), err


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_an_arm_that_is_as_it_should_be_moves(bench: Bench, armhil: Call, tmp_path: Path, way: str) -> None:
    as_it_should_be(bench)
    more = ("--from", "warm-up") if way == "commission" else ()
    _, line = call(bench, armhil, way, tmp_path, *more)
    assert bench.moved == ["homing" if way == "home" else "stream"], line


@pytest.mark.slow
@pytest.mark.parametrize("way", ["run", "jog", "diagnose"])
def test_the_one_way_round_is_slow_and_asks_where_the_arm_stands(
    bench: Bench, armhil: Call, tmp_path: Path, way: str
) -> None:
    slow = ("--speed", 0.1) if way == "run" else ()
    _, line = call(bench, armhil, way, tmp_path, "--not-commissioned", *slow)
    assert bench.moved == [] and "give --stands-at where nobody can answer" in line, "--yes has no eyes"
    _, line = call(bench, armhil, way, tmp_path / "b", "--not-commissioned", *slow, "--stands-at", "0.9")
    assert bench.moved == [] and "stands at" in line
    here = ("--stands-at", bench.robot.home[0])
    if way == "run":
        _, line = call(bench, armhil, way, tmp_path / "c", "--not-commissioned", *here)
        assert bench.moved == [] and "of the speed limits; allowed: 10 %, on an arm that has not been" in line
    _, line = call(bench, armhil, way, tmp_path / "d", "--not-commissioned", *slow, *here)
    assert bench.moved == ["stream"], line
    assert 0 < bench.told[0] <= NOT_COMMISSIONED_SPEED + 1e-3


def test_nothing_else_opens_an_arm() -> None:
    """Whoever adds a way to move gives it a row above, or says here why it needs none."""
    found: dict[str, set[str]] = {}
    for file in sorted(Path(daq.__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                name = getattr(node.func, "id", getattr(node.func, "attr", ""))
                if name in ("opened", "ArmSession", "run_stream"):
                    found.setdefault(name, set()).add(str(file.relative_to(Path(daq.__file__).parent)))
    assert found == {
        "opened": {
            "check/recorded.py",
            "cli/demonstration.py",
            "cli/diagnose.py",
            "session/commission.py",
            "session/hold_to_run.py",
            "session/home.py",
            "session/jog.py",
            "session/run.py",
        },
        "ArmSession": {"session/bench.py", "session/acknowledgement.py"},
    }


def test_a_catalogue_that_is_not_looked_at_opens_nothing(bench: Bench, armhil: Call, tmp_path: Path) -> None:
    as_it_should_be(bench)
    for way in ("run", "jog", "home", "diagnose"):
        code, line = call(bench, armhil, way, tmp_path, "--no-catalogue")
        assert (code, bench.moved) == (2, []) and "leave out --no-catalogue" in line


def replace_start(bench: Bench) -> Bench:
    """The same with a motion that begins where the arm does not stand."""
    robot, home = bench.robot, np.array(bench.robot.home)
    motion = approach(robot, home + 0.03, home + 0.04, robot.bus.cycle_time, 1.0)
    folder = bench.motion.parent / "away"
    folder.mkdir()
    return replace(bench, motion=written(folder, robot, motion))


def test_no_faster_than_it_has_passed(bench: Bench, armhil: Call, tmp_path: Path) -> None:
    share = speed_share(bench.robot, there_and_back(bench.robot, distance=0.01, speed=1.0))
    commissioned(bench.identity, speed=0.5 * share)
    code, line = call(bench, armhil, "run", tmp_path)
    assert (code, bench.moved) == (2, []) and "0.5 of its speed would do" in line
    # Before the way to its beginning, too; and nothing that streams goes round it.
    away = replace_start(bench)
    code, line = call(away, armhil, "run", tmp_path / "c", "--approach")
    assert (code, bench.moved) == (2, []) and "of its speed would do" in line
    its = order(bench.robot, bench.channel, str(bench.robot.folder))
    fast = there_and_back(bench.robot, distance=0.01, speed=1.0)
    with Catalogue() as catalogue, opened(its, catalogue, Silent(), "drive", Cell()) as arm:
        recording = Recording(arm, its, catalogue, Nobody(), unconducted)
        with pytest.raises(SessionError, match="of its speed would do"):
            recording.record("run", "too fast", fast, tmp_path / "fast.mcap")
    assert bench.moved == []
    call(bench, armhil, "run", tmp_path / "b", "--speed", 0.5)
    assert bench.moved == ["stream"] and bench.told[0] == pytest.approx(0.5 * share, rel=0.02)


@pytest.mark.parametrize("speed", [float("nan"), float("inf"), 57.0, -1.0])
def test_a_speed_that_is_none_allows_none(bench: Bench, armhil: Call, tmp_path: Path, speed: float) -> None:
    """nan compares with nothing: no motion is faster than it."""
    commissioned(bench.identity, trajectory_sha256=file_sha256(bench.motion), speed=speed)
    code, line = call(bench, armhil, "run", tmp_path)
    assert (code, bench.moved) == (2, []) and "allowed: 0 %" in line


def test_no_simulated_drives_where_real_ones_can_be(emps: Robot, armhil: Call, tmp_path: Path) -> None:
    for name in ("can0", "slcan0"):
        its = ArmOrder(emps, "emps", Channel("socketcan", name), simulated=True)
        with (
            pytest.raises(BusError, match="real drives can be on it; allowed for simulated drives: udp"),
            opened(its, None, Silent(), "drive"),
        ):
            pass


def test_drives_that_are_not_the_ones_that_were_started_are_left_alone(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Other drives on the bus answer in place of the simulated ones."""
    monkeypatch.setattr("daq.session.bench._start_drives", lambda its, *_: (SimpleNamespace(), bench.channel))
    its = ArmOrder(bench.robot, str(bench.robot.folder), bench.channel, simulated=True, seed=9)
    with pytest.raises(ArmMismatch, match="other drives answer"), opened(its, None, Silent(), "drive"):
        pass
