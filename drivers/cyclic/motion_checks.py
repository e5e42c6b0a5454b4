"""Does each axis do what it is told? Following error, readings that stand still, torque."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.cyclic.exchange import Exchange
from drivers.frames.job import Job

TORQUE_TOLERANCE = 0.05
"""Share of a torque limit that readings may be above it: they are noisy and quantised."""
_MOVED_SHARE = 0.1
"""A drive that moves by less of its way than this ignores its set-points rather than lagging."""
_IGNORED = ": the drive may not take set-points (1006, a maker's mode object, its brake)"
"""Of slow moves to a place."""
_STILL_SHARE = 64
"""A set-point has moved on when it has moved by this part of the following error window."""


class MotionChecks:
    """The checks of axes under torque, once per cycle.

    Args:
        job: with windows, limits and budgets.
    """

    def __init__(self, job: Job) -> None:
        n = len(job.links)
        self._drives = job.drives
        self._window = [int(counts) for counts in job.following_error]
        self._near = [-1] * n
        """The windows of axes whose start is known: what is within them, and moves, needs no closer look."""
        self._still_window = [max(20, counts // _STILL_SHARE) for counts in self._window]
        self._frozen_cycles = job.budgets.frozen_cycles
        self._torque_cycles = job.budgets.torque_cycles
        self._torque_limits = job.torque_limits
        self._torques = [(limit.parts, limit.limit * (1 + TORQUE_TOLERANCE)) for limit in job.torque_limits]
        self._homing = job.homing.axis if job.homing is not None else None
        self._maybe_ignored = _IGNORED if job.arrival is not None else ""
        self._start: list[tuple[int, int] | None] = [None] * n
        self._reading: list[int | None] = [None] * n
        self._set_point_then = [0] * n
        self._still = [0] * n
        self._above = [0] * len(job.torque_limits)
        self.blind: set[int] = set()
        """Axes whose readings cannot be believed: their drives regulate on a position that is not there."""

    def check(self, seen: Exchange, set_points: Sequence[int]) -> str | None:
        """Judge one cycle.

        Args:
            seen: latest words; an axis that did not answer is left out.
            set_points: counts that the drives' set-points have reached at this SYNC.

        Returns:
            The first reason to stop, or None.
        """
        reason, still, homing = None, self._still, self._homing
        for axis, (complete, set_point, position, reading, window) in enumerate(
            zip(seen.complete, set_points, seen.position, self._reading, self._near, strict=True)
        ):
            # A drive that searches its home follows no set-point, and its position jumps once it is found.
            if not complete or axis == homing:
                continue
            if position != reading and -window <= set_point - position <= window:
                self._reading[axis], self._set_point_then[axis], still[axis] = position, set_point, 0
            else:
                reason = reason or self._follow(axis, set_point, position)
        return reason or self._torque(seen.control_signal)

    def _follow(self, axis: int, set_point: int, position: int) -> str | None:
        error = abs(set_point - position)
        start = self._start[axis] = self._start[axis] or (set_point, position)
        self._near[axis] = self._window[axis]
        if error > self._window[axis]:
            words = (
                f"following error of {self._drives[axis]} is {error} counts; allowed: {self._window[axis]}"
            )
            sent, moved = set_point - start[0], position - start[1]
            if self._maybe_ignored:
                words += f"; its set-point has moved {sent} counts, it has moved {moved}"
            return words + (self._maybe_ignored if abs(moved) < _MOVED_SHARE * abs(sent) else "")
        if position != self._reading[axis]:
            self._reading[axis], self._set_point_then[axis], self._still[axis] = position, set_point, 0
            return None
        self._still[axis] += 1
        moved = abs(set_point - self._set_point_then[axis])
        if self._still[axis] >= self._frozen_cycles and moved > self._still_window[axis]:
            self.blind.add(axis)
            return (
                f"the position of {self._drives[axis]} reads the same {position} counts for "
                f"{self._still[axis]} SYNCs while its set-point moved {moved} counts{self._maybe_ignored}"
            )
        return None

    def _torque(self, control_signal: Sequence[int]) -> str | None:
        for joint, (parts, allowed) in enumerate(self._torques):
            torque = 0.0
            for axis, factor in parts:
                torque += factor * control_signal[axis]
            if -allowed <= torque <= allowed:
                self._above[joint] = 0
                continue
            limit = self._torque_limits[joint]
            self._above[joint] += 1
            if self._above[joint] > self._torque_cycles:
                return (
                    f"torque of joint {limit.joint} is {torque:.4g} for {self._above[joint]} SYNCs; "
                    f"allowed: {limit.limit:g}"
                )
        return None
