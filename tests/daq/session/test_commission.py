"""armhil commission on simulated drives: locked, dry, one stage after the other, and nothing twice."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import robots
from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.doctor.check import Check
from daq.files.cell_file import read_cell
from daq.recording.reader import read_capture
from daq.session import commission as commission_module
from daq.session.cell import cell_of
from daq.session.commission import StageDone, commission
from daq.session.dry_run import CommissionRequest, Planned, plan_commission
from daq.session.estimates import FIXED_BYTES, estimate
from daq.session.home import HomeRequest, home
from daq.session.recorded_runs import CELSIUS, unconducted
from daq.session.session_error import NotMoved, RunInterrupted, SessionError
from daq.session.stages import TRAJECTORY_FILE
from daq.session.states import Conduct
from daq.session.streaming import Nobody
from daq.session.warm_up import MOST, SHARE, warm_up
from daq.text.progress import Silent
from drivers import Channel, listen_for_traffic
from robots import Robot
from tests.daq.calls import Call
from tests.daq.session.motions import order, refusing, there_and_back, written
from trajectories import Trajectory


def names(done: tuple[StageDone, ...]) -> list[str]:
    return [stage.name for stage in done]


def letters(planned: Planned) -> str:
    return "".join(status.state[0] for status in planned.states)


@pytest.fixture
def request_for(emps: Robot, bench: Channel, tmp_path: Path) -> CommissionRequest:
    motion = written(tmp_path, emps, there_and_back(emps, distance=0.01, speed=1.0))
    arm = order(emps, bench, stands_at=tuple(emps.home))
    return CommissionRequest(arm, tmp_path, motion)


def go(request: CommissionRequest) -> tuple[StageDone, ...]:
    return commission(request, plan_commission(request, Silent()), Silent(), Nobody(), unconducted)


@pytest.mark.slow
def test_stage_by_stage(emps: Robot, request_for: CommissionRequest, tmp_path: Path) -> None:
    with Catalogue() as catalogue:
        request = replace(request_for, catalogue=catalogue, celsius=19.5)
        assert letters(plan_commission(request, Silent())) == "olllllll"
        assert runs.every(catalogue) == (), "a dry run is no run"

        with pytest.raises(SessionError, match="stage full run is locked: plan has not passed yet"):
            go(replace(request, first="full run"))

        done = go(replace(request, last="slow run"))
        assert names(done) == ["plan", "check", "first move", "approach", "warm-up", "slow run"]
        kept = [run for run in reversed(runs.every(catalogue)) if run.kind == "commission"]
        steps = [run for run in kept if run.stage.startswith("first move: ")]
        assert [run.stage.removeprefix("first move: ") for run in steps] == [
            "at rest",
            "carriage touch",
            "carriage 0.5 deg",
        ]
        kept = [run for run in kept if run not in steps]
        assert [run.stage for run in kept] == names(done)
        assert {run.outcome for run in kept} == {"completed"}
        assert [stage.run for stage in done] == [run.id for run in kept]

        path = tmp_path / "slow-run.mcap"
        slow = read_capture(path)
        wanted = estimate(emps, len(slow.samples) * emps.bus.cycle_time).size
        assert 0.3 * wanted < path.stat().st_size < wanted, "the estimate is on the safe side"
        speed = np.abs(np.diff(slow.samples.reference, axis=0)).max() / emps.bus.cycle_time
        assert 0 < speed <= 0.1 * emps.velocity_limits[0]
        assert slow.run["kind"] == "real" and slow.run["trajectory_sha256"]

        # It goes on where it stopped, and a slow run that passed is not made again.
        assert letters(plan_commission(request, Silent())) == "ppppppol"
        done = go(request)
        assert names(done) == ["full run", "return"]
        full = read_capture(tmp_path / "full-run.mcap")
        speeds = np.abs(np.diff(full.samples.reference, axis=0)).max() / emps.bus.cycle_time
        assert speeds == pytest.approx(10 * speed, rel=0.02)
        assert letters(plan_commission(request, Silent())) == "pppppppp"
        # Its file is kept, so that nights drive this motion once a model of the full run is accepted.
        (last,) = (run for run in runs.every(catalogue) if run.stage == "full run")
        assert request.trajectory is not None
        assert Path(str(last.facts[TRAJECTORY_FILE])) == request.trajectory.absolute()
        assert last.facts[CELSIUS] == "19.5", "or no later night is compared by temperature"

        # What was passed counts neither for another description, nor for another trajectory or arm.
        edited = tmp_path / "edited"
        shutil.copytree(emps.folder, edited)
        text = (edited / "robot.toml").read_text(encoding="utf-8")
        (edited / "robot.toml").write_text(text.replace("jerk = 100.0", "jerk = 101.0"), encoding="utf-8")
        arm = replace(request.arm, robot=robots.load(edited), source=str(edited))
        assert letters(plan_commission(replace(request, arm=arm), Silent())) == "olllllll"
        # Nor for another cell.
        (tmp_path / "cell.toml").write_text("format = 1\nfloor = -1.0\n", encoding="utf-8")
        walled = replace(request, cell=cell_of(tmp_path / "cell.toml"))
        assert letters(plan_commission(walled, Silent())) == "olllllll"
        other = tmp_path / "other"
        other.mkdir()
        longer = written(other, emps, there_and_back(emps, distance=0.02))
        assert letters(plan_commission(replace(request, trajectory=longer), Silent())) == "olllllll"


def test_a_no_ends_it_there_and_what_passed_is_kept(request_for: CommissionRequest) -> None:
    asked: list[str] = []

    with Catalogue() as catalogue:
        request = replace(request_for, catalogue=catalogue, confirm=refusing(asked))
        with pytest.raises(NotMoved, match="stage first move was not confirmed"):
            go(request)
        assert letters(plan_commission(request, Silent())) == "ppolllll"
    assert len(asked) == 1 and asked[0].startswith("Stage first move: emps is going to move for ")
    assert not list(request_for.folder.glob("*.mcap"))


def test_a_stage_that_is_stopped_has_not_passed(request_for: CommissionRequest) -> None:
    class Stopper(Nobody):
        def begin(self, title: str, trajectory: Trajectory, conduct: Conduct) -> None:
            conduct.begin()
            conduct.wish("abort", "somebody came too close")

    with Catalogue() as catalogue:
        request = replace(request_for, catalogue=catalogue)
        planned = plan_commission(request, Silent())
        ended = r"^stopped \(somebody came too close\): the arm is at rest and its torque is off; \d+ cycles"
        with pytest.raises(RunInterrupted, match=ended):
            commission(request, planned, Silent(), Stopper(), unconducted)
        assert letters(plan_commission(request, Silent())) == "ppolllll"
        assert runs.every(catalogue)[0].outcome == "stopped"


def test_an_unfit_machine_does_not_pass_the_check(
    request_for: CommissionRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    unfit = (Check("clock", "failed", "stands still", "wind it up"),)
    monkeypatch.setattr(commission_module, "examine", lambda *_: unfit)
    with Catalogue() as catalogue:
        request = replace(request_for, catalogue=catalogue)
        with pytest.raises(SessionError, match=r"^stage check: clock: stands still; wind it up; see"):
            go(request)
        assert letters(plan_commission(request, Silent())) == "pollllll"


def test_the_check_asks_who_has_looked_at_the_arm(emps: Robot, request_for: CommissionRequest) -> None:
    arm = replace(request_for.arm, stands_at=None)
    with Catalogue() as catalogue:
        request = replace(request_for, arm=arm, catalogue=catalogue, last="check")
        with pytest.raises(SessionError, match="nobody has compared the drives' positions with this arm"):
            go(request)
        assert letters(plan_commission(request, Silent())) == "pollllll"
        attested = home(HomeRequest(arm, request.folder, catalogue=catalogue), Silent(), unconducted)
        done = go(request)
        assert names(done) == ["check"]
        assert f"posture attested by {runs.every(catalogue)[0].who} in run {attested.run}" in done[0].words


@pytest.mark.parametrize("speed", [0.0, 0.11, 1.0, float("nan")])
def test_a_slow_run_is_slow(request_for: CommissionRequest, speed: float) -> None:
    with pytest.raises(SessionError, match=r"--slow-speed \S+; allowed: above 0, up to 0.1"):
        plan_commission(replace(request_for, slow_speed=speed), Silent())


def test_the_command_is_dry_unless_told(
    emps: Robot,
    channel: Channel,
    tmp_path: Path,
    armhil: Call,
) -> None:
    def call(*options: object) -> tuple[int, dict[str, Any] | None, str]:
        arguments = ["commission", "emps", "--channel", channel.name, "--json", *options]
        code, out, err = armhil(*arguments)
        return code, json.loads(out) if out else None, err

    motion = written(tmp_path, emps, there_and_back(emps, distance=0.01))
    code, answer, err = call("--trajectory", motion, "--out", tmp_path / "a")
    assert code == 0 and answer is not None and answer["done"] == []
    assert [stage["state"] for stage in answer["stages"]] == ["open", *["locked"] * 7]
    assert answer["cell_sha256"] is None and "Keeps clear of: nothing but the arm itself" in err
    assert answer["stages"][5]["seconds"] == pytest.approx(10 * answer["stages"][6]["seconds"], rel=0.01)
    assert "Dry run: nothing was sent and nothing moved" in err
    assert f"armhil commission emps --channel {channel.name} --trajectory {motion} --move" in err
    assert listen_for_traffic(channel, 0.1) == frozenset()
    # A real arm asks; nobody can answer here, and there are no drives either.
    code, answer, err = call("--trajectory", motion, "--out", tmp_path / "b", "--from", "fast")
    assert (code, answer) == (2, None) and "--from fast; allowed: plan, check, first-move" in err
    missing = tmp_path / "none.toml"
    code, answer, err = call("--trajectory", motion, "--out", tmp_path / "b", "--cell", missing)
    assert (code, answer) == (2, None) and f"{missing}: " in err
    cell = tmp_path / "cell.toml"
    cell.write_text("format = 1\nfloor = -1.0\n", encoding="utf-8")
    code, answer, err = call(
        "--trajectory",
        motion,
        "--cell",
        cell,
        "--out",
        tmp_path / "c",
        "--move",
        "--simulated",
        "--until",
        "check",
        "--quiet",
    )
    assert code == 0 and answer is not None, err
    assert [stage["stage"] for stage in answer["done"]] == ["plan", "check"]
    assert answer["cell_sha256"] == read_cell(cell).sha256
    assert f"Keeps clear of: {cell}: floor at -1 m" in " ".join(err.split())


def test_estimates(emps: Robot, tx40: Robot) -> None:
    six, one = ((estimate(arm, 1e4).size - FIXED_BYTES) * arm.bus.cycle_time / 1e4 for arm in (tx40, emps))
    assert 735 < six < 1.5 * 735 and 206 < one < 1.5 * 206, "bytes a cycle, as measured"
    assert estimate(emps, 3725.0).words() == f"62 min 05 s, {estimate(emps, 3725.0).size / 1e6:.1f} MB"
    assert estimate(emps, 5.0).words().startswith("5 s, ")


def test_the_warm_up_moves_each_joint_alone_and_slowly(tx40: Robot) -> None:
    home = np.array(tx40.home)
    motion = warm_up(tx40, home)
    away = motion.position - home
    moved = np.abs(away) > 1e-6
    assert moved.any(axis=0).all(), "every joint"
    assert moved.sum(axis=1).max() == 1, "alone"
    assert np.abs(away).max() <= MOST + 1e-9
    assert (np.abs(away).max(axis=0) <= SHARE * (tx40.upper - tx40.lower) + 1e-9).all()
    assert (np.abs(motion.velocity) <= 0.1 * tx40.velocity_limits + 1e-9).all()
    assert np.abs(motion.position[-1] - home).max() < 1e-9


def test_the_warm_up_goes_where_there_is_room(emps: Robot) -> None:
    once, twice = (warm_up(emps, np.array(emps.home), rounds=rounds) for rounds in (1, 2))
    assert twice.duration == pytest.approx(2 * once.duration, abs=2 * emps.bus.cycle_time)
    edge = warm_up(emps, emps.upper)
    assert edge.position.max() <= emps.upper[0] + 1e-9 and np.ptp(edge.position) > 0.01
