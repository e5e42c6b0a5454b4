"""The motion of a stream: onto the reference, along it, pauses on it, and down to rest."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from drivers.cyclic.cycle import Cycle
from drivers.cyclic.path_pace import PathPace
from drivers.cyclic.power import hold_for
from drivers.cyclic.ramp import approach, stop_ramp
from drivers.frames.ring import Request
from robots.arrays import FloatArray

PAUSES = (Request.PAUSE, Request.PAUSE_AFTER)
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
        pace = self._pace_at(0)
        pace.slower()
        pace.faster()
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
        out; after the last one that target stays. On the way into a pause and out of it the path is driven
        slower, and recorded as it is driven; while the arm rests nothing is recorded.

        Returns:
            Whether what comes next still belongs to the record: not where it ended while the arm rested.
        """
        targets, last = self._targets, len(self._targets) - 1
        cycle, watch = self._cycle, self._cycle.watch
        row, recorded = 1, True
        while row <= last + 1:
            if watch.request is not None and watch.fine and self._asked_for_here(watch.request, row):
                row, recorded = self._pause(row)
            if not watch.fine:
                self._ramp_down(record=recorded)
                return recorded
            cycle.command(targets[min(row, last)])
            cycle.record()
            cycle.turn()
            row += 1
        return True

    def arrive(self) -> None:
        """Hold the last target until each joint is where it was sent, as near as the job asks.

        A drive that ignores its set-points, or counts them in another unit, is found out here.
        """
        cycle, job = self._cycle, self._job
        if job.arrival is None:
            return
        wanted = job.units.position(np.array([cycle.sent]))[0]
        for _ in range(cycle.turns(job.budgets.standstill_seconds)):
            off = np.abs(job.units.position(np.array([cycle.exchange.position]))[0] - wanted)
            if (off <= job.arrival).all() or not cycle.watch.fine:
                return
            cycle.command(cycle.sent)
            cycle.turn()
        axis = int(np.argmax(off / job.arrival))
        cycle.watch.abort(
            f"joint {job.units.joints[axis]} has not arrived, it stands {off[axis]:.4g} from its target; "
            f"allowed: {job.arrival[axis]:.4g}"
        )

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

    # Pauses ---------------------------------------------------------------------------------

    def _asked_for_here(self, request: Request, row: int) -> bool:
        """Whether to pause before a row goes out; a stop that was asked for takes effect, too."""
        if row not in self._ends:
            return request is Request.PAUSE
        if request is Request.STOP:
            self._cycle.watch.stop("stop requested: the period was finished")
        return request in PAUSES

    def _pause(self, row: int) -> tuple[int, bool]:
        """Slower along the path to rest, hold there, and on again up to the path's own pace.

        Returns:
            The row to go on with, and whether the record goes on without a gap.
        """
        watch, pace = self._cycle.watch, self._pace_at(row - 1)
        pauses: tuple[Request, ...] = PAUSES
        while watch.fine:
            if watch.request in pauses:
                if pace.at_rest:
                    self._hold_at(pace)
                    if not watch.fine:
                        return row, False
                    continue
                target = pace.slower()
            elif pace.at_own_pace:
                break
            else:
                pauses = (Request.PAUSE,)  # the end of this period is behind
                target = pace.faster()
            self._record_next(target)
        return round(pace.place) + 1, True

    def _hold_at(self, pace: PathPace) -> None:
        """Rest where the path was left, under torque, for as long as a pause is asked for."""
        cycle, watch = self._cycle, self._cycle.watch
        self._record_next(pace.slower())
        while watch.fine and watch.request in PAUSES:
            hold_for(cycle, self._job.cycle_time)
        if watch.fine and watch.request is Request.STOP:
            watch.stop("stop requested in a pause")
        if watch.fine:
            self.pauses.append(cycle.rows)

    def _record_next(self, target: Sequence[int]) -> None:
        cycle = self._cycle
        cycle.command(target)
        cycle.record()
        cycle.turn()

    def _pace_at(self, row: int) -> PathPace:
        job = self._job
        return PathPace(job.reference, job.units, job.acceleration, job.cycle_time, row)

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
