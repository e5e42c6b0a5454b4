"""A motion that can be asked for its state at any time, and for its exact extremes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from robots.arrays import FloatArray


@dataclass(frozen=True)
class MotionState:
    """q, q̇, q̈ and jerk at some times, each samples × joints; the times (samples,) s where they matter."""

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    time: FloatArray | None = None


@dataclass(frozen=True)
class Extremes:
    """The largest values over the whole motion, between samples too, each (n,), with where they are.

    Attributes:
        lowest, highest: of the position.
        velocity, acceleration, jerk: largest absolute values.
        lowest_time … jerk_time: when, s.
    """

    lowest: FloatArray
    highest: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    lowest_time: FloatArray
    highest_time: FloatArray
    velocity_time: FloatArray
    acceleration_time: FloatArray
    jerk_time: FloatArray


class Motion(Protocol):
    """A motion over [0, duration]; before and after it stands for its first and last state."""

    @property
    def duration(self) -> float:
        """s."""
        ...

    @property
    def joints(self) -> int: ...

    def at(self, time: FloatArray) -> MotionState:
        """The exact state at each time (N,), s."""
        ...

    def breaks(self) -> FloatArray:
        """Times (ascending, with 0 and the duration) between which every derivative is continuous."""
        ...

    def extremes(self) -> Extremes:
        """Bounds that hold between samples too."""
        ...


@dataclass(frozen=True)
class MotionSequence:
    """Motions one after the other, as lead-in, periods and lead-out."""

    parts: tuple[Motion, ...]

    @property
    def starts(self) -> FloatArray:
        """When each part begins, and when the last one ends, (parts + 1,)."""
        return np.concatenate([[0.0], np.cumsum([part.duration for part in self.parts])])

    @property
    def duration(self) -> float:
        return float(self.starts[-1])

    @property
    def joints(self) -> int:
        return self.parts[0].joints

    @property
    def distinct(self) -> tuple[Motion, ...]:
        """Its parts, each that comes again once: at its first place."""
        found: dict[int, Motion] = {}
        for part in self.parts:
            found.setdefault(id(part), part)
        return tuple(found.values())

    def at(self, time: FloatArray) -> MotionState:
        """The state at each time; where two parts meet, the later one's."""
        time = np.atleast_1d(np.asarray(time, dtype=np.float64))
        starts = self.starts
        which = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, len(self.parts) - 1)
        values = np.empty((4, time.size, self.joints))
        for k, part in enumerate(self.parts):
            here = which == k
            if here.any():
                state = part.at(time[here] - starts[k])
                values[:, here] = state.position, state.velocity, state.acceleration, state.jerk
        return MotionState(values[0], values[1], values[2], values[3])

    def breaks(self) -> FloatArray:
        shifted = [part.breaks() + start for part, start in zip(self.parts, self.starts, strict=False)]
        return np.unique(np.concatenate(shifted))

    def extremes(self) -> Extremes:
        return merge_extremes([part.extremes() for part in self.parts], self.starts[:-1])


def merge_extremes(extremes: Sequence[Extremes], starts: FloatArray) -> Extremes:
    """The extremes of parts that begin at ``starts`` (s), as those of one motion."""
    merged: dict[str, FloatArray] = {}
    for name in ("lowest", "highest", "velocity", "acceleration", "jerk"):
        values = np.array([getattr(e, name) for e in extremes])
        times = np.array([getattr(e, f"{name}_time") + s for e, s in zip(extremes, starts, strict=True)])
        which = values.argmin(axis=0) if name == "lowest" else values.argmax(axis=0)
        joint = np.arange(values.shape[1])
        merged[name] = values[which, joint]
        merged[f"{name}_time"] = times[which, joint]
    return Extremes(**merged)


@dataclass(frozen=True)
class StretchedMotion:
    """A motion on the same path in 1/factor of the time: the slow first run of what comes later.

    Attributes:
        motion: at full speed.
        factor: velocities are multiplied by it, accelerations by its square, jerks by its cube.
    """

    motion: Motion
    factor: float

    @property
    def duration(self) -> float:
        return self.motion.duration / self.factor

    @property
    def joints(self) -> int:
        return self.motion.joints

    def at(self, time: FloatArray) -> MotionState:
        """The state at each time (N,), s."""
        state, s = self.motion.at(np.asarray(time, dtype=np.float64) * self.factor), self.factor
        return MotionState(state.position, s * state.velocity, s**2 * state.acceleration, s**3 * state.jerk)

    def breaks(self) -> FloatArray:
        return self.motion.breaks() / self.factor

    def extremes(self) -> Extremes:
        """Those of the motion, scaled."""
        full, s = self.motion.extremes(), self.factor
        return Extremes(
            full.lowest,
            full.highest,
            s * full.velocity,
            s**2 * full.acceleration,
            s**3 * full.jerk,
            full.lowest_time / s,
            full.highest_time / s,
            full.velocity_time / s,
            full.acceleration_time / s,
            full.jerk_time / s,
        )


def joined_states(states: Sequence[MotionState]) -> MotionState:
    """States one after the other."""
    names = ("position", "velocity", "acceleration", "jerk")
    return MotionState(*(np.concatenate([getattr(state, name) for state in states]) for name in names))


def midpoints(duration: float, count: int) -> FloatArray:
    """The middles of ``count`` equal parts of a duration, s, (count,)."""
    return np.asarray((np.arange(count) + 0.5) * (duration / count), dtype=np.float64)
