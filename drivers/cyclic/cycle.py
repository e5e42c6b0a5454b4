"""One SYNC period of a stream: deadline, SYNC, TPDOs, checks, RPDOs, record.

Order of a cycle k: deadline, SYNC k, TPDOs of SYNC k, checks, RPDOs with the targets that the drives latch
at SYNC k+1, record. So the reference of row k is what was sent in the RPDOs before SYNC k.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from itertools import islice

from drivers.bus.ports import FramePort
from drivers.cia402.states import MODE_BIT, Command, Goal, has_torque, next_controlword
from drivers.cyclic.delays import Delays
from drivers.cyclic.exchange import Exchange
from drivers.cyclic.pacemaker import Pacemaker
from drivers.cyclic.set_point_guard import SetPointGuard
from drivers.cyclic.watch import Watch
from drivers.frames.job import Job
from drivers.frames.ring import Ring

RECEIVE_SHARE = 0.6
"""Share of the period for TPDOs; the rest is for the RPDOs to get out before the next SYNC."""
LEAST_RECEIVE_SHARE = 0.1
LONGEST_RECEIVE_SHARE = 0.9
HEARTBEATS_PER_WATCH = 4
"""Heartbeats of the master in the time after which the drives would miss them."""
ROWS_PER_SYNC = 4
"""Handed out at most: many wait for the same heartbeat, and no cycle has time for all of them."""


def receive_seconds(job: Job) -> float:
    """How long after a SYNC answers are waited for: longer where a kind of drive is that slow, s."""
    slowest = max((link.tpdo_delay for link in job.links), default=0.0)
    longest = LONGEST_RECEIVE_SHARE * job.cycle_time
    return max(RECEIVE_SHARE * job.cycle_time, min(slowest + LEAST_RECEIVE_SHARE * job.cycle_time, longest))


_Row = list[float]
"""What the ring takes; at its end, for each drive, whether it answered."""
_DOWN = Goal.SWITCH_ON_DISABLED


class Cycle:
    """The loop's one turn, and what it keeps from turn to turn.

    Args:
        job: what to do.
        port: the bus, opened for foreign.receive_cob_ids.
        ring: where rows go.
        parent_alive: asked once per cycle.
        terminated: asked once per cycle: was this process told to end?
        clock, sleep: time, s.
        processor: time of the processor that this thread has used, s.
    """

    def __init__(
        self,
        job: Job,
        port: FramePort,
        ring: Ring,
        parent_alive: Callable[[], bool] = lambda: True,
        terminated: Callable[[], bool] = lambda: False,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
        processor: Callable[[], float] = time.thread_time,
    ) -> None:
        self.job = job
        self.ring = ring
        self.clock, self._processor = clock, processor
        self.exchange = Exchange(port, job.links, job.master_node, clock, sleep)
        self.pace = Pacemaker(job.cycle_time, clock, sleep)
        self.watch = Watch(job, self.exchange, self.pace, ring, parent_alive, terminated, clock)
        n = len(job.links)
        self.goals = [Goal.SWITCH_ON_DISABLED] * n
        self.latched_before: Sequence[int] = [0] * n
        """Targets in force until the latest SYNC: the drives' set-points reach them at it."""
        self.latched: Sequence[int] = [0] * n
        """Targets in force since the latest SYNC."""
        self.sent: Sequence[int] = [0] * n
        """Targets of the latest RPDOs: latched at the next SYNC."""
        self.commanded = False
        self.lateness = 0.0
        self.rows = self.recorded = self.missed = self.late = self.incomplete = 0
        """Of the recorded part."""
        self.incomplete_before = 0
        """SYNCs between the first RPDOs and the record that some drive did not answer in time."""
        self.delays = Delays()
        """Of the recorded part."""
        self._answered_at = self._worked_from = 0.0
        """When the latest answers were complete or given up: s on the clock, and of the processor."""
        self._interrupted = 0.0
        """s between them and the next wait in which this thread had no processor."""
        self._answers_were_late = False
        self._newest: _Row | None = None
        """Recorded since the latest SYNC."""
        self._held: deque[_Row | None] = deque()
        """Of the SYNCs before, the oldest first; None where nothing was recorded."""
        self._guard = SetPointGuard(job)
        self.bit_four = {axis for axis, link in enumerate(job.links) if link.interpolated}
        """Axes whose controlword has bit 4 under torque: they interpolate, or search their home."""
        self._period, self._late = job.cycle_time, job.budgets.held_cycles
        self._receive_seconds, self._patience = receive_seconds(job), job.budgets.receive_seconds
        self._heartbeat_every = job.budgets.watch_seconds / HEARTBEATS_PER_WATCH
        self._next_heartbeat = 0.0

    def turn(self) -> None:
        """Wait, SYNC, TPDOs, checks."""
        pace, period = self.pace, self._period
        self._answers_were_late = self._answered_at > pace.deadline + period
        self._interrupted = self.clock() - self._answered_at - (self._processor() - self._worked_from)
        self.lateness = pace.wait()
        self.exchange.sync()
        self.latched_before, self.latched = self.latched, self.sent
        now = self.clock()
        if now >= self._next_heartbeat:
            self.exchange.send_heartbeat()
            self._next_heartbeat = now + self._heartbeat_every
        self.publish()
        # A drive that is lost is not waited for.
        until = max(
            pace.deadline + self._receive_seconds,
            now + LEAST_RECEIVE_SHARE * period,
            now if self.watch.any_lost else now + self._patience,
        )
        whole = self.exchange.receive(until)
        self._answered_at, self._worked_from = self.clock(), self._processor()
        self.incomplete_before += self.commanded and not (whole or self.rows)
        self.watch.check(self.latched_before, self.goals)

    def command(self, targets: Sequence[int], blindly: bool = False) -> None:
        """Send controlwords towards the goals, and the targets in counts.

        Args:
            targets: counts, one per axis.
            blindly: switch drives off in one step, whatever they say.
        """
        goals = self.goals
        words = self.exchange.statusword
        controlwords = list(map(next_controlword, words, goals))
        for axis in self.bit_four:
            if controlwords[axis] == Command.ENABLE_OPERATION and has_torque(words[axis]):
                controlwords[axis] |= MODE_BIT
        for axis, goal in enumerate(goals if _DOWN in goals else ()):
            # A drive that does not say where it is, or says it wrongly, cannot be led down step by step.
            if goal is _DOWN and (blindly or self.watch.uncontrolled(axis)):
                controlwords[axis] = Command.DISABLE_VOLTAGE
        if self.watch.enabled:
            targets = self._guarded(targets)
        self.exchange.send(controlwords, targets)
        self.sent = targets
        self.commanded = True

    def _guarded(self, targets: Sequence[int]) -> Sequence[int]:
        allowed, reason = self._guard.admit(targets, self.sent, self._has_torque)
        if reason is not None:
            self.watch.abort(reason)
        return allowed

    def _has_torque(self, axis: int) -> bool:
        return has_torque(self.exchange.statusword[axis])

    def hold(self) -> list[int]:
        """The last target for an axis under torque, the actual position for one without."""
        seen = zip(self.exchange.statusword, self.sent, self.exchange.position, strict=True)
        return [target if has_torque(word) else position for word, target, position in seen]

    def turns(self, seconds: float) -> int:
        """How many cycles a time takes, at least one."""
        return max(1, round(seconds / self.job.cycle_time))

    # Record -----------------------------------------------------------------------------------

    def record(self) -> None:
        """Keep the latest cycle as a row."""
        seen = self.exchange
        self._newest = [
            self.rows,
            self.lateness,
            *self.latched,
            *seen.position,
            *seen.control_signal,
            *seen.velocity,
            *seen.statusword,
            *seen.complete,
        ]
        self.rows += 1
        if self.pace.missed_now:
            self.missed += self.pace.missed_now
            self.delays.note(
                self.pace.missed_now, self.pace.overrun, self._answers_were_late, self._interrupted
            )
        self.late += self.pace.late_now

    def publish(self) -> None:
        """Hand out the oldest rows that are held, once it is known what else was said in their time.

        A drive that answers twice between two SYNCs has no sample there; and where the second answer was not
        one that was missed before, the answers before may have been the wrong ones, too, and these the right
        ones, late. So each row waits for as many SYNCs as an answer may be late. It also waits for the next
        heartbeat of each drive: one that has left operational sends no TPDOs (CiA 301, 7.3.2.2.4), and what
        still comes in its name is something else's.
        """
        held, late, exchange = self._held, self._late, self.exchange
        held.append(self._newest)
        self._newest = None
        answers = exchange.answers
        if answers.doubtful:
            _doubt(held[-1], answers.doubled)
            for row in islice(reversed(held), late + 1):
                _doubt(row, answers.swapped)
        # The rows of SYNCs before this one may go; a place without a row always may.
        end = exchange.confirmed_until - answers.syncs + len(held)
        for place in range(min(ROWS_PER_SYNC, len(held) - late)):
            if place >= end and held[0] is not None:
                return
            self._hand_out(held.popleft())

    @property
    def _oldest(self) -> int:
        """Number of the SYNC of the oldest row that is held."""
        return self.exchange.answers.syncs - len(self._held)

    def _unconfirmed(self, sync: int) -> list[bool]:
        """Drives that have heartbeats, and had none since the answers to a SYNC; empty where all had."""
        seen = self.exchange
        if seen.confirmed_until > sync:
            return []
        return [axis in seen.beating and last <= sync for axis, last in enumerate(seen.operational_at)]

    @property
    def unconfirmed(self) -> list[bool]:
        """Per drive, whether rows wait for a heartbeat of it; empty where none does."""
        wait = [k for k, row in enumerate(self._held) if row is not None]
        return self._unconfirmed(self._oldest + wait[-1]) if wait else []

    def hand_out_all(self) -> None:
        """The stream is over: what no heartbeat has confirmed is not believed."""
        while self._held:
            row = self._held[0]
            if row is not None and (doubted := self._unconfirmed(self._oldest)):
                _doubt(row, doubted)
            self._hand_out(self._held.popleft())

    def _hand_out(self, row: _Row | None) -> None:
        if row is None:
            return
        self.incomplete += False in row[-len(self.sent) :]
        if not self.ring.write(*row):
            self.watch.abort("the samples were not fetched in time: the ring is full")
            return
        self.recorded += 1


def _doubt(row: _Row | None, doubted: Sequence[bool]) -> None:
    if row is not None:
        n = len(doubted)
        row[-n:] = [complete and not d for complete, d in zip(row[-n:], doubted, strict=True)]
