"""Checks that get SIGKILL between their recording and their verdict: what is left, and the check after them.

The earlier stages are in ``test_check.py``, all of them and random times in ``benchmarks/killed_checks.py``.
"""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.killed_check import POINTS
from daq.catalogue import arms, baselines, checks, models, runs
from daq.catalogue.database import Catalogue
from daq.check import check as check_module
from daq.check.check import run_check
from daq.check.request import CheckRequest, Verdict
from daq.session.bench import ArmOrder
from daq.text.progress import Silent
from drivers import Channel
from robots import Robot
from tests.conftest import ROOT
from tests.daq.check.offline_arms import record_offline, write_motion

_KILLED = """
import sys
from pathlib import Path
import robots
from benchmarks.killed_check import POINTS, kill_at
from daq.catalogue.database import Catalogue
from daq.check import check
from daq.check.request import CheckRequest
from daq.text.progress import Silent
from daq.session.bench import ArmOrder
from drivers import Channel
from tests.daq.check.offline_arms import record_offline

stage, folder, motion = sys.argv[1:]
check.record_check = record_offline
kill_at(next(point for point in POINTS if point.stage == stage))
order = ArmOrder(robots.load("emps"), "emps", Channel("virtual", "offline"), True, 3)
check.run_check(CheckRequest(order, Path(folder), Catalogue(), Path(motion)), Silent())
"""


def killed(stage: str, folder: Path, motion: Path) -> int:
    folder.mkdir()
    words = [sys.executable, "-c", _KILLED, stage, str(folder), str(motion)]
    return subprocess.run(words, cwd=ROOT, check=False, capture_output=True).returncode


@pytest.mark.slow
def test_between_the_recording_and_the_verdict(
    emps: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(check_module, "record_check", record_offline)
    motion = write_motion(emps, tmp_path, 2.5)
    order = ArmOrder(emps, "emps", Channel("virtual", "offline"), True, 3)

    def whole(catalogue: Catalogue, name: str) -> Verdict:
        (tmp_path / name).mkdir()
        return run_check(CheckRequest(order, tmp_path / name, catalogue, motion), Silent()).verdict

    left = {
        "test: begins": ("finished", runs.UNJUDGED, 0),
        "model: about to be kept": ("finished", runs.UNJUDGED, 0),
        "verdict: about to be kept": ("finished", runs.UNJUDGED, 1),
        "verdict: kept": ("finished", "", 1),
    }
    with Catalogue() as catalogue:
        assert whole(catalogue, "first") is Verdict.UNKNOWN
        baselines.accept(catalogue, models.of_run(catalogue, 1)[-1].id, "Ada", "first", None)
        for k, (stage, (state, reason, count)) in enumerate(left.items()):
            assert killed(stage, tmp_path / f"killed{k}", motion) == -signal.SIGKILL, stage
            runs.settle_abandoned(catalogue)
            run = runs.every(catalogue, limit=1)[0]
            assert run.state == state and (not reason or run.reason == reason), stage
            assert len(models.of_run(catalogue, run.id)) == count, stage
            judged = [check.verdict for check in checks.of_run(catalogue, run.id)]
            assert judged == (["ok"] if stage == "verdict: kept" else []), stage
            assert len(arms.every(catalogue)) == 1
        assert whole(catalogue, "last") is Verdict.OK
        last = runs.every(catalogue, limit=1)[0]
        runs.settle_abandoned(catalogue)
        assert runs.get(catalogue, last.id).reason != runs.UNJUDGED  # this process lives


def test_points_are_told_apart_by_their_stage() -> None:
    stages = [point.stage for point in POINTS]
    assert len(set(stages)) == len(stages)
