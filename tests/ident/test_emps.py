"""Real data: the EMPS benchmark and its published figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

import robots
from ident import Fitted, Options, Recording, identify
from ident.effects.entry import EffectEntry
from ident.identification.found_effects import FoundModel


@pytest.fixture(scope="module")
def recording(shared_data: Path) -> Recording:
    log = loadmat(shared_data / "emps" / "DATA_EMPS.mat")
    time, reference, position, signal = (log[key].astype(np.float64) for key in ("t", "qg", "qm", "vir"))
    return Recording("DATA_EMPS.mat", time.ravel(), reference, position, signal)


@pytest.fixture(scope="module")
def emps(recording: Recording) -> Fitted:
    return identify(robots.load("emps"), (recording,))


def test_least_squares_gives_every_published_digit(emps: Fitted) -> None:
    estimate = emps.result.least_squares
    found = [(round(p.value, 4), round(p.sigma, 4)) for p in estimate.parameters]
    assert found == [(95.1089, 0.1085), (203.5034, 1.1460), (20.3935, 0.1012), (-3.1648, 0.0444)]
    assert round(estimate.relative_error_percent, 4) == 4.0834
    assert round(estimate.condition, 3) == 25.988
    assert estimate.lag1_autocorrelation[0] == pytest.approx(0.67, abs=0.005)


def test_instrumental_variables_agree_with_the_published_estimate(emps: Fitted) -> None:
    estimate = emps.result.instrumental
    assert estimate is not None
    assert [p.value for p in estimate.parameters] == pytest.approx([95.18, 203.30, 20.41, -3.165], rel=1e-3)
    assert estimate.converged
    assert estimate.iterations <= 3


def test_the_textbook_test_rejects_as_published(emps: Fitted) -> None:
    assert emps.result.textbook is not None
    assert emps.result.textbook.passed is False
    assert emps.result.textbook.statistic > 10


def test_the_verdict_rests_on_three_gates(emps: Fitted) -> None:
    test = emps.result.test
    assert [gate.name for gate in test.gates] == ["instruments", "rank", "exogeneity"]
    instruments, rank, exogeneity = test.gates
    # The rig's own controller and model: the simulated regressors are those measured, to 1 %.
    assert instruments.passed is True
    sizes = {check.column: check.size for check in instruments.columns}
    assert max(sizes[parameter.name] for parameter in emps.result.least_squares.parameters) < 0.02
    # Its following error is that of the simulation to 0.2 %. Friction is asymmetric, and more than that: the
    # symmetric model lacks some percent of the torque, significantly, but within the margin.
    assert sizes["following error of drive 1"] == pytest.approx(0.002, abs=0.0005)
    torque = next(check for check in instruments.columns if check.column == "torque of joint 1")
    assert torque.size == pytest.approx(0.035, abs=0.003)
    assert torque.p_value is not None
    assert torque.p_value < 1e-6
    assert rank.passed is False
    assert exogeneity.passed is False
    assert test.verdict == "endogenous"
    # The offset's column is the same in simulation and measurement, so gate 2 takes it out.
    assert next(c for c in rank.columns if c.column == "off1").passed
    assert "off1" not in [c.column for c in exogeneity.columns]


def test_asymmetric_friction_gives_every_published_digit(recording: Recording) -> None:
    robot = robots.load("emps")
    settings = robot.identification.model_copy(update={"friction": "asymmetric"})
    fitted = identify(robot.model_copy(update={"identification": settings}), (recording,))
    estimate = fitted.result.least_squares
    found = {p.name: round(p.value, 4) for p in estimate.parameters}
    assert found == {
        "M1R": 95.1540,
        "Fvp1": 166.7061,
        "Fcp1R": 20.1440,
        "Fvn1": 240.4236,
        "Fcn1R": 20.6277,
    }
    assert round(estimate.relative_error_percent, 4) == 3.1117
    assert [p.expression for p in estimate.parameters][2::2] == ["Fcp1 + off1", "Fcn1 − off1"]
    assert fitted.result.instrumental is not None


def test_with_what_a_diagnosis_has_found_the_published_asymmetric_figures_come_out(
    recording: Recording, emps: Fitted
) -> None:
    """Published: Fv 166.7061 forwards and 240.4236 backwards, Fc 20.1440 and 20.6277, error 3.1117 %."""
    values = {p.name: p.value for p in emps.result.least_squares.parameters} | {"dFv1": -30.0}
    found = FoundModel(
        "emps.model.toml",
        tuple(effect.name for effect in emps.base.model.effects),
        (EffectEntry("asymmetric_friction", (1,), {}),),
        values,
    )
    whole = identify(emps.base.model.robot, (recording,), options=Options(found=found)).result
    estimate = {p.name: p.value for p in whole.least_squares.parameters}
    assert round(whole.least_squares.relative_error_percent, 4) == 3.1117
    assert estimate["dFv1"] == pytest.approx((166.7061 - 240.4236) / 2, abs=0.1)
    assert estimate["Fv1"] == pytest.approx((166.7061 + 240.4236) / 2, abs=0.1)
    # A dry friction that is larger backwards is an offset while the carriage moves.
    assert estimate["off1"] == pytest.approx((20.1440 - 20.6277) / 2, abs=0.1)
    sizes = [
        next(c.size for c in result.test.gates[0].columns if c.column == "torque of joint 1")
        for result in (emps.result, whole)
    ]
    assert sizes[1] < 0.8 * sizes[0]
