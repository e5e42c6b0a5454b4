"""Along the same path at another pace: slower and slower to rest, and back to the path's own pace.

The path parameter s counts rows of the reference, the pace v its change per cycle: 1 where it is driven as it
is. Joint positions are q(s), between rows a cubic through the four nearest ones, so they are on the path at
any pace. In continuous time q̈ = q″ ṡ² + q′ s̈: a pace of at most 1 that does not change keeps every limit of
acceleration that the reference keeps. So there is always one to go on with, and it is changed by as much as
the limits leave (time scaling along a fixed path: Bobrow, Dubowsky, Gibson 1985).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.frames.units import Units
from robots.arrays import FloatArray

RAMP_SECONDS = 0.4
"""From the path's own pace to rest, where the limits allow it; s."""

LIMIT_SHARE = 0.9
"""Of the acceleration limits; the rest is for the rounding to counts."""

_NEAR = 1e-6
"""Rows: what is nearer to a row is on it."""


class PathPace:
    """The pace along a reference, from one of its rows on; one call is one cycle.

    Args:
        reference: N × n counts.
        units: to joint positions.
        acceleration: (n,) joint limits.
        cycle_time: s.
        row: of the target that went out last, at the path's own pace.
    """

    def __init__(
        self,
        reference: NDArray[np.int32],
        units: Units,
        acceleration: FloatArray,
        cycle_time: float,
        row: int,
    ) -> None:
        self._rows = reference
        self._to_joints = np.linalg.inv(units.transmission) / units.counts_per_output_unit
        self._most = LIMIT_SHARE * acceleration * cycle_time**2
        self._change = cycle_time / RAMP_SECONDS
        self._last = len(self._rows) - 1
        self.place = float(min(row, self._last))
        """s of the target that went out last."""
        self.pace = 1.0
        """Rows from the target before it."""
        self._before = self._joints(max(self.place - 1.0, 0.0))

    @property
    def at_rest(self) -> bool:
        """Whether the last two targets are one; at the path's end it rests, too."""
        return self.pace == 0.0 or self.place >= self._last

    @property
    def at_own_pace(self) -> bool:
        """Whether the reference can be gone on with row by row, after row ``place``."""
        return self.place >= self._last or (self.pace == 1.0 and self.place == round(self.place))

    def slower(self) -> Sequence[int]:
        """The next target on the way to rest, in counts."""
        return self._go(max(self.pace - self._change, 0.0))

    def faster(self) -> Sequence[int]:
        """The next target on the way to the path's own pace, which is reached on a row; counts.

        With u = 1 − v lost per cycle, the rest of the ramp loses r rows in all, and s is a row at its end
        where r has the right fraction. A linear ramp of k cycles that loses r begins with 2 r / (k + 1).
        """
        fraction = self.place - math.floor(self.place + _NEAR)
        lost = max(1.0 - self.pace, self._change if fraction > _NEAR else 0.0)
        least = lost * lost / (2.0 * self._change) - lost / 2.0
        rest = max(fraction, 0.0) + max(0, math.ceil(least - fraction - _NEAR))
        cycles = math.ceil(2.0 * rest / lost - _NEAR) if lost > 0.0 else 0
        loses = 2.0 * rest / (cycles + 1) if cycles > 0 else 0.0
        return self._go(1.0 - loses)

    def _go(self, wanted: float) -> Sequence[int]:
        here = self._joints(self.place)
        pace = self._allowed(here, wanted)
        place = min(self.place + pace, float(self._last))
        if abs(place - round(place)) < _NEAR:
            place = float(round(place))
        self._before, self.place, self.pace = here, place, pace
        counts: list[int] = np.rint(self._counts(place)).astype(np.int64).tolist()
        return counts

    def _allowed(self, here: FloatArray, wanted: float) -> float:
        """The pace nearest to the wanted one that no acceleration limit forbids.

        A pace that stays as it is is never refused, so nor is what asks for less than that.
        """
        coasting = 2.0 * here - self._before
        most = np.maximum(self._most, np.abs(self._joints(self.place + self.pace) - coasting))
        pace = wanted
        for _ in range(_TRIES):
            if (np.abs(self._joints(self.place + pace) - coasting) <= most).all():
                return pace
            pace += (self.pace - pace) / 2.0
        return self.pace

    def _joints(self, place: float) -> FloatArray:
        return np.asarray(self._to_joints @ self._counts(place))

    def _counts(self, place: float) -> FloatArray:
        """q(s) in counts, not rounded: Lagrange's cubic through the four rows around s."""
        place = min(max(place, 0.0), float(self._last))
        row = min(int(place), max(self._last - 1, 0))
        x = place - row
        four = self._rows[np.clip(np.arange(row - 1, row + 3), 0, self._last)]
        weights = np.array(
            [
                -x * (x - 1.0) * (x - 2.0) / 6.0,
                (x + 1.0) * (x - 1.0) * (x - 2.0) / 2.0,
                -(x + 1.0) * x * (x - 2.0) / 2.0,
                (x + 1.0) * x * (x - 1.0) / 6.0,
            ]
        )
        return np.asarray(weights @ four)


_TRIES = 6
"""Halvings of a change of pace until it is left out for this cycle."""
