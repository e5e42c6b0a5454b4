"""What may be asked of an identification: methods, held-out recordings, essential parameters, the cut-off."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import robots
from benchmarks.closed_loop_runs import motion
from drivers.simulated.offline import simulate_offline
from drivers.simulated.truth import draw_truth
from ident import IdentificationError, Options, Recording, RegressorModel, identify
from ident.effects import CoulombFriction, Effect, ViscousFriction
from ident.results import Identification
from robots import Robot
from robots.pseudo_inertia import impossible_links
from robots.standard import link_parameter_names


@pytest.fixture(scope="module")
def emps() -> Robot:
    return robots.load("emps")


def run(robot: Robot, phase: float, truth: int = 3) -> Recording:
    time = np.arange(0.0, 6.0, robot.bus.cycle_time)
    window = np.minimum(1.0, np.minimum(time, 6.0 - time)) ** 3
    tones = ((0.03, 0.5), (0.012, 1.1), (0.004, 2.3))
    waves = sum(a * np.sin(2 * np.pi * f * time + phase * k) for k, (a, f) in enumerate(tones))
    found = simulate_offline(robot, draw_truth(robot, truth), (window * waves)[:, np.newaxis])
    return Recording(f"phase {phase:g}", found.time, found.reference, found.position, found.control_signal)


@pytest.fixture(scope="module")
def fitted(emps: Robot) -> Recording:
    return run(emps, 1.0)


def result(emps: Robot, fitted: Recording, **options: object) -> Identification:
    return identify(emps, (fitted,), options=Options(**options)).result  # type: ignore[arg-type]


def test_least_squares_alone(emps: Robot, fitted: Recording) -> None:
    found = result(emps, fitted, method="ls")
    assert list(found.by_estimator) == ["ls"]
    assert found.test.verdict == "not_testable"
    assert found.instrumental_reason == "least squares alone was asked for"
    assert found.recommended.method == "ls"


def test_instrumental_variables_where_they_are_insisted_on(emps: Robot, fitted: Recording) -> None:
    assert result(emps, fitted, method="iv").recommended.method == "iv"
    without = replace(fitted, reference=None)
    with pytest.raises(
        IdentificationError, match="no estimate by instrumental variables: no position reference"
    ):
        result(emps, without, method="iv")


def test_robust_least_squares_shrugs_at_a_contact(emps: Robot, fitted: Recording) -> None:
    truth = draw_truth(emps, 3).parameters
    signal = fitted.control_signal.copy()
    signal[2000:2100] += 1.5
    hit = replace(fitted, control_signal=signal, reference=None)
    found = result(emps, hit, method="robust")
    assert found.recommended is found.by_estimator["robust"]
    off = {
        e.method: {p.name: abs(p.value - truth[p.name]) for p in e.parameters if p.name in truth}
        for e in found.estimates
    }
    assert off["robust"]["off1"] < 0.3 * off["ls"]["off1"]


def test_a_held_out_recording_is_predicted_by_every_estimate(emps: Robot, fitted: Recording) -> None:
    other = run(emps, 2.0)
    found = result(emps, fitted, validation=(other,))
    assert [(h.recording, h.method) for h in found.held_out] == [("phase 2", "ls"), ("phase 2", "iv")]
    again = identify(emps, (other,))
    for held, estimate in zip(found.held_out, found.estimates, strict=True):
        residual = again.rows.torque - again.rows.regressor @ estimate.values
        torque = again.rows.torque[again.rows.used]
        expected = 100 * np.linalg.norm(residual[again.rows.used]) / np.linalg.norm(torque)
        assert held.relative_error_percent == pytest.approx(expected, rel=1e-12)
        assert held.relative_error_percent_per_joint == pytest.approx([expected])
        assert held.torque_rms == pytest.approx([np.sqrt(np.mean(residual[again.rows.used] ** 2))])
        assert held.rows == again.rows.count
        assert held.relative_error_percent < 2 * found.least_squares.relative_error_percent
    # Another arm is not predicted as well.
    foreign = result(emps, fitted, validation=(run(emps, 2.0, truth=8),)).held_out[0]
    assert foreign.relative_error_percent > 3 * found.held_out[0].relative_error_percent


def test_parameters_that_are_not_needed_are_dropped_by_f_tests(emps: Robot, fitted: Recording) -> None:
    arm = draw_truth(emps, 3)
    centred = replace(arm, parameters=arm.parameters | {"off1": 0.0})
    found = simulate_offline(emps, centred, fitted.reference)  # type: ignore[arg-type]
    recording = Recording("no offset", found.time, found.reference, found.position, found.control_signal)
    essential = result(emps, recording, essential=True).essential
    assert essential is not None
    assert [d.name for d in essential.dropped] == ["off1"]
    assert [p.name for p in essential.parameters] == ["M1R", "Fv1", "Fc1"]
    assert result(emps, fitted, essential=False).essential is None


def test_the_cutoff_is_proposed_and_used_on_request(emps: Robot, fitted: Recording) -> None:
    given = result(emps, fitted).signals
    asked = result(emps, fitted, propose_cutoff=True).signals
    assert given is not None and asked is not None
    assert given.cutoff_hz == emps.identification.cutoff_hz
    assert asked.cutoff_hz == asked.proposed_cutoff_hz == given.proposed_cutoff_hz


def test_a_cutoff_far_from_the_proposal_is_worth_a_warning(emps: Robot, fitted: Recording) -> None:
    settings = emps.identification.model_copy(update={"cutoff_hz": 2.0})
    warnings = result(emps.model_copy(update={"identification": settings}), fitted).warnings
    assert any(w.startswith("cut-off 2 Hz leaves") for w in warnings)
    assert not any(w.startswith("cut-off") for w in result(emps, fitted).warnings)


def test_the_friction_sign_is_wider_than_the_noise(emps: Robot, fitted: Recording) -> None:
    settings = emps.identification.model_copy(update={"friction_sign": "tanh", "friction_width": 1e-7})
    warnings = result(emps.model_copy(update={"identification": settings}), fitted).warnings
    assert any("noise swings the friction's sign" in w for w in warnings)


def test_t_values_and_rank(emps: Robot, fitted: Recording) -> None:
    found = result(emps, fitted)
    for parameter in found.least_squares.parameters:
        assert parameter.t_value == pytest.approx(parameter.value / parameter.sigma)
        assert abs(parameter.t_value) == pytest.approx(100 / parameter.percent_sigma)
    assert found.rank is not None
    assert (found.rank.data, found.rank.structural) == (4, 4)
    assert found.rank.smallest > found.rank.noise_level


# An estimated arm that cannot be simulated is not the arm that was recorded.


def test_a_simulation_that_runs_away_closes_the_first_gate(emps: Robot, fitted: Recording) -> None:
    late = {
        "velocity_gain": (10 * emps.controller.velocity_gain[0],),
        "delay_samples": 10,
        "saturation": (1000.0,),
    }
    unstable = emps.model_copy(update={"controller": emps.controller.model_copy(update=late)})
    found = result(unstable, fitted)
    assert found.test.verdict == "instruments_invalid"
    assert found.instrumental is None
    assert re.search(r"joint 1 runs away at \d\.\d+ s", found.test.recommendation)
    assert [gate.passed for gate in found.test.gates] == [False, None, None]
    assert "runs away" in found.test.gates[0].detail
    two = identify(unstable, (fitted, replace(fitted, name="second"))).result
    assert "phase 1: the simulated loop is unstable" in two.test.recommendation


@pytest.fixture(scope="module")
def six_axes() -> tuple[Robot, Recording]:
    robot = robots.load("tx40")
    truth = draw_truth(robot, 1)
    run = simulate_offline(robot, truth, motion(robot, 8.0, 3))
    return robot, Recording("bench", run.time, run.reference, run.position, run.control_signal)


def without(effect: type[Effect], monkeypatch: pytest.MonkeyPatch) -> None:
    """Models lack a kind of effect from here on."""
    whole = RegressorModel.of

    def lacking(robot: Robot) -> RegressorModel:
        model = whole(robot)
        return RegressorModel(robot, tuple(part for part in model.effects if not isinstance(part, effect)))

    monkeypatch.setattr(RegressorModel, "of", staticmethod(lacking))


@pytest.mark.parametrize("effect", [ViscousFriction, CoulombFriction])
def test_six_axes_without_a_kind_of_friction(
    effect: type[Effect], six_axes: tuple[Robot, Recording], monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, recording = six_axes
    without(effect, monkeypatch)
    found = identify(robot, (recording,)).result
    assert found.test.verdict == "instruments_invalid"
    assert found.test.gates[0].passed is False
    if found.instrumental is None:  # the inertias that take the friction's place are those of no arm
        said = found.test.recommendation
        assert re.search(
            r"joint \d runs away at \d\.\d+ s|not positive definite at q = \(.*along joint \d", said
        )
    # The nearest arm that can exist is simulated, and gate 1 says what it lacks.
    nearest = identify(robot, (recording,), options=Options(method="consistent")).result
    assert nearest.test.verdict == "instruments_invalid"
    assert nearest.instrumental is not None
    assert "an effect is missing" in nearest.test.recommendation
    assert nearest.consistency is not None and nearest.recommended is nearest.by_estimator["consistent"]
    links = np.array([nearest.consistency.standard[name] for name in link_parameter_names(6)]).reshape(6, 10)
    assert not impossible_links(links)
