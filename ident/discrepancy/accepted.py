"""Effects that a search has settled for, as it goes on with them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.stats import chi2

from ident.discrepancy.basis import Basis
from ident.discrepancy.component import Component
from ident.discrepancy.other_forms import of_other_forms
from ident.discrepancy.refined import Refined
from ident.discrepancy.results import Candidate
from ident.effects.family import PlacedEffect
from robots.arrays import BoolArray, FloatArray
from robots.description import Robot

_HELD = 0.95
_INTERVAL = 1.959964
"""Standard deviations to either side of such an interval."""


@dataclass(frozen=True)
class Accepted:
    """One effect with the sizes that were fitted last.

    Attributes:
        robot: the arm.
        component: family, place and shape.
        basis: what it was settled for on.
        placed: the effect with its shape.
        linear, linear_sigma, shape_sigma: its parameters and their deviations.
        seen: which of its parameters the data show.
        size_sigma: of a factor of all its parameters, its shapes as fitted; 0 where nothing shows it.
        of_forms: deviations more of its parameters, then of its shapes, of a form that the data hardly
            choose; each is a search, so it is asked of what stays in the end.
    """

    robot: Robot
    component: Component
    basis: Basis
    placed: PlacedEffect
    linear: FloatArray
    linear_sigma: FloatArray
    shape_sigma: FloatArray
    seen: BoolArray
    size_sigma: float
    of_forms: Callable[[], FloatArray]

    @classmethod
    def of(cls, robot: Robot, component: Component, basis: Basis, refined: Refined, index: int) -> Accepted:
        """An effect with the sizes of a fit.

        Args:
            robot: see above.
            component: as it was chosen.
            basis: see above.
            refined: of all effects that were fitted together.
            index: of this one among them.
        """
        effect = refined.effects[index]
        return cls(
            robot,
            Component(component.family, component.place, effect.shape),
            basis,
            effect,
            refined.linear[index],
            refined.linear_sigma[index],
            refined.shape_sigma[index],
            refined.seen[index],
            refined.size_sigma[index],
            partial(of_other_forms, refined, index),
        )

    @property
    def effect(self) -> str:
        return self.placed.name

    @property
    def joints(self) -> tuple[int, ...]:
        """From 1."""
        return tuple(joint + 1 for joint in self.placed.place.joints)

    @property
    def indistinguishable_from(self) -> tuple[Candidate, ...]:
        return self.basis.indistinguishable_from

    @property
    def unsure(self) -> str:
        """What makes it this effect and is not told from its absence at 95 %, in words; empty where all is.

        That is each parameter without which it is something else (of an effect that has none such the surest,
        or all of them together) and each shape that at one of its limits makes it another. What the search
        itself says of the sizes that it found comes first.
        """
        if self.basis.unsure is not None:
            return self.basis.unsure or self._unlike_its_shapes()
        essential = self.component.family.essential
        sizes = unsure_size(self.placed, essential, self.linear, self.linear_sigma, self._is_there)
        return sizes or self._unsure_shape() or self._unlike_its_shapes()

    def _unlike_its_shapes(self) -> str:
        """Whether of what the shapes alone make nearer to nothing than to all is there, at 95 %, in words.

        A soft gear beside the soft one had 0.06 ± 0.02 of what its stiffness makes.
        """
        if not self.placed.whole or self.linear[0] + _INTERVAL * self.linear_sigma[0] >= 0.5:
            return ""
        share = f"{100 * self.linear[0]:.0f} ± {100 * self.linear_sigma[0]:.0f} %"
        return f"of what its {' and '.join(self.placed.shape_names)} make the fitted recordings show {share}"

    @property
    def _is_there(self) -> bool:
        """Whether the whole is told from nothing, by more than its parameters and shapes make at 95 %."""
        freedom = self.linear.size + self.shape_sigma.size
        return bool(0.0 < self.size_sigma < 1.0 / np.sqrt(chi2.ppf(_HELD, freedom)))

    def _unsure_shape(self) -> str:
        shapes = self.component.family.shapes(self.robot, self.placed.place)
        for shape, value, sigma in zip(shapes, self.placed.shape, self.shape_sigma, strict=True):
            for limit in shape.limits:
                if abs(value - limit) <= _INTERVAL * sigma:
                    return f"{shape.name} is {value:.2g} ± {sigma:.2g}, which may as well be {limit:g}"
        return ""


def unsure_size(
    effect: PlacedEffect, essential: Sequence[int], values: FloatArray, sigma: FloatArray, there: bool
) -> str:
    """Which parameter that makes it this effect is not told from nothing at 95 %, in words; empty where none.

    Args:
        effect: with its shape.
        essential: numbers of its parameters without which it is something else; where none is, the surest
            one has to be told, or all of them together.
        values, sigma: (p,) with deviations.
        there: whether all of them together are told from nothing.
    """
    clear = (np.abs(values) > _INTERVAL * sigma) & (values != 0.0)
    if essential:
        missing = [k for k in essential if not clear[k]]
    else:
        with np.errstate(over="ignore"):  # a column that is next to nothing has any factor
            surest = int(np.argmax(np.abs(values) / np.maximum(sigma, 1e-150)))
        missing = [] if clear.any() or there else [surest]
    if not missing:
        return ""
    parameter, value, spread = effect.parameters[missing[0]], values[missing[0]], sigma[missing[0]]
    unit = "" if parameter.unit == "1" else f" {parameter.unit}"
    return f"{parameter.name} is {value:.2g} ± {spread:.2g}{unit}, which may as well be nothing"


def joints_not_told(findings: Sequence[Accepted]) -> set[int]:
    """Joints (from 0) of findings that have more than one name: what one leaves may be the other's part."""
    joints = {
        joint
        for finding in findings
        for rival in finding.indistinguishable_from
        for joint in (*finding.joints, *rival.joints)
    }
    return {joint - 1 for joint in joints}
