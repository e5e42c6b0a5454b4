"""A baseline that was accepted with another model than a check identifies."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from daq.catalogue import baselines, models
from daq.catalogue.database import Catalogue
from daq.catalogue.values import NewModel
from daq.check import check as check_module
from daq.check.check import run_check
from daq.check.request import CheckRequest, CheckResult, Verdict
from daq.session.bench import ArmOrder
from daq.text.progress import Silent
from drivers import Channel
from robots import Robot
from tests.daq.check.offline_arms import record_offline, write_motion


def test_a_baseline_with_more_parameters(
    emps: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a diagnosis leaves it that has found friction to differ from side to side."""
    monkeypatch.setattr(check_module, "record_check", record_offline)
    motion = write_motion(emps, tmp_path, 2.5)
    scenario = tmp_path / "scenario.toml"
    scenario.write_text("format = 1\n[[drive_gain_error]]\ndrive = 1\nchange = -0.2\n")
    with Catalogue() as catalogue:

        def check(name: str, hidden: Path | None = None) -> CheckResult:
            folder = tmp_path / name
            folder.mkdir()
            order = ArmOrder(emps, "emps", Channel("virtual", "offline"), True, 3, scenario=hidden)
            return run_check(CheckRequest(order, folder, catalogue, motion), Silent())

        first = check("first")
        richer = models.add(catalogue, first.run, _richer(catalogue, first.model))
        assert [p.name for p in richer.parameters][2:4] == ["Fcp1", "Fcn1"]
        baselines.accept(catalogue, richer.id, "Ada", "diagnosed", None)

        same = check("same")
        assert same.verdict is Verdict.OK, same.sentence
        assert same.warnings == ("the baseline (run 1) has another model: Fcp1, Fcn1 are not compared",)
        lost = check("lost", scenario)
        assert lost.verdict is Verdict.FAILED and "drive gain of joint 1" in lost.sentence


def _richer(catalogue: Catalogue, number: int) -> NewModel:
    """The model with Coulomb friction of its own for each direction."""
    plain = models.get(catalogue, number)
    assert plain.covariance is not None
    place = [p.name for p in plain.parameters].index("Fc1")
    order = [*range(place + 1), place, *range(place + 1, len(plain.parameters))]
    covariance = plain.covariance[order][:, order].copy()
    covariance[place, place + 1] = covariance[place + 1, place] = 0.0
    parameters = [plain.parameters[k] for k in order]
    for k, name in ((place, "Fcp1"), (place + 1, "Fcn1")):
        parameters[k] = replace(parameters[k], name=name, expression=name)
    fields = NewModel.__dataclass_fields__
    values = {name: getattr(plain, name) for name in fields if hasattr(plain, name)}
    return NewModel(**{**values, "parameters": tuple(parameters), "covariance": covariance})
