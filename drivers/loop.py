"""The cyclic part of a stream: enable, approach, stream, ramp down, disable; one SYNC at a time.

Order of a cycle k: deadline, SYNC k, TPDOs of SYNC k, checks, RPDOs with the targets that the drives latch
at SYNC k+1, record. So the reference of row k is what was sent in the RPDOs before SYNC k.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence

import can
import numpy as np

from drivers.cia402.states import LEVEL, Command, Goal, has_torque, next_controlword, refusal, state_of
from drivers.exchange import Exchange
from drivers.job import Job
from drivers.pacemaker import Pacemaker
from drivers.ramp import approach, stop_ramp
from drivers.ring import Ring
from drivers.samples import StreamResult
from drivers.watch import Watch

RECEIVE_SHARE = 0.6
"""Share of the period for TPDOs; the rest is for the RPDOs to get out before the next SYNC."""
LEAST_RECEIVE_SHARE = 0.1
DISABLE_SECONDS = 1.0
BLIND_CYCLES = 5
"""How often the last "disable voltage" goes to drives that do not confirm."""
STANDSTILL_CYCLES = 5
STANDSTILL_SHARE = 0.005
"""An arm is at rest when each joint is slower than this share of its velocity limit."""

_NAMES = {
    Goal.READY: "shutdown",
    Goal.SWITCHED_ON: "switch on",
    Goal.OPERATION_ENABLED: "enable operation",
}


class Loop:
    """One stream on an open bus.

    Args:
        job: what to do.
        bus: opened for exchange.receive_cob_ids.
        ring: where rows go.
        parent_alive: asked once per cycle.
        terminated: asked once per cycle: was this process told to end?
        clock, sleep: time, s.
    """

    def __init__(
        self,
        job: Job,
        bus: can.BusABC,
        ring: Ring,
        parent_alive: Callable[[], bool] = lambda: True,
        terminated: Callable[[], bool] = lambda: False,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.job = job
        self.ring = ring
        self.clock = clock
        self.exchange = Exchange(bus, job.nodes, job.control_signal_bits, clock)
        self.pace = Pacemaker(job.cycle_time, clock, sleep)
        self.watch = Watch(job, self.exchange, self.pace, ring, parent_alive, terminated)
        n = len(job.nodes)
        self.goals = [Goal.SWITCH_ON_DISABLED] * n
        self.latched_before: Sequence[int] = [0] * n
        """Targets in force until the latest SYNC: the drives' set-points reach them at it."""
        self.latched: Sequence[int] = [0] * n
        """Targets in force since the latest SYNC."""
        self.sent: Sequence[int] = [0] * n
        """Targets of the latest RPDOs: latched at the next SYNC."""
        self.commanded = False
        self._pending: tuple[tuple[float, ...], list[bool]] | None = None
        self.lateness = 0.0
        self.rows = self.recorded = self.missed = self.late = self.incomplete = 0
        """Of the recorded part."""

    def run(self) -> StreamResult:
        """Do the job; returns when the drives are disabled, however it went."""
        self._warm_up()
        self.pace.restart()
        if self._first_answers() and self._enable():
            self._approach()
            if self.watch.fine:
                self._stream()
            self._come_to_rest()
        self._disable()
        return self._result()

    def _warm_up(self) -> None:
        """Use once what the cycle will use: the first call of a linear solver takes many milliseconds."""
        job = self.job
        two = job.units.position(np.array([job.reference[0], job.reference[0] + 1]))
        job.units.counts(stop_ramp(two[0], two[1], job.acceleration, job.cycle_time)).tolist()
        job.units.counts(approach(two[0], two[1], job.velocity, job.acceleration, job.cycle_time)).tolist()
        self.watch.verdict()

    # One cycle ------------------------------------------------------------------------------

    def _sync(self) -> None:
        """Wait, SYNC, TPDOs, checks."""
        self.lateness = self.pace.wait()
        self.exchange.sync()
        self.latched_before, self.latched = self.latched, self.sent
        now = self.clock()
        period = self.job.cycle_time
        self._publish()
        # A drive that is lost is not waited for.
        lost = any(self.watch.lost(axis) for axis in range(len(self.goals)))
        until = max(
            self.pace.deadline + RECEIVE_SHARE * period,
            now + LEAST_RECEIVE_SHARE * period,
            now if lost else now + self.job.budgets.receive_seconds,
        )
        self.exchange.receive(until)
        self.watch.check(self.latched_before, self.goals)

    def _command(self, targets: Sequence[int], blindly: bool = False) -> None:
        """Send controlwords towards the goals, and the targets in counts.

        Args:
            targets: counts, one per axis.
            blindly: switch drives off in one step, whatever they say.
        """
        words = self.exchange.statusword
        controlwords = [next_controlword(word, goal) for word, goal in zip(words, self.goals, strict=True)]
        for axis, goal in enumerate(self.goals):
            # A drive that does not say where it is cannot be led down step by step.
            if goal is Goal.SWITCH_ON_DISABLED and (blindly or self.watch.lost(axis)):
                controlwords[axis] = Command.DISABLE_VOLTAGE
        self.exchange.send(controlwords, targets)
        self.sent = targets
        self.commanded = True

    def _record(self) -> None:
        seen = self.exchange
        columns = (self.latched, seen.position, seen.control_signal, seen.statusword)
        row = (self.rows, self.lateness, *(value for column in columns for value in column))
        self._pending = row, list(seen.complete)
        self.rows += 1
        self.missed += self.pace.missed_now
        self.late += self.pace.late_now

    def _publish(self) -> None:
        """Hand out the row of the SYNC before, now that it is known which drives answered it in time.

        A drive that answers twice between two SYNCs gave its first answer to the SYNC before that.
        """
        if self._pending is None:
            return
        row, complete = self._pending
        self._pending = None
        complete = [c and not d for c, d in zip(complete, self.exchange.doubled, strict=True)]
        self.incomplete += not all(complete)
        if not self.ring.write(*row, *complete):
            self.watch.abort("the samples were not fetched in time: the ring is full")
            return
        self.recorded += 1

    def _cycles(self, seconds: float) -> int:
        return max(1, round(seconds / self.job.cycle_time))

    # Phases ---------------------------------------------------------------------------------

    def _first_answers(self) -> bool:
        """SYNCs alone, until each drive has answered one: nothing is sent before the positions are known."""
        answered = [False] * len(self.goals)
        for _ in range(self._cycles(self.job.budgets.answer_seconds)):
            self._sync()
            answered = [a or c for a, c in zip(answered, self.exchange.complete, strict=True)]
            if all(answered) or not self.watch.fine:
                break
        for axis, drive in enumerate(self.job.drives):
            if not answered[axis]:
                self.watch.abort(f"{drive} sends no TPDO after {self.job.budgets.answer_seconds:g} s of SYNC")
            elif (reason := refusal(self.exchange.statusword[axis])) is not None:
                self.watch.fault(axis, f"{drive} cannot be enabled: {reason}")
        return self.watch.fine

    def _enable(self) -> bool:
        """All axes up the state machine together, step by step; targets are the actual positions."""
        for goal in (Goal.READY, Goal.SWITCHED_ON, Goal.OPERATION_ENABLED):
            self.goals = [goal] * len(self.goals)
            for _ in range(self._cycles(self.job.budgets.enable_seconds)):
                self._command(self._hold())
                self._sync()
                if not self.watch.fine:
                    return False
                if all(LEVEL.get(state_of(word)) == goal for word in self.exchange.statusword):
                    break
            else:
                self._refuse_enable(goal)
                return False
            self.watch.enabled = goal is Goal.OPERATION_ENABLED
        return True

    def _refuse_enable(self, goal: Goal) -> None:
        for drive, word in zip(self.job.drives, self.exchange.statusword, strict=True):
            if LEVEL.get(state_of(word)) != goal:
                seconds = self.job.budgets.enable_seconds
                self.watch.abort(
                    f"{drive} stayed in state {state_of(word).value!r} for {seconds:g} s "
                    f"after {_NAMES[goal]!r}"
                )
                return

    def _hold(self) -> list[int]:
        """The last target for an axis under torque, the actual position for one without."""
        seen = zip(self.exchange.statusword, self.sent, self.exchange.position, strict=True)
        return [target if has_torque(word) else position for word, target, position in seen]

    def _approach(self) -> None:
        """From where the arm was enabled onto the reference's first point, then a moment at rest."""
        job = self.job
        start, end = job.units.position(np.array([self.sent, job.reference[0]]))
        if (far := np.abs(end - start) > job.start_tolerance).any():
            axis = int(np.argmax(far))
            self.watch.abort(
                f"joint {job.units.joints[axis]} stands {abs(end - start)[axis]:.4g} from the reference's "
                f"first point; allowed: {job.start_tolerance[axis]:.4g}"
            )
            return
        way = job.units.counts(approach(start, end, job.velocity, job.acceleration, job.cycle_time)).tolist()
        rest = [job.reference[0].tolist()] * self._cycles(job.budgets.settle_seconds)
        self._follow([*way, *rest], record=False)

    def _stream(self) -> None:
        """The reference, one target per SYNC that is sent, whatever deadlines were skipped.

        The SYNC just sent has latched the first point: it is row 0. Row k is recorded when target k+1 goes
        out; after the last one that target stays.
        """
        following = self.job.reference[1:].tolist()
        self._follow([*following, self.job.reference[-1].tolist()], record=True)

    def _follow(self, targets: Iterable[list[int]], record: bool) -> None:
        """One target per cycle until they end or something asks for a stop; then the stop ramp.

        Like every phase it begins and ends between the TPDOs and the RPDOs of a cycle.
        """
        for target in targets:
            if not self.watch.fine:
                self._ramp_down(record)
                return
            self._command(target)
            if record:
                self._record()
            self._sync()

    def _ramp_down(self, record: bool) -> None:
        """Bring the set-points to rest."""
        job = self.job
        previous, last = job.units.position(np.array([self.latched_before, self.latched]))
        ramp = job.units.counts(stop_ramp(previous, last, job.acceleration, job.cycle_time)).tolist()
        rest = ramp[-1] if ramp else list(self.latched)
        for target in [*ramp, rest]:
            self._command(target)
            if record:
                self._record()
            self._sync()

    def _come_to_rest(self) -> None:
        """Hold the last target until the arm stands, or its time is over."""
        limit = STANDSTILL_SHARE * self.job.velocity * STANDSTILL_CYCLES * self.job.cycle_time
        past: list[list[int]] = []
        for _ in range(self._cycles(self.job.budgets.standstill_seconds)):
            self._command(self._hold())
            self._sync()
            past.append(list(self.exchange.position))
            if len(past) > STANDSTILL_CYCLES:
                now, then = self.job.units.position(np.array([past[-1], past[-1 - STANDSTILL_CYCLES]]))
                if (np.abs(now - then) <= limit).all():
                    return

    def _disable(self) -> None:
        """All axes down the state machine together; nothing is sent to drives that were never commanded."""
        self.watch.enabled = False
        self.goals = [Goal.SWITCH_ON_DISABLED] * len(self.goals)
        if not self.commanded:
            return
        for _ in range(self._cycles(DISABLE_SECONDS)):
            self._command(self._hold())
            self._sync()
            if not any(self._is_up(word) for word in self.exchange.statusword):
                return
        for _ in range(BLIND_CYCLES):
            self._command(self._hold(), blindly=True)
            self._sync()
        up = [
            d for d, word in zip(self.job.drives, self.exchange.statusword, strict=True) if self._is_up(word)
        ]
        self.watch.abort(f"{', '.join(up)} did not confirm within {DISABLE_SECONDS:g} s that torque is off")

    @staticmethod
    def _is_up(statusword: int) -> bool:
        return has_torque(statusword) or LEVEL.get(state_of(statusword), Goal.SWITCH_ON_DISABLED) > 0

    def _result(self) -> StreamResult:
        self._publish()
        outcome, reason = self.watch.verdict()
        return StreamResult(
            outcome=outcome,
            reason=reason,
            cycles=self.recorded,
            missed_cycles=self.missed,
            late_cycles=self.late,
            incomplete_cycles=self.incomplete,
        )
