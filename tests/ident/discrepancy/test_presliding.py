"""How dry friction turns its sign: the law that an engine has, found from recordings, and simulated with."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from ident import BaseParameters, RegressorModel
from ident.discrepancy.before_after import gate_of
from ident.discrepancy.by_evidence.evidence.law_columns import _others
from ident.discrepancy.loop import Loop
from ident.discrepancy.loop_examination import examine_in_loop
from ident.discrepancy.prepared_recording import prepared_recording
from ident.discrepancy.presliding import constraints, standstill_of, stopping_rates
from ident.discrepancy.simulated_loop import loop_evidence
from ident.discrepancy.step import Step
from ident.effects import FrictionSign
from ident.effects.simulated import SoftConstraint
from ident.errors import IdentificationError
from robots.arrays import FloatArray
from tests.ident.discrepancy.constraint_rig import recorded, rig

TIME = 0.0095
"""s, MuJoCo's own."""


def of_another_posture(base: BaseParameters, standard: FloatArray) -> SoftConstraint:
    """A constraint that is a tenth wider than it is at zero."""
    rates = stopping_rates(base.model, standard)
    assert rates is not None
    (at_zero,) = constraints(rates, np.array([TIME]))
    assert isinstance(at_zero, SoftConstraint)
    return SoftConstraint(1.1 * at_zero.width, TIME)


def test_friction_that_is_the_force_of_a_constraint_is_found_to_be() -> None:
    """A clean arm of MuJoCo with ``frictionloss`` was never clean: it creeps, and answers to acceleration."""
    base, standard, _ = rig()
    law = of_another_posture(base, standard)
    piece = prepared_recording(base.model.robot, recorded(law))
    (found,) = examine_in_loop(base, (piece,), None, base.regroup(standard)).loop.standstill
    assert isinstance(found, SoftConstraint)
    assert found.width == pytest.approx(law.width, rel=0.02), "of the posture, too"
    assert found.time == pytest.approx(law.time, rel=0.05)


def test_friction_that_holds_its_drive_at_once_is_found_to_be() -> None:
    """What a law that is too slow leaves was a static friction on clean arms that stick (0.94)."""
    base, standard, _ = rig()
    law = FrictionSign("tanh", 4e-5)
    piece = prepared_recording(base.model.robot, recorded(law))
    (found,) = examine_in_loop(base, (piece,), None, base.regroup(standard)).loop.standstill
    assert isinstance(found, FrictionSign)
    assert found.width == pytest.approx(law.width, rel=0.5)


def test_friction_at_standstill_is_known_where_nothing_repeats(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the description's the simulated loop was 40 times as far from such an arm (foreign seed 96042)."""
    base, standard, _ = rig()
    law = of_another_posture(base, standard)
    piece = prepared_recording(base.model.robot, recorded(law).piece(slice(0, 6000)))
    assert piece.period is None
    loop, beta = Loop.of(base.model, (piece,)), base.regroup(standard)
    (found,) = standstill_of(loop, base, beta)
    assert isinstance(found, SoftConstraint)
    assert found.width == pytest.approx(law.width, rel=0.05)
    monkeypatch.setattr("ident.discrepancy.step.lag_is_known", lambda robot: True)
    assert Step.of(base, (piece,), None).standstill is not None
    with pytest.raises(IdentificationError, match="does not repeat, so noise cannot be told from misfit"):
        loop_evidence(loop, base, beta, (found,))


def test_the_gate_is_asked_of_an_arm_that_holds_at_standstill_as_the_recordings_show() -> None:
    base, standard, _ = rig()
    law = SoftConstraint(0.03, TIME)
    run, beta = recorded(law), base.regroup(standard)
    gates = [gate_of(base, beta, None, (run,), standstill)[0] for standstill in (None, (law,))]
    assert [gate is not None and gate.passed for gate in gates] == [False, True]


def test_beside_a_soft_constraint_other_widths_of_it_are_laws() -> None:
    own = SoftConstraint(0.01, TIME)
    others = [one for one in _others(own) if isinstance(one, SoftConstraint)]
    assert min(one.width for one in others) < own.width < max(one.width for one in others)
    assert {one.time for one in others} == {TIME}


def test_an_arm_without_dry_friction_has_no_rate_of_stopping() -> None:
    model = RegressorModel.of(robots.load("emps"))
    standard = model.prior()
    rates = stopping_rates(model, standard)
    assert rates is not None and (rates > 0.0).all()
    assert stopping_rates(model, np.where([name == "Fc1" for name in model.names], 0.0, standard)) is None


def test_the_law_is_that_of_an_engine() -> None:
    """Force of MuJoCo's ``frictionloss`` beside that of the formula, with its figures for what it gives."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo has no wheel for this platform")
    inertia, loss, step = 0.04, 0.7, 5e-5
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="{step}" gravity="0 0 0"/><worldbody><body>
        <joint type="hinge" axis="0 0 1" armature="0.01" frictionloss="{loss}"/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.03 0.03 {inertia - 0.01}"/>
        </body></worldbody></mujoco>"""
    )
    data, found = mujoco.MjData(model), []
    for count in range(20000):
        at = count * step
        data.qfrc_applied[0] = loss * (1.2 * np.sin(6.0 * at) + 0.3 * np.sin(90.0 * at))
        mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        found.append((data.qvel[0], data.qacc[0], -data.qfrc_constraint[0]))
    speed, acceleration, force = np.array(found).T
    (law,) = constraints(np.array([loss / inertia]), np.array([TIME]))
    assert isinstance(law, SoftConstraint)
    expected = loss * np.clip((speed + law.time * acceleration) / law.width, -1.0, 1.0)
    assert 0.1 < np.mean(np.abs(force) < 0.99 * loss) < 0.9, "it gives way, and it slides"
    assert np.abs(force - expected).max() < 0.01 * loss
