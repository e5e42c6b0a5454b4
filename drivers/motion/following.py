"""The motion of a stream: onto the reference, along it, pauses between its periods, and down to rest."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import chain, islice

import numpy as np

from drivers.cyclic.cycle import Cycle
from drivers.cyclic.power import hold_for
from drivers.cyclic.requests import Request
from drivers.motion.ramp import approach, run_up, stop_ramp
from robots.arrays import FloatArray

STANDSTILL_CYCLES = 5
STANDSTILL_SHARE = 0.005
"""An arm is at rest when each joint is slower than this share of its velocity limit."""


class Follower:
    """Leads all axes along set-points; like every phase it begins and ends between TPDOs and RPDOs.

    Args:
        cycle: the loop's turn.
    """

    def __init__(self, cycle: Cycle) -> None:
        self.pauses: list[int] = []
        """Rows before which the arm was paused."""
        self._cycle = cycle
        self._job = cycle.job
        self._ends = frozenset(cycle.job.period_ends)
        self._targets: list[list[int]] = cycle.job.reference.tolist()
        """The reference as it is sent; a long one takes milliseconds to convert, which no cycle has."""

    def warm_up(self) -> None:
        """Use once what the cycle will use: the first call of a linear solver takes many milliseconds."""
        job = self._job
        two = job.units.position(np.array([job.reference[0], job.reference[0] + 1]))
        self._counts(stop_ramp(two[0], two[1], job.acceleration, job.cycle_time))
        self._counts(approach(two[0], two[1], job.velocity, job.acceleration, job.cycle_time))
        self._cycle.watch.verdict()

    def approach(self) -> None:
        """From where the arm was enabled onto the reference's first point, then a moment at rest."""
        job, cycle = self._job, self._cycle
        start, end = job.units.position(np.array([cycle.sent, job.reference[0]]))
        if (far := np.abs(end - start) > job.start_tolerance).any():
            axis = int(np.argmax(far))
            cycle.watch.abort(
                f"joint {job.units.joints[axis]} stands {abs(end - start)[axis]:.4g} from the reference's "
                f"first point; allowed: {job.start_tolerance[axis]:.4g}"
            )
            return
        self._move_to(start, end)
        self._follow([job.reference[0].tolist()] * cycle.turns(job.budgets.settle_seconds), record=False)

    def stream(self) -> bool:
        """The reference, one target per SYNC that is sent, whatever deadlines were skipped.

        The SYNC just sent has latched the first point: it is row 0. Row k is recorded when target k+1 goes
        out; after the last one that target stays.

        Returns:
            Whether what comes next still belongs to the record: not where it ended in a pause.
        """
        targets = self._targets
        cycle, watch = self._cycle, self._cycle.watch
        for row, target in enumerate(chain(islice(targets, 1, None), targets[-1:]), start=1):
            paused = False
            if row in self._ends and watch.request is not None and watch.fine:
                paused = self._end_period(targets, row)
            if not watch.fine:
                # The way into a pause is not recorded, so what follows would not fit what was before.
                self._ramp_down(record=not paused)
                return not paused
            cycle.command(target)
            cycle.record()
            cycle.turn()
        return True

    def come_to_rest(self) -> None:
        """Hold the last target until the arm stands, or its time is over."""
        cycle, job = self._cycle, self._job
        limit = STANDSTILL_SHARE * job.velocity * STANDSTILL_CYCLES * job.cycle_time
        past: list[list[int]] = []
        for _ in range(cycle.turns(job.budgets.standstill_seconds)):
            cycle.command(cycle.hold())
            cycle.turn()
            if cycle.watch.halting:
                return
            past.append(list(cycle.exchange.position))
            if len(past) > STANDSTILL_CYCLES:
                now, then = job.units.position(np.array([past[-1], past[-1 - STANDSTILL_CYCLES]]))
                if (np.abs(now - then) <= limit).all():
                    return

    # Periods --------------------------------------------------------------------------------

    def _end_period(self, targets: list[list[int]], row: int) -> bool:
        """What was asked for the end of a period: a pause (True), or the end of the stream."""
        watch = self._cycle.watch
        if watch.request is Request.STOP:
            watch.stop("stop requested: the period was finished")
            return False
        self._ramp_down(record=False)
        request: Request | None = Request.PAUSE
        while watch.fine and request is Request.PAUSE:
            hold_for(self._cycle, self._job.cycle_time)
            request = watch.request
        if watch.fine and request is Request.STOP:
            watch.stop("stop requested in a pause")
        if watch.fine:
            self._resume(targets[row - 1], targets[row])
            self.pauses.append(self._cycle.rows)
        return True

    def _resume(self, boundary: list[int], following: list[int]) -> None:
        """From rest to the end of the period, at the velocity that the next one begins with."""
        job = self._job
        last, after = job.units.position(np.array([boundary, following]))
        way = run_up(last, after, job.acceleration, job.cycle_time)
        first = way[0] if len(way) else last
        if job.position_limits is not None:
            lower, upper = job.position_limits
            if (outside := (first < lower) | (first > upper)).any():
                joint = job.units.joints[int(np.argmax(outside))]
                self._cycle.watch.abort(f"cannot resume: the run-up of joint {joint} leaves its limits")
                return
        self._move_to(job.units.position(self._cycle.sent), first)
        self._follow([*self._counts(way), boundary], record=False)

    # Motions --------------------------------------------------------------------------------

    def _move_to(self, start: FloatArray, end: FloatArray) -> None:
        job = self._job
        self._follow(
            self._counts(approach(start, end, job.velocity, job.acceleration, job.cycle_time)), record=False
        )

    def _follow(self, targets: Iterable[Sequence[int]], record: bool) -> None:
        """One target per cycle until they end or something asks for a stop; then the stop ramp."""
        cycle = self._cycle
        for target in targets:
            if not cycle.watch.fine:
                self._ramp_down(record)
                return
            cycle.command(target)
            if record:
                cycle.record()
            cycle.turn()

    def _ramp_down(self, record: bool) -> None:
        """Bring the set-points to rest; nothing where the drives are asked to stop by themselves."""
        cycle, job = self._cycle, self._job
        previous, last = job.units.position(np.array([cycle.latched_before, cycle.latched]))
        ramp = self._counts(stop_ramp(previous, last, job.acceleration, job.cycle_time))
        rest = ramp[-1] if ramp else list(cycle.latched)
        for target in [*ramp, rest]:
            if cycle.watch.halting:
                return
            cycle.command(target)
            if record:
                cycle.record()
            cycle.turn()

    def _counts(self, positions: FloatArray) -> list[list[int]]:
        counts: list[list[int]] = self._job.units.counts(positions).tolist()
        return counts
