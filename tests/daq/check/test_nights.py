"""Night after night through the catalogue: learned, watched, and since when something has moved."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from daq.catalogue import arms, baselines, checks, models
from daq.catalogue.database import Catalogue
from daq.check import check as check_module
from daq.check.check import run_check
from daq.check.request import CheckRequest, CheckResult, Verdict
from daq.progress import Silent
from daq.session.bench import ArmOrder
from drivers import Channel
from ident.drift import DriftSettings
from robots import Robot
from tests.daq.check.offline_arms import record_offline, write_motion

LEARNING = 8
COLDER_HALL = "format = 1\n[[drifting_friction]]\ndrive = 1\nstart = {kelvin}\nambient = {kelvin}\n"
WORN = "[[coulomb_friction]]\ndrive = 1\nchange = {share}\n"


def test_wear_is_told_with_the_run_that_it_began_with(
    emps: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(check_module, "record_check", record_offline)
    motion = write_motion(emps, tmp_path, 2.5)
    settings = DriftSettings(learning_nights=LEARNING)
    hall = np.random.default_rng(1).normal(0.0, 4.0, 20)

    def check(catalogue: Catalogue, night: int, worn: float = 0.0, given: Path = motion) -> CheckResult:
        folder = tmp_path / f"night{night}"
        folder.mkdir()
        hidden = folder / "scenario.toml"
        more = WORN.format(share=worn) if worn else ""
        hidden.write_text(COLDER_HALL.format(kelvin=hall[night]) + more)
        order = ArmOrder(emps, "emps", Channel("virtual", "offline"), True, 3, scenario=hidden)
        request = CheckRequest(order, folder, catalogue, given, celsius=22.0 + hall[night], settings=settings)
        return run_check(request, Silent())

    with Catalogue() as catalogue:
        first = check(catalogue, 0)
        baselines.accept(catalogue, first.model, "Ada", "first", None)
        quiet = [check(catalogue, night) for night in range(1, LEARNING + 4)]
        assert [one.verdict for one in quiet] == [Verdict.OK] * len(quiet), [one.sentence for one in quiet]
        stages = [one.comparison.stage for one in quiet if one.comparison is not None]
        assert stages == ["learning"] * (LEARNING - 1) + ["watching"] * 4  # the baseline teaches too

        (tmp_path / "other").mkdir()
        other = check(catalogue, 12, given=write_motion(emps, tmp_path / "other", 3.5))
        assert other.comparison is not None
        assert other.comparison.stage == "learning"  # nights of another motion teach nothing of this one

        found = [check(catalogue, night, worn=0.15) for night in (13, 14)]
        for one in found:
            assert one.verdict in (Verdict.WARNING, Verdict.FAILED), one.sentence
            assert one.sentence.startswith("Coulomb friction of joint 1 +"), one.sentence
            assert one.comparison is not None and one.comparison.since is not None
            assert one.comparison.since.label.startswith(f"run {found[0].run} (")
            assert f"since run {found[0].run} (" in one.sentence
        assert found[1].previous == found[0].verdict.value
        change = found[1].comparison.changes[0] if found[1].comparison else None
        assert change is not None and change.relative == pytest.approx(0.15, abs=0.06)
        (arm,) = arms.every(catalogue)
        states = [record.details["state"] for record in checks.of_arm(catalogue, arm.id)]
        assert states[:2] == ["changed", "changed"] and set(states[2:]) == {"unchanged"}
        assert len(models.trend(catalogue, arm.id, "Fc1")) == len(states)
