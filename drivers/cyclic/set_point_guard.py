"""The last line of defence: under torque no set-point leaves the envelope, whoever has computed it.

A reference was checked before the start, and the motions that the master makes by itself keep to the same
limits. This looks at every set-point once more as it goes out, in counts, so that neither a damaged
reference nor a mistake in the master reaches a drive.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from drivers.frames.job import Job

MARGIN = 0.01
"""Relative, on acceleration limits."""
_ROUNDING = 3
"""Counts that rounding may add to a second difference."""
_BEYOND = 2
"""Counts that rounding may put a set-point beyond the range."""


class SetPointGuard:
    """Position, velocity and acceleration of the set-points of all axes, cycle by cycle.

    Args:
        job: with limits and units.
    """

    def __init__(self, job: Job) -> None:
        self._drives = job.drives
        self._largest_step = job.largest_step
        size = np.abs(job.units.counts_per_output_unit)
        acceleration = job.units.output_span(job.acceleration) * size * job.cycle_time**2
        self._largest_change = [int(counts) for counts in np.ceil(acceleration * (1 + MARGIN)) + _ROUNDING]
        self._ranges = _ranges(job)
        self._each = [
            (step, change, *limits)
            for step, change, limits in zip(
                self._largest_step, self._largest_change, self._ranges, strict=True
            )
        ]
        self._before: Sequence[int] | None = None

    def admit(
        self, targets: Sequence[int], sent: Sequence[int], has_torque: Callable[[int], bool]
    ) -> tuple[Sequence[int], str | None]:
        """Judge what is about to be sent.

        In place of refused set-points all axes coast for this one cycle, so that a ramp can begin with their
        speed; where that would leave the range, too, they stay.

        Args:
            targets: counts, one per axis.
            sent: those of the cycle before.
            has_torque: of an axis; what a drive without torque is told moves nothing.

        Returns:
            What may be sent, and why it is not what was asked for, or None.
        """
        before, self._before = self._before, sent
        reason = self._refusal(targets, sent, before, has_torque)
        if reason is None or before is None:
            return (targets if reason is None else sent), reason
        coasting = [2 * last - earlier for last, earlier in zip(sent, before, strict=True)]
        fine = self._refusal(coasting, sent, before, has_torque) is None
        return (coasting if fine else sent), reason

    def _refusal(
        self,
        targets: Sequence[int],
        sent: Sequence[int],
        before: Sequence[int] | None,
        has_torque: Callable[[int], bool],
    ) -> str | None:
        steps, changes, ranges = self._largest_step, self._largest_change, self._ranges
        rows = zip(targets, sent, before or sent, self._each, strict=True)
        for axis, (target, last, earlier, (most, change, low, high)) in enumerate(rows):
            step = target - last
            if -most <= step <= most and -change <= step - last + earlier <= change and low <= target <= high:
                continue
            low, high = ranges[axis]
            if (
                abs(step) > steps[axis]
                or (before is not None and abs(step - last + earlier) > changes[axis])
                or (target > high and step > 0)
                or (target < low and step < 0)
            ) and has_torque(axis):
                return self._words(axis, target, last, earlier)
        return None

    def _words(self, axis: int, target: int, last: int, earlier: int) -> str:
        name, step = f"set-point of {self._drives[axis]}", target - last
        if abs(step) > self._largest_step[axis]:
            allowed = self._largest_step[axis]
            return f"{name} would have jumped by {step} counts in one cycle; allowed: {allowed}"
        low, high = self._ranges[axis]
        if (target > high and step > 0) or (target < low and step < 0):
            return f"{name} would have left its range with {target} counts; allowed: {low} to {high}"
        change = step - (last - earlier)
        return (
            f"set-point speed of {self._drives[axis]} would have jumped by {change} counts per cycle; "
            f"allowed: {self._largest_change[axis]}"
        )


def _ranges(job: Job) -> list[tuple[float, float]]:
    """Counts that each drive output may have within the joints' limits."""
    if job.position_limits is None:
        return [(-np.inf, np.inf)] * len(job.links)
    lower, upper = job.position_limits
    to_counts = job.units.transmission * job.units.counts_per_output_unit[:, None]
    forward, backward = np.maximum(to_counts, 0.0), np.minimum(to_counts, 0.0)
    lowest = np.floor(forward @ lower + backward @ upper) - _BEYOND
    highest = np.ceil(forward @ upper + backward @ lower) + _BEYOND
    return [(int(low), int(high)) for low, high in zip(lowest, highest, strict=True)]
