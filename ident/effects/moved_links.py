"""What links take more that move a little otherwise than was measured: behind a gear, or on a foot.

Links that lag behind their drive by x take τ(q − x) = τ(q) − A ẍ − C ẋ − K x, with the slopes of their torque
along that motion: of ways of some mrad that is all but 10⁻⁵ of it, and the slopes are those of every gear.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ident.effects.family import PresentModel
from ident.effects.state import State
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


def slopes_of_links(present: PresentModel, state: State, drive: int, back: FloatArray) -> Slopes:
    """Of the links' joint torques along the motion (n,) of the joints by a drive; kept with the state."""

    def felt(way: float, rate: float, push: float) -> FloatArray:
        moved = state.moved(
            state.position + way * back, state.velocity + rate * back, state.acceleration + push * back
        )
        return present.link_torque(moved)

    return state.once(present, ("slopes", drive), lambda: Slopes.of(present.link_torque(state), felt))
