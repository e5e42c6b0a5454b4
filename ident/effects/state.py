"""The motion at which torques are asked for, and what effects make of it again and again."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from robots.arrays import FloatArray
from robots.carried import Load
from robots.identity_cache import IdentityCache

Made = TypeVar("Made")


@dataclass(frozen=True, eq=False)
class Asked:
    """The torque that drives are asked for, before any filter: what they make of it, they make of that.

    Attributes:
        torque: all samples of a recording × joints, N·m (or N).
        seen: what is made of it, samples × k, as it is seen at the samples of a motion.
    """

    torque: FloatArray
    seen: Callable[[FloatArray], FloatArray]

    def then(self, further: Callable[[FloatArray], FloatArray]) -> Asked:
        """Seen through one thing more."""
        return Asked(self.torque, lambda made: further(self.seen(made)))


_STILL = 0.01
"""Of a joint's largest speed: slower it stands."""


@dataclass(frozen=True)
class State:
    """The motion at which torques are asked for: q, q̇, q̈, each samples × joints, rad (or m) and s.

    ``time`` (samples,) is the time since the arm was switched on or the first recording began, s. Effects
    with a history (drift, elasticity) need it and even samples in order; others look at each sample alone.
    ``torque`` is the measured joint torque, samples × joints, where there is one: a saturated drive shows
    only against it. ``load`` is a known body that the arm carries meanwhile: the gears feel it, too. A motion
    that repeats does so after ``period`` samples. Of a motion that was simulated ``measured`` is the one that
    was recorded, at the same instants. ``asked`` is the torque before the filter that ``torque`` has passed.
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    time: FloatArray | None = None
    torque: FloatArray | None = None
    load: Load | None = None
    period: int | None = None
    measured: State | None = None
    asked: Asked | None = None
    _made: IdentityCache[Any] = field(init=False, default_factory=lambda: IdentityCache(8), compare=False)

    def once(self, model: object, key: Hashable, make: Callable[[], Made]) -> Made:
        """What effects ask of this motion and of one model again and again, made once; by the very model."""
        made: dict[Hashable, Made] = self._made.of(model, dict)
        return made[key] if key in made else made.setdefault(key, make())

    def part(self, kept: slice) -> State:
        """Some samples, every so many of them; the period is a whole number of steps."""
        channels = (self.position, self.velocity, self.acceleration)
        position, velocity, acceleration = (np.ascontiguousarray(one[kept]) for one in channels)
        time = None if self.time is None else self.time[kept]
        torque = None if self.torque is None else np.ascontiguousarray(self.torque[kept])
        period = None if self.period is None else self.period // (kept.step or 1)
        measured = None if self.measured is None else self.measured.part(kept)
        asked = None if self.asked is None else self.asked.then(lambda made: np.ascontiguousarray(made[kept]))
        return State(position, velocity, acceleration, time, torque, self.load, period, measured, asked)

    def with_torque(self, torque: FloatArray) -> State:
        """The same motion with another torque."""
        return replace(self, torque=torque, asked=None)

    def moved(self, position: FloatArray, velocity: FloatArray, acceleration: FloatArray) -> State:
        """Another motion at the same time, with the same load; what was measured is not of it."""
        return State(position, velocity, acceleration, self.time, None, self.load, self.period)

    @property
    def repeats(self) -> bool:
        """Whether a whole period is there, and more."""
        return self.period is not None and self.period < self.position.shape[0]

    def with_before(self, series: FloatArray, seconds: float) -> FloatArray:
        """A series (samples, k) of this motion, and before it what was there before the record began.

        An arm that stands still has stood still: there is nothing before. Of a motion that repeats that is
        its period. Else nobody knows, and it is the series turned about its first sample: it goes on as it
        began, and what has a state has none of its own at the start.
        (A foot that began at rest in the middle of a motion swung with 110 N·m for 1.5 s, the arm with 20.)

        Args:
            series: at even samples.
            seconds: as long as is needed, where nobody knows and there is so much.
        """
        assert self.time is not None
        if (np.abs(self.velocity[0]) <= _STILL * np.abs(self.velocity).max(axis=0)).all():
            return series
        if self.repeats:
            return np.concatenate([series[: self.period], series])
        wanted = int(np.ceil(seconds / float(self.time[1] - self.time[0])))
        wanted = min(wanted, series.shape[0] - 1)
        return np.concatenate([2.0 * series[0] - series[wanted:0:-1], series])

    def ahead(self, shift: float) -> FloatArray:
        """q, q̇ and q̈ some time on (s), as the samples about it go through: samples × 3 × joints."""
        from scipy.interpolate import CubicSpline  # here: it takes long to load

        time, motion = self.time, (self.position, self.velocity, self.acceleration)
        assert time is not None
        course = self.once(None, "course", lambda: CubicSpline(time, np.stack(motion, axis=1)))
        return np.asarray(course(np.clip(time + shift, time[0], time[-1])))
