"""Motions of constant jerk by pieces: ruckig's time-optimal segments, chained through moving waypoints.

Segments are computed from state to state, offline, and joined; ruckig's own way of passing waypoints
(`intermediate_positions`) asks a service on the network and is never used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import ruckig

from robots.arrays import FloatArray
from trajectories.limits import Limits
from trajectories.motions.motion import Extremes, MotionState

SHORTEST = 1e-4
"""s; a segment shorter than this goes nowhere."""

_NEARLY = 1.0 - 1e-4


@dataclass(frozen=True)
class PiecewiseJerk:
    """Every joint passes through the same number of phases of constant jerk; arrays are joints × phases.

    Attributes:
        duration: s.
        start: when each phase begins, s; a phase without length is allowed.
        position, velocity, acceleration, jerk: at the beginning of each phase.
    """

    duration: float
    start: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    @property
    def joints(self) -> int:
        return int(self.start.shape[0])

    def at(self, time: FloatArray) -> MotionState:
        """The exact state at each time, (N,) s; times outside [0, duration] give the first or last state."""
        clipped = np.clip(np.atleast_1d(np.asarray(time, dtype=np.float64)), 0.0, self.duration)
        phase = np.empty((clipped.size, self.joints), dtype=np.int64)
        joint = np.arange(self.joints)
        for k, start in enumerate(self.start):
            phase[:, k] = np.searchsorted(start, clipped, side="right") - 1
        t = clipped[:, np.newaxis] - self.start[joint, phase]
        p, v = self.position[joint, phase], self.velocity[joint, phase]
        a, j = self.acceleration[joint, phase], self.jerk[joint, phase]
        return MotionState(p + t * (v + t * (a / 2 + t * j / 6)), v + t * (a + t * j / 2), a + t * j, j)

    def breaks(self) -> FloatArray:
        return np.unique(np.append(self.start, [0.0, self.duration]))

    def travel(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest position of each joint (n,), exact; the quick part of :meth:`extremes`."""
        length = np.diff(self.start, axis=1, append=self.duration)
        p, v, a, j = self.position, self.velocity, self.acceleration, self.jerk
        values = [p]
        for time in _standstills(v, a, j):
            t = np.clip(time, 0.0, length)
            values.append(p + t * (v + t * (a / 2 + t * j / 6)))
        t = length[:, -1]
        end = p[:, -1] + t * (v[:, -1] + t * (a[:, -1] / 2 + t * j[:, -1] / 6))
        every = np.concatenate([*values, end[:, np.newaxis]], axis=1)
        return every.min(axis=1), every.max(axis=1)

    def extremes(self) -> Extremes:
        """Exact: the ends of the phases and the turning points inside them."""
        length = np.diff(self.start, axis=1, append=self.duration)
        p, v, a, j = self.position, self.velocity, self.acceleration, self.jerk
        zero = np.zeros_like(length)
        fastest = np.divide(-a, j, out=zero.copy(), where=j != 0.0)
        turning = (fastest, *_standstills(v, a, j))
        times = np.stack([zero, length, *(np.clip(t, 0.0, length) for t in turning)])
        position = p + times * (v + times * (a / 2 + times * j / 6))
        velocity = np.abs(v + times * (a + times * j / 2))
        acceleration = np.abs(a + times * j)
        # A phase without length is only passed through on paper: its jerk never acts.
        jerk = np.where(length > 0.0, np.abs(j), 0.0) + 0.0 * times
        when = self.start + times
        lowest, lowest_time = _largest(-position, when)
        highest, highest_time = _largest(position, when)
        quickest, velocity_time = _largest(velocity, when)
        strongest, acceleration_time = _largest(acceleration, when)
        jerkiest, jerk_time = _largest(jerk, when)
        return Extremes(
            -lowest,
            highest,
            quickest,
            strongest,
            jerkiest,
            lowest_time,
            highest_time,
            velocity_time,
            acceleration_time,
            jerk_time,
        )


def _standstills(v: FloatArray, a: FloatArray, j: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The two times from the beginning of a phase to q̇ = v + a t + j t²/2 = 0; 0 where there is none."""
    # The stable form of the roots: neither subtracts nearly equal numbers.
    half = -(a + np.copysign(np.sqrt(np.maximum(a * a - 2.0 * j * v, 0.0)), a))
    first = np.divide(half, j, out=np.zeros_like(v), where=j != 0.0)
    second = np.divide(2.0 * v, half, out=np.zeros_like(v), where=half != 0.0)
    return first, second


def _largest(values: FloatArray, when: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Per joint the largest of values (candidates × joints × phases), and when."""
    joints = values.shape[1]
    flat, times = (np.moveaxis(x, 1, 0).reshape(joints, -1) for x in (values, when))
    which = flat.argmax(axis=1)
    rows = np.arange(joints)
    return flat[rows, which], times[rows, which]


def join(parts: Sequence[PiecewiseJerk]) -> PiecewiseJerk:
    """One motion from several that follow each other."""
    starts = np.concatenate([[0.0], np.cumsum([part.duration for part in parts])])
    return PiecewiseJerk(
        duration=float(starts[-1]),
        start=np.concatenate([p.start + s for p, s in zip(parts, starts, strict=False)], axis=1),
        position=np.concatenate([p.position for p in parts], axis=1),
        velocity=np.concatenate([p.velocity for p in parts], axis=1),
        acceleration=np.concatenate([p.acceleration for p in parts], axis=1),
        jerk=np.concatenate([p.jerk for p in parts], axis=1),
    )


def hold(posture: FloatArray, duration: float) -> PiecewiseJerk:
    """Standstill at a posture (n,)."""
    zero = np.zeros((len(posture), 1))
    return PiecewiseJerk(duration, zero, np.asarray(posture, dtype=np.float64)[:, None], zero, zero, zero)


@dataclass(frozen=True)
class Waypoint:
    """A state that a motion passes through.

    Attributes:
        position, velocity, acceleration: each (n,).
        pace: how many times longer than the shortest way the segment up to here lasts.
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    pace: float = 1.0

    @classmethod
    def at_rest(cls, posture: FloatArray) -> Waypoint:
        zero = np.zeros(len(posture))
        return cls(np.asarray(posture, dtype=np.float64), zero, zero)


class SegmentPlanner:
    """Time-optimal, jerk-limited segments from one state to the next, all joints arriving together."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self._ruckig = ruckig.Ruckig(limits.n)
        self._input = ruckig.InputParameter(limits.n)
        self._input.max_velocity = limits.velocity
        self._input.max_jerk = limits.jerk

    def connect(
        self, start: Waypoint, goal: Waypoint, minimum_duration: float | None = None
    ) -> PiecewiseJerk | None:
        """The segment between two states, or None where there is none within the limits.

        ruckig holds velocity, acceleration and jerk. The position on the way is checked here, from the
        phases: ruckig's extrema leave out turning points of joints slowed down to arrive together.
        """
        given = self._input
        given.current_position, given.target_position = start.position, goal.position
        given.current_velocity, given.target_velocity = start.velocity, goal.velocity
        given.current_acceleration, given.target_acceleration = start.acceleration, goal.acceleration
        given.minimum_duration = minimum_duration
        result = self._calculated()
        if result is None or result.duration < SHORTEST:
            return None
        segment = _from_profiles(result)
        return segment if segment is not None and self._stays_inside(segment) else None

    def _calculated(self) -> ruckig.Trajectory | None:
        """ruckig's answer; asked again with a little less where the distance is on the edge of two cases.

        A distance of exactly 2 a³/j², say, is refused with a numerical error.
        """
        for share in (1.0, _NEARLY):
            self._input.max_acceleration = self.limits.acceleration * share
            result = ruckig.Trajectory(self.limits.n)
            try:
                outcome = self._ruckig.calculate(self._input, result)
            except (ruckig.RuckigError, ValueError):
                continue  # its answer to a motion of hours is a code that its own enumeration lacks
            if outcome in (ruckig.Result.Working, ruckig.Result.Finished):
                return result
        return None

    def _stays_inside(self, segment: PiecewiseJerk) -> bool:
        lowest, highest = segment.travel()
        return bool((lowest >= self.limits.lower).all() and (highest <= self.limits.upper).all())


def _from_profiles(result: ruckig.Trajectory) -> PiecewiseJerk | None:
    """ruckig's seven phases per joint, and an eighth for a joint that has arrived or need not move."""
    profiles = result.profiles[0]
    if any(profile.brake.duration > 0.0 or profile.accel.duration > 0.0 for profile in profiles):
        return None  # the start state was outside the limits
    start = np.zeros((len(profiles), 8))
    start[:, 1:] = np.cumsum([profile.t for profile in profiles], axis=1)
    jerk = np.zeros_like(start)
    jerk[:, :7] = [profile.j for profile in profiles]
    return PiecewiseJerk(
        duration=float(result.duration),
        start=np.minimum(start, result.duration),
        position=np.array([profile.p for profile in profiles]),
        velocity=np.array([profile.v for profile in profiles]),
        acceleration=np.array([profile.a for profile in profiles]),
        jerk=jerk,
    )
