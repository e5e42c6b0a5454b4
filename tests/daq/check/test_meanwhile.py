"""What others do to the catalogue while a check is judged, or a run is identified again."""

from __future__ import annotations

from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

from daq.catalogue import baselines, checks, models, runs
from daq.catalogue.database import Catalogue
from daq.check import check as check_module
from daq.check.analysis import AnalysisOrder, analyse
from daq.check.check import run_check
from daq.check.request import CheckRequest, CheckResult, Verdict
from daq.keeping import again
from daq.keeping.prune import plan_prune, prune
from daq.recording.who import now
from daq.session.bench import ArmOrder
from daq.text.progress import Silent
from drivers import Channel
from ident import Fitted
from robots import Robot
from robots.errors import UserError
from tests.daq.check.offline_arms import record_offline, write_motion

Check = Callable[[], CheckResult]


@pytest.fixture
def check(emps: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, own_catalogue: Path) -> Check:
    """Checks of one arm on one motion, night after night."""
    monkeypatch.setattr(check_module, "record_check", record_offline)
    motion = write_motion(emps, tmp_path, 2.5)

    def run() -> CheckResult:
        folder = tmp_path / f"night{len(list(tmp_path.glob('night*')))}"
        folder.mkdir()
        order = ArmOrder(emps, "emps", Channel("virtual", "offline"), True, 3)
        with Catalogue() as catalogue:
            return run_check(CheckRequest(order, folder, catalogue, motion), Silent())

    return run


def meanwhile(monkeypatch: pytest.MonkeyPatch, act: Callable[[Catalogue], object]) -> None:
    """While the next recording is identified."""

    def analysed(order: AnalysisOrder) -> Fitted:
        with Catalogue() as catalogue:
            act(catalogue)
        return analyse(order)

    monkeypatch.setattr(check_module, "analyse", analysed)


def test_a_check_is_compared_with_the_baseline_that_it_began_with(
    check: Check, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = check()
    with Catalogue() as catalogue:
        baselines.accept(catalogue, first.model, "Ada", "first", None)
    second = check()
    assert second.verdict is Verdict.OK

    meanwhile(monkeypatch, lambda catalogue: baselines.accept(catalogue, second.model, "Bob", "new", None))
    third = check()
    assert third.verdict is Verdict.OK and third.baseline is not None
    assert third.baseline.run_id == first.run, "its motion was driven for that one"

    monkeypatch.setattr(check_module, "analyse", analyse)
    fourth = check()
    assert fourth.baseline is not None and fourth.baseline.run_id == second.run
    meanwhile(
        monkeypatch,
        lambda catalogue: baselines.roll_back(catalogue, runs.get(catalogue, 1).arm_id, "Ada", "no", None),
    )
    fifth = check()
    assert (fifth.verdict, fifth.baseline) == (Verdict.UNKNOWN, None), "taken back while it ran"
    with Catalogue() as catalogue:
        kept = checks.of_arm(catalogue, runs.get(catalogue, 1).arm_id)
    ours = [record.baseline_id for record in kept]
    assert ours == [None, 2, 1, 1, None]


def test_a_recording_that_is_pruned_while_it_is_identified_again_is_one_line(
    check: Check, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = check()
    identify = again.run_identify

    def pruned(*arguments: Any) -> Any:
        with Catalogue() as catalogue:
            deleted = prune(catalogue, plan_prune(catalogue, now() + timedelta(days=1)))
        assert [entry.run.id for entry in deleted.prunable] == [done.run]
        return identify(*arguments)

    monkeypatch.setattr(again, "run_identify", pruned)
    with Catalogue() as catalogue:
        with pytest.raises(UserError) as error:
            again.rerun(catalogue, done.run, Silent())
        assert "no such file" in str(error.value) and "\n" not in str(error.value)
        with pytest.raises(UserError, match="gone"):
            again.rerun(catalogue, done.run, Silent())
        assert runs.get(catalogue, done.run).state == "finished"
        assert models.latest_of(catalogue, done.run).id == done.model, "what was found stays"
