"""What shapes of a gear that the model has would change of its simulated loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivers.simulated.scenario import Scenario
from ident.discrepancy.by_evidence.evidence.loop_rows import loop_rows
from ident.discrepancy.by_evidence.evidence.shape_columns import shape_columns
from ident.discrepancy.loop import FINE
from ident.discrepancy.loop_parts import simulated_parts
from ident.discrepancy.prior import extended
from ident.discrepancy.simulated_loop import loop_evidence
from ident.discrepancy.step import LoopStep
from ident.effects.family import Place
from ident.effects.vocabulary import family_named
from ident.parameters.base import BaseParameters
from tests.ident.discrepancy.by_evidence.reversal_search import in_loop

COMPLIANCE, DAMPING = 1e-7, 0.3


@pytest.fixture(scope="module")
def clean() -> LoopStep:
    return in_loop(Scenario())


def on_a_gear(step: LoopStep, compliance: float, damping: float) -> BaseParameters:
    """The model with a gear that gives way."""
    family, robot = family_named("joint_elasticity"), step.base.model.robot
    gear = family.effect(robot, Place("drive", (0,)), (compliance, damping), step.present)
    return extended(step.base, [gear], [np.ones(1, dtype=np.bool_)])


def test_a_model_without_such_effects_has_no_columns(clean: LoopStep) -> None:
    assert shape_columns(clean.examination.loop).shape[1:] == (1, 0)


def test_columns_are_what_a_little_of_each_shape_changes(clean: LoopStep) -> None:
    before, beta = clean.examination.loop, np.r_[clean.examination.beta, 1.0]
    base = on_a_gear(clean, COMPLIANCE, DAMPING)
    loop, _, _ = loop_evidence(before.loop, base, beta, before.standstill)
    columns = shape_columns(loop)
    assert columns.shape[1:] == (1, 2)
    for k, shape in enumerate([(1.03 * COMPLIANCE, DAMPING), (COMPLIANCE, 1.03 * DAMPING)]):
        moved = on_a_gear(clean, *shape)
        parts = simulated_parts(loop.loop, moved, loop.present.standard, loop.standstill)
        changed = loop.loop.torque(loop.loop.run(parts, FINE)) - loop.loop.torque(loop.run(FINE))
        foreseen = columns[:, :, k] * np.log(1.03)
        assert np.linalg.norm(changed) > 0.0
        assert np.linalg.norm(changed - foreseen) < 0.25 * np.linalg.norm(changed)
    known = loop_rows(replace(clean.examination, base=base, beta=beta, prior=None))[0].known.columns
    scaled = known / np.maximum(np.linalg.norm(known, axis=(0, 1)), 1e-300)
    own = columns / np.linalg.norm(columns, axis=(0, 1))
    correlation = np.abs(np.einsum("rdk,rds->ks", scaled, own)).max(axis=0)
    assert correlation == pytest.approx([1.0, 1.0]), "every effect is asked beside them"
