"""``check --search``: what nothing known explains is looked for, and named. On SQLite and on PostgreSQL."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daq.catalogue import arms, baselines, checks, findings, models
from daq.catalogue.database import Catalogue
from daq.check import check as check_module
from daq.check import residual
from daq.check.check import run_check
from daq.check.judged import INVALID, night_state
from daq.check.nights import nights_since
from daq.check.request import CheckRequest, CheckResult, Verdict
from daq.check.residual import residual_increase_of
from daq.session.bench import ArmOrder
from daq.text.progress import Silent
from drivers import Channel
from ident.results import Identification
from robots import Robot
from robots.arrays import FloatArray
from tests.daq.check.offline_arms import record_offline, write_motion

RISE, SPEED = 2.0, 0.1
STRIBECK = f"format = 1\n[[stribeck_friction]]\ndrive = 1\nrise = {RISE}\nspeed = {SPEED}\n"
Check = Callable[..., CheckResult]


@pytest.fixture
def check(emps: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Check:
    """One night of the simulated axis after the other."""
    monkeypatch.setattr(check_module, "record_check", record_offline)
    motion = write_motion(emps, tmp_path, 4.0)

    def one(catalogue: Catalogue, hidden: Path | None = None, *, search: bool = False) -> CheckResult:
        folder = tmp_path / f"night{len(list(tmp_path.glob('night*')))}"
        folder.mkdir()
        order = ArmOrder(emps, "emps", Channel("virtual", "offline"), True, 3, scenario=hidden)
        return run_check(CheckRequest(order, folder, catalogue, motion, search=search), Silent())

    return one


def test_a_new_effect_is_searched_for_and_named(check: Check, url: str, tmp_path: Path) -> None:
    scenario = tmp_path / "scenario.toml"
    scenario.write_text(STRIBECK)
    with Catalogue(url) as catalogue:
        first = check(catalogue)
        baselines.accept(catalogue, first.model, "Ada", "first", None)
        same = check(catalogue, search=True)
        assert same.verdict is Verdict.OK and same.findings == () and same.warnings == ()
        unsearched = check(catalogue, scenario)
        assert unsearched.verdict is Verdict.FAILED and unsearched.findings == ()
        assert (
            len(unsearched.warnings) == 1 and "the model leaves more of the torque" in unsearched.warnings[0]
        )
        assert "joint 1" in unsearched.warnings[0]

        found = check(catalogue, scenario, search=True)
        assert found.verdict is Verdict.FAILED and len(found.findings) == 1
        assert found.findings[0].startswith("joint 1 has stribeck friction")
        assert f"the search found: {found.findings[0]}" in found.sentence
        (kept,) = findings.of_run(catalogue, found.run)
        assert (kept.effect, tuple(kept.joints)) == ("stribeck_friction", (1,))
        assert kept.gap_after < 0.5 * kept.gap_before
        (speed,) = [p for p in kept.parameters if p["name"] == "stribeck_speed"]
        assert speed["value"] == pytest.approx(SPEED, abs=4 * speed["sigma"]) and speed["sigma"] < 0.3 * SPEED
        (arm,) = arms.every(catalogue)
        newest = checks.of_arm(catalogue, arm.id, limit=1)[0]
        assert newest.details["findings"] == list(found.findings) and newest.baseline_id is not None
        again = check(catalogue)
        assert again.previous == "failed" and again.verdict is Verdict.OK  # a bad night teaches nothing


def test_a_grown_residual_is_a_warning_on_every_night_that_has_it(
    check: Check, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A night with it teaches nothing, neither the residual nor the charts."""
    with Catalogue() as catalogue:
        first = check(catalogue)
        baselines.accept(catalogue, first.model, "Ada", "first", None)
        assert check(catalogue).verdict is Verdict.OK
        monkeypatch.setattr(residual, "INCREASE_OF_FEW", 0.5)
        for _ in range(2):
            found = check(catalogue)
            assert found.verdict is Verdict.WARNING
            assert found.sentence.startswith("the model leaves more of the torque than on the nights before")
            assert checks.of_run(catalogue, found.run)[0].details["grown"] == [1]
        baseline = found.baseline
        assert baseline is not None
        sha256 = str(checks.of_run(catalogue, found.run)[0].details["trajectory_sha256"])
        names = found.fitted.base.names
        assert [n.clean for n in nights_since(catalogue, baseline, sha256, names)] == [True, False, False]
        assert len(checks.clean_models(catalogue, baseline)) == 2


def test_a_night_that_its_model_does_not_explain_teaches_nothing(
    check: Check, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nor does it change the order of the others: the residual is judged beside the nights, oldest first."""
    seen: list[FloatArray] = []

    def noted(before: FloatArray, tonight: tuple[float, ...]) -> residual.ResidualIncrease:
        seen.append(before)
        return ()

    monkeypatch.setattr(residual, "residual_increase_of", noted)
    with Catalogue() as catalogue:
        first = check(catalogue)
        baselines.accept(catalogue, first.model, "Ada", "first", None)
        second = check(catalogue)
        with monkeypatch.context() as patched:
            patched.setattr(Identification, "trusted", property(lambda self: False))
            doubted = check(catalogue)
        third = check(catalogue)
        assert doubted.verdict is Verdict.WARNING and "does not explain the arm" in doubted.sentence
        check(catalogue)
        rms = [float(models.get(catalogue, night.model).torque_rms[0]) for night in (first, second, third)]
        assert list(seen[-1][:, 0]) == rms and len(set(rms)) == 3
        baseline = third.baseline
        assert baseline is not None
        assert checks.clean_models(catalogue, baseline) == {1, 2, 4, 5}
        accepted, result = models.get(catalogue, first.model), third.fitted.result
        invalid = replace(result, test=replace(result.test, verdict=INVALID))
        untrusted = replace(third.fitted, result=invalid)
        assert night_state(third.comparison, untrusted, accepted) == "doubtful"
        assert night_state(third.comparison, untrusted, replace(accepted, verdict=INVALID)) == "unchanged"


def test_a_residual_has_grown_only_beyond_all_nights_before() -> None:
    rng = np.random.default_rng(0)
    nights = 1.0 + 0.1 * rng.uniform(-1, 1, (20, 3))
    largest = nights.max(axis=0)
    assert residual_increase_of(nights, tuple(1.29 * largest)) == ()
    ((joint, times),) = residual_increase_of(nights, (1.0, float(1.5 * largest[1]), 1.0))
    assert joint == 2 and times == pytest.approx(1.5)
    # Two nights show little.
    assert residual_increase_of(nights[:2], tuple(1.9 * nights[:2].max(axis=0))) == ()
    assert len(residual_increase_of(nights[:2], tuple(2.1 * nights[:2].max(axis=0)))) == 3
    assert residual_increase_of(np.zeros((0, 3)), (1.0, 1.0, 1.0)) == ()
