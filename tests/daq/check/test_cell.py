"""``armhil check --cell``: judged before anything moves, kept with the run, told where it is another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from daq.catalogue import arms, baselines, runs
from daq.catalogue.database import Catalogue
from daq.check.check import run_check
from daq.check.fleet import FleetArm
from daq.check.recorded import CELL_SHA256, planned_motion, record_check
from daq.check.request import CheckRequest
from daq.recording.reader import read_capture
from daq.service.driving import options_of
from daq.service.units import Schedule
from daq.session.bench import ArmOrder
from daq.session.cell import cell_of
from daq.session.recorded_runs import unconducted
from daq.session.session_error import SessionError
from daq.session.watching import Nobody
from daq.text.progress import Silent
from drivers import Channel
from robots import Robot
from tests.daq.check.offline_arms import write_motion

AWAY = "format = 1\nfloor = -3.0\n"
FAST = "format = 1\n[tool]\nspeed = 0.001\n"


@pytest.mark.slow
def test_a_check_in_its_cell(emps: Robot, channel: Channel, tmp_path: Path, no_leftovers: None) -> None:
    motion = write_motion(emps, tmp_path, 2.5)
    allowed, forbidden = tmp_path / "cell.toml", tmp_path / "slow.toml"
    allowed.write_text(AWAY)
    forbidden.write_text(FAST)
    order = ArmOrder(emps, "emps", channel, True, 3)
    (tmp_path / "one").mkdir()
    (tmp_path / "two").mkdir()
    with Catalogue() as catalogue:
        request = CheckRequest(order, tmp_path / "one", catalogue, motion, cell=cell_of(forbidden))
        with pytest.raises(SessionError, match=r"must not be driven: .*m/s"):
            record_check(request, Silent(), Nobody(), unconducted)
        assert not runs.every(catalogue) and not list(tmp_path.glob("**/*.mcap"))

        first = run_check(replace(request, cell=cell_of(allowed)), Silent())
        assert _of_the_cell(first.warnings) == []
        run = runs.get(catalogue, first.run)
        assert run.facts[CELL_SHA256] == cell_of(allowed).sha256
        assert Path(run.facts["cell_file"]) == allowed
        assert read_capture(first.capture).run[CELL_SHA256] == run.facts[CELL_SHA256]
        baselines.accept(catalogue, first.model, "Ada", "first", None)
        second = run_check(CheckRequest(order, tmp_path / "two", catalogue), Silent())
        (warning,) = _of_the_cell(second.warnings)
        assert warning == (
            f"the baseline was recorded with {allowed}, this check has no --cell: obstacles are not looked at"
        )
        assert len(arms.every(catalogue)) == 1


def _of_the_cell(warnings: tuple[str, ...]) -> list[str]:
    """Without those of a machine that is busy and misses cycles."""
    return [warning for warning in warnings if "cell" in warning]


def test_a_plan_keeps_clear_of_the_cell(emps: Robot, tmp_path: Path) -> None:
    """Without a baseline the motion is planned in the cell."""
    slow = tmp_path / "cell.toml"
    slow.write_text("format = 1\n[tool]\nspeed = 0.05\n")
    arm: Any = SimpleNamespace(session=SimpleNamespace(robot=emps))
    with Catalogue() as catalogue:
        order = ArmOrder(emps, "emps", Channel("virtual", "none"), True, 3)
        request = CheckRequest(order, tmp_path, catalogue, duration=2.0, evaluations=100, cell=cell_of(slow))
        planned = planned_motion(request, arm, Silent()).trajectory
    assert 0.01 < np.abs(planned.velocity[:, 0]).max() <= 0.05 * 1.001


def test_fleets_the_service_and_timers_pass_it_on(tmp_path: Path) -> None:
    arm = FleetArm(robot="emps", cell="my cell.toml")
    assert options_of(arm) == ["emps", "--cell", "my cell.toml"]
    made = Schedule("emps", "02:30", ("emps", "--cell", "my cell.toml"), tmp_path)
    assert 'daq check emps --cell "my cell.toml" --quiet' in made.service_text()
    assert "daq check emps --cell 'my cell.toml' --quiet" in made.cron_line()
