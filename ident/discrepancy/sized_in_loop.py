"""Sizes and shapes of what the simulated loop shows, by loops that have it whole.

A column of the loop is what a little of an effect changes. Friction that holds a drive at standstill is not
little: the drive stands until the loop has built up what moves it, and with the sizes that columns say two
static frictions explained half of what they were. What its shapes alone make (a play) has columns of all of
it anyway.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from ident.discrepancy.component import Component, at_point, inner
from ident.discrepancy.loop import FINE
from ident.discrepancy.loop_examination import LoopExamination
from ident.discrepancy.refined import Refined, with_deviations
from ident.effects.family import Shape
from ident.parameters.present import Present
from robots.arrays import BoolArray, FloatArray

_log = logging.getLogger(__name__)

_STEP = 0.02
"""Of a size, or of the logarithm of a shape: a difference that simulations tell."""

_INSIDE = 0.05
"""Of its scale: so far from its limits a size begins, since no small step leads away from them."""

_JACOBIANS = 12
"""Steps of Gauss and Newton at most."""


def sized_in_loop(examination: LoopExamination, refined: Refined) -> Refined:
    """An effect fitted once more, every size tried being simulated (Gauss and Newton, within bounds).

    Args:
        examination: of the model without it, in closed loop.
        refined: the only effect, by columns.

    Returns:
        Deviations as columns have them, at the shapes found; the same where nothing is nearer to the arm.
    """
    if refined.effects[0].whole:
        return refined
    sized = _Sized(examination, refined.components[0], refined.present)
    before = sized.left(sized.point(refined.linear[0]))
    if before is None:
        return refined
    far = np.full_like(before, np.linalg.norm(before) / np.sqrt(before.size / 2.0))

    def left(point: FloatArray) -> FloatArray:
        found = sized.left(point)
        return far if found is None else found

    lower, upper = sized.limits.T
    inside = _INSIDE * np.minimum(1.0, upper - lower)
    start = np.clip(sized.point(refined.linear[0]), lower + inside, upper - inside)
    found = least_squares(
        left, start, bounds=(lower, upper), diff_step=_STEP, max_nfev=_JACOBIANS, xtol=1e-3, ftol=1e-4
    )
    energy = float(before @ before)
    _log.info("%s simulated whole: %.1f nats more", refined.components[0].key[0], 0.5 * energy - found.cost)
    if 2.0 * found.cost >= energy:
        return refined
    component, values = sized.at(found.x)
    again = with_deviations(examination, [component], refined.present)
    return replace(again, linear=(values,), as_simulated=True)


@dataclass(frozen=True)
class _Sized:
    """What the loop leaves with an effect of any size and shape; sizes count in their scales."""

    examination: LoopExamination
    component: Component
    present: Present

    @cached_property
    def shapes(self) -> list[Shape]:
        return list(self.component.shapes(self.examination))

    @cached_property
    def free(self) -> BoolArray:
        """(s,) shapes that are looked for."""
        return np.array([not shape.fixed for shape in self.shapes], dtype=np.bool_)

    @cached_property
    def scale(self) -> FloatArray:
        """(p,) of the sizes."""
        return np.array(self.component.effect(self.examination, self.present).scale)

    @property
    def limits(self) -> FloatArray:
        """(p + free, 2) of a point."""
        effect = self.component.effect(self.examination, self.present)
        ends = [(inner(one, one.lower), inner(one, one.upper)) for one in self.shapes if not one.fixed]
        return np.concatenate(
            [np.array(effect.bounds) / self.scale[:, np.newaxis], np.reshape(ends, (-1, 2))]
        )

    @cached_property
    def start(self) -> FloatArray:
        """(s,) the shapes as they are."""
        pairs = zip(self.shapes, self.component.shape, strict=True)
        return np.array([inner(shape, value) for shape, value in pairs])

    def point(self, values: FloatArray) -> FloatArray:
        """(p + free,) of sizes (p,) with the shapes as they are."""
        return np.concatenate([values / self.scale, self.start[self.free]])

    def at(self, point: FloatArray) -> tuple[Component, FloatArray]:
        """The effect's shapes, and its sizes (p,)."""
        count, shapes = self.scale.size, self.start.copy()
        shapes[self.free] = point[count:]
        return at_point([self.component], self.shapes, shapes)[0], point[:count] * self.scale

    def left(self, point: FloatArray) -> FloatArray | None:
        """(N + p,) white rows that the model leaves with it, and its sizes less their centre.

        None where the loop cannot be simulated.
        """
        component, values = self.at(point)
        effect, loop = component.effect(self.examination, self.present), self.examination.loop
        change = loop.change_by(loop.variant(effect), values, FINE)
        if change is None:
            return None
        white = self.examination.whiten([change[:, :, np.newaxis]])
        rows = self.examination.residual - self.examination.partial_out(white)[:, 0]
        return np.concatenate([rows, (values - np.array(effect.centre)) / self.scale])
