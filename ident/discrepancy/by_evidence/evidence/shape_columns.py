"""What the shapes of gears and other effects that the model has would change of the simulated loop.

A gear is found by rows behind a filter, which say little of how it rings: at reversals the loop leaves what
its compliance and damping are wrong by. (Beside a gear of 109 Hz that was found so a static friction had 43
nats, was shown by other motion, and was named.) So a further effect is asked beside all that other shapes
would make.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.discrepancy.loop import FINE
from ident.discrepancy.loop_evidence import LoopEvidence
from ident.discrepancy.loop_parts import simulated_parts
from ident.effects.placed import Placed
from ident.effects.vocabulary import form_of
from ident.parameters.regressor import RegressorModel
from robots.arrays import FloatArray

_STEP = 1.1
"""Times a shape, to learn what that changes."""


def shape_columns(loop: LoopEvidence) -> FloatArray:
    """Rows × drives × shapes, of shapes that are e times as large: those of whole effects that can be any."""
    others = list(_others(loop))
    changes = at_once(lambda one: _change(loop, one[0]), others)
    found = [change / step for change, (_, step) in zip(changes, others, strict=True) if change is not None]
    return np.stack(found, axis=2) if found else np.zeros((loop.loop.segment().size, loop.robot.n, 0))


def _others(loop: LoopEvidence) -> Iterator[tuple[RegressorModel, float]]:
    """Models with one shape otherwise, and by how much its logarithm is."""
    model = loop.base.model
    for number, effect in enumerate(model.effects):
        if not (isinstance(effect, Placed) and effect.whole):
            continue
        form = form_of(model.robot, effect.name, effect.shape_names)
        for k, shape in enumerate(form.shapes(model.robot, effect.place)):
            if not shape.logarithmic or shape.fixed:
                continue
            times = _STEP if effect.shape[k] * _STEP < shape.upper else 1.0 / _STEP
            moved = tuple(one * times if i == k else one for i, one in enumerate(effect.shape))
            other = form.effect(model.robot, effect.place, moved, loop.present)
            effects = (*model.effects[:number], other, *model.effects[number + 1 :])
            yield RegressorModel(model.robot, effects), float(np.log(times))


def _change(loop: LoopEvidence, model: RegressorModel) -> FloatArray | None:
    """Of the drives' torque, rows × drives; None where the loop cannot be simulated with it."""
    base, standard = replace(loop.base, model=model), loop.present.standard
    return loop.change_to(simulated_parts(loop.loop, base, standard, loop.standstill), FINE)
