"""Where links give way, how far they do, and what that changes of the torques on foot and joints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ident.effects.foot import AXES
from ident.effects.gear_state import Gear
from robots.arrays import FloatArray

_WAY = 1e-4
"""rad (or m); of the slope over a way. Over speeds a torque is a square, over accelerations a line."""


@dataclass(frozen=True, eq=False)
class Slopes:
    """Slopes of torques along one motion more, x.

    Attributes:
        each: (k, 3, samples): ∂τ/∂x, ∂τ/∂ẋ and ∂τ/∂ẍ of k torques.
    """

    each: FloatArray

    @classmethod
    def of(cls, still: FloatArray, felt: Callable[[float, float, float], FloatArray]) -> Slopes:
        """Of torques, samples × k, without that motion, and where x, ẋ and ẍ are so large in all samples."""
        by_way = (felt(_WAY, 0.0, 0.0) - felt(-_WAY, 0.0, 0.0)) / (2.0 * _WAY)
        by_rate = 0.5 * (felt(0.0, 1.0, 0.0) - felt(0.0, -1.0, 0.0))
        by_push = felt(0.0, 0.0, 1.0) - still
        return cls(np.ascontiguousarray(np.stack([by_way, by_rate, by_push]).T.swapaxes(1, 2)))

    def torque(self, motion: FloatArray) -> FloatArray:
        """Samples × k, of x, ẋ and ẍ, 3 × samples."""
        return np.ascontiguousarray(np.einsum("kds,ds->ks", self.each, motion).T)

    def along(self, back: FloatArray) -> FloatArray:
        """3 × samples: of the torque that does the work of a motion (k,) of all."""
        return np.asarray(np.tensordot(back, self.each, 1))


@dataclass(frozen=True, eq=False)
class Pliant:
    """A place where links give way.

    Attributes:
        along: (2 + n,) how they do, of the foot's turns about x and y and of the joints.
        gear: the spring.
        described: inertia of the described links along it, kg·m² (or kg).
        own: inertia of the place itself.
        offset: share of the model's offset that is a load.
    """

    along: FloatArray
    gear: Gear
    described: float
    own: float = 0.0
    offset: float = 0.0

    @property
    def of_foot(self) -> bool:
        """Whether the foot gives way there, whose torque nothing measures."""
        return bool(self.along[:AXES].any())


@dataclass(frozen=True, eq=False)
class Way:
    """How far links give way at a place.

    Attributes:
        place: where.
        way: and its two rates, 3 × samples.
        slopes: of the torques on foot and joints.
    """

    place: Pliant
    way: FloatArray
    slopes: Slopes

    def torque(self, less: FloatArray | None = None) -> FloatArray:
        """Samples × joints, by which the joints' torque changes; of the way less another."""
        return self.slopes.torque(self.way if less is None else self.way - less)[:, AXES:]
