"""Effects of a finding before their shapes are fixed, and the space that their shapes are searched in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.discrepancy.examination import Examination
from ident.effects.family import EffectFamily, Place, PlacedEffect, Shape
from ident.parameters.present import Present
from robots.arrays import FloatArray


@dataclass(frozen=True)
class Component:
    """One effect of a finding before its shape is fixed."""

    family: EffectFamily
    place: Place
    shape: tuple[float, ...]

    @property
    def key(self) -> tuple[str, tuple[int, ...]]:
        """Name and joints, from 0."""
        return self.family.name, self.place.joints

    def shapes(self, examination: Examination) -> tuple[Shape, ...]:
        return self.family.shapes(examination.base.model.robot, self.place)

    def effect(self, examination: Examination, present: Present) -> PlacedEffect:
        """The effect, its columns made of the present model less the effect itself."""
        others = present.without(self.family.name, self.place)
        return self.family.effect(examination.base.model.robot, self.place, self.shape, others)


def shapes_of(examination: Examination, components: Sequence[Component]) -> list[Shape]:
    """All shapes of some effects, one after the other."""
    return [shape for component in components for shape in component.shapes(examination)]


def values_of(components: Sequence[Component]) -> list[float]:
    """Their values."""
    return [value for component in components for value in component.shape]


def at_point(components: Sequence[Component], shapes: Sequence[Shape], point: FloatArray) -> list[Component]:
    """The components with shapes from a point of the search space."""
    values = [outer(shape, x) for shape, x in zip(shapes, point, strict=True)]
    moved, start = [], 0
    for component in components:
        end = start + len(component.shape)
        moved.append(Component(component.family, component.place, tuple(values[start:end])))
        start = end
    return moved


def inner(shape: Shape, value: float) -> float:
    """A shape's value in the space that is searched."""
    return float(np.log(value)) if shape.logarithmic else float(value)


def outer(shape: Shape, value: float) -> float:
    """The shape's value there."""
    return float(np.exp(value)) if shape.logarithmic else float(value)


def reach(shape: Shape) -> float:
    """What a change of the effect takes, in the space that is searched: its range, or a scanned grid's step.

    Of a ripple of any period a hundredth of the range is another ripple.
    """
    return grid_step(shape) if shape.scanned else inner(shape, shape.upper) - inner(shape, shape.lower)


def grid_step(shape: Shape) -> float:
    """Distance of neighbours on the grid, in the space that is searched."""
    if len(shape.grid) < 2:
        return 0.1 * (inner(shape, shape.upper) - inner(shape, shape.lower))
    points = np.array([inner(shape, value) for value in shape.grid])
    return float(np.median(np.abs(np.diff(points))))
