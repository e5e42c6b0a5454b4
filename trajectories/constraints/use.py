"""How much of its limits a motion uses, between samples too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robots.arrays import FloatArray
from trajectories.errors import TrajectoryError
from trajectories.limits import ROUNDING, Limits
from trajectories.motions.motion import Motion


@dataclass(frozen=True)
class Use:
    """How much of one limit a motion uses, at the joint and time where it uses most.

    Attributes:
        constraint: ``position``, ``velocity``, …
        share: (n,) of the limit; for positions, 1 is at the limit and 0 in the middle of the travel.
        time: (n,) when, s.
        value, limit: (n,) SI.
    """

    constraint: str
    share: FloatArray
    time: FloatArray
    value: FloatArray
    limit: FloatArray

    def later(self, seconds: float) -> Use:
        """The same of a motion that begins so much later."""
        return replace(self, time=self.time + seconds)


def largest_use(uses: Sequence[Use]) -> Use:
    """Of one limit over several pieces of a motion: per joint the largest, and the first of equal ones."""
    which = np.argmax([use.share for use in uses], axis=0)
    joint = np.arange(len(which))
    share, time, value, limit = (
        np.array([getattr(use, name) for use in uses])[which, joint]
        for name in ("share", "time", "value", "limit")
    )
    return Use(uses[0].constraint, share, time, value, limit)


def kinematic_use(motion: Motion, limits: Limits) -> tuple[Use, ...]:
    """Use of the position, velocity, acceleration and jerk limits, between samples too."""
    extremes = motion.extremes()
    middle, half = (limits.upper + limits.lower) / 2, (limits.upper - limits.lower) / 2
    above = (extremes.highest - middle) / half
    below = (middle - extremes.lowest) / half
    high = above >= below
    uses = [
        Use(
            "position",
            np.where(high, above, below),
            np.where(high, extremes.highest_time, extremes.lowest_time),
            np.where(high, extremes.highest, extremes.lowest),
            np.where(high, limits.upper, limits.lower),
        )
    ]
    for name in ("velocity", "acceleration", "jerk"):
        value, limit = getattr(extremes, name), getattr(limits, name)
        uses.append(Use(name, value / limit, getattr(extremes, f"{name}_time"), value, limit))
    return tuple(uses)


def require_within(uses: tuple[Use, ...], names: tuple[str, ...]) -> None:
    """Raise for the first limit that a motion breaks.

    Raises:
        TrajectoryError: names the constraint, the joint, the value, what is allowed, and the time.
    """
    for error in broken(uses, names):
        raise error


def broken(uses: tuple[Use, ...], names: tuple[str, ...]) -> tuple[TrajectoryError, ...]:
    """One error for each limit that a motion breaks, at the joint and time where it is worst."""
    errors = []
    for use in uses:
        worst = int(np.argmax(use.share))
        if use.share[worst] > 1.0 + ROUNDING:
            errors.append(
                TrajectoryError(
                    f"{use.constraint} reaches {_told_apart(use.value[worst], use.limit[worst])}",
                    constraint=use.constraint,
                    joint=names[worst],
                    time=float(use.time[worst]),
                )
            )
    return tuple(errors)


def _told_apart(value: float, limit: float) -> str:
    """Value and limit with as many digits as show which is larger."""
    digits = next((d for d in (6, 9, 12) if f"{value:.{d}g}" != f"{limit:.{d}g}"), 17)
    return f"{value:.{digits}g}; allowed: {limit:.{digits}g}"
