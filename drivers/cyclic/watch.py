"""The checks of every cycle, and the first reason to end a stream."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from drivers.cia402.states import (
    FOLLOWING_ERROR_BIT,
    FOLLOWS_BIT,
    INTERNAL_LIMIT_BIT,
    Goal,
    State,
    refusal,
    state_of,
)
from drivers.cyclic.exchange import OPERATIONAL, Exchange
from drivers.cyclic.motion_checks import MotionChecks
from drivers.cyclic.pacemaker import Pacemaker
from drivers.frames.job import Job
from drivers.frames.ring import Request, Ring
from drivers.frames.samples import Outcome

_STATE_BITS = 0x6F
_ENABLED_BITS = 0x27
_FOLLOWING_MASK = _STATE_BITS | FOLLOWS_BIT | FOLLOWING_ERROR_BIT | INTERNAL_LIMIT_BIT
_FOLLOWING = _ENABLED_BITS | FOLLOWS_BIT
"""A statusword of an axis that does what it should: nothing else has to be looked at."""
_PATIENCE = 3
"""SYNCs in which a statusword bit may contradict before it is believed."""


class Watch:
    """Judges each cycle after its TPDOs; the first reason to stop is kept, later ones do not replace it.

    Args:
        job: with windows and budgets.
        exchange: latest words of the drives.
        pace: deadlines.
        ring: carries the parent's requests.
        parent_alive, terminated: asked once per cycle.
        clock: s.
    """

    def __init__(
        self,
        job: Job,
        exchange: Exchange,
        pace: Pacemaker,
        ring: Ring,
        parent_alive: Callable[[], bool],
        terminated: Callable[[], bool],
        clock: Callable[[], float],
    ) -> None:
        self.enabled = False
        """Whether every axis is meant to be in operation enabled."""
        self.any_lost = False
        """Whether any drive is lost."""
        self.request: Request | None = None
        """The most urgent request of the parent, as of the latest check."""
        self._job = job
        self._exchange = exchange
        self._pace = pace
        self._ring = ring
        self._parent_alive = parent_alive
        self._terminated = terminated
        self._clock = clock
        n = len(job.links)
        self._motion = MotionChecks(job)
        self._unanswered = [0] * n
        self._answered = [False] * n
        self._homing = job.homing.axis if job.homing is not None else None
        """Whose statusword bits 12 and 13 speak of its home, and which follows no set-points."""
        self._follows = [link.interpolated for link in job.links]
        self._astray = [0] * n
        self._warned = [0] * n
        self._limited = [0] * n
        budgets = job.budgets
        self._heartbeat_patience = [
            budgets.heartbeat_periods * link.heartbeat + budgets.stall_seconds for link in job.links
        ]
        self._verdict: tuple[Outcome, str, int | None] | None = None
        self.fine = True
        """Whether there is no reason yet to end."""
        self._all_following = [_FOLLOWING] * n
        self._usual = False
        """Whether the cycle before found nothing to look at more closely."""
        self._signs, self._alive_until = -1, -math.inf
        """Until when no drive's heartbeat is too old, s on the clock; found anew with each sign of life."""

    @property
    def halting(self) -> bool:
        """Whether the drives are to stop by themselves, on request."""
        return self.request is Request.HALT

    def abort(self, reason: str) -> None:
        """End for a reason that the master found."""
        self._end("aborted", reason, None)

    def fault(self, axis: int, reason: str) -> None:
        """End for a reason that the drive of an axis gave."""
        self._end("fault", reason, axis)

    def stop(self, reason: str) -> None:
        """End because somebody asked for it."""
        self._end("stopped", reason, None)

    def _end(self, outcome: Outcome, reason: str, axis: int | None) -> None:
        self._verdict, self.fine = self._verdict or (outcome, reason, axis), False

    def verdict(self) -> tuple[Outcome, str]:
        """How the stream ended and why, with the emergencies of the drive that is to blame."""
        if self._verdict is None:
            return "completed", "the whole reference was streamed"
        outcome, reason, axis = self._verdict
        told = (
            dict.fromkeys(str(message) for message in self._exchange.emergencies[axis])
            if axis is not None
            else {}
        )
        return outcome, "; ".join([reason, *told])

    def notes(self) -> tuple[str, ...]:
        """What ended nothing and has to be known of the record."""
        pairs = zip(self._job.drives, self._limited, strict=True)
        return tuple(
            f"a limit inside {drive} acted in {count} SYNCs (statusword bit 11);"
            " there it did not do what it was told"
            for drive, count in pairs
            if count
        )

    def check(self, set_points: Sequence[int], goals: list[Goal]) -> None:
        """Judge the cycle whose TPDOs have come.

        Args:
            set_points: counts that the drives' set-points have reached at this SYNC.
            goals: per axis; an axis that has left operation enabled is not led back up.
        """
        seen = self._exchange
        now = self._clock()
        self.any_lost = False
        if self._signs != seen.signs:
            self._signs, self._alive_until = seen.signs, self._good_until()
        good = self.enabled and not seen.answers.missing and now <= self._alive_until
        if not (good and self._usual and self._all_follow()):
            self._usual = good and self._all_follow()
            for axis, word in enumerate(seen.statusword):
                if good and word & _FOLLOWING_MASK == _FOLLOWING:
                    self._unanswered[axis] = self._astray[axis] = 0
                    self._follows[axis] = True
                    continue
                self._check_answer(axis)
                self._check_life(axis, now)
                self._check_state(axis, goals)
        if self.enabled and (reason := self._motion.check(seen, set_points)) is not None:
            self.abort(reason)
            for axis in self._motion.blind:
                goals[axis] = Goal.SWITCH_ON_DISABLED
        self._check_surroundings()

    def _all_follow(self) -> bool:
        return [word & _FOLLOWING_MASK for word in self._exchange.statusword] == self._all_following

    def _good_until(self) -> float:
        """When the first heartbeat will be too old, s; in the past where one says something else, or an
        emergency has come."""
        seen = self._exchange
        states = set(seen.nmt_state) - {OPERATIONAL, None}
        if states or any(seen.emergencies) or any(seen.booted):
            return -math.inf
        return min(
            [seen.heard[axis] + self._heartbeat_patience[axis] for axis in seen.beating], default=math.inf
        )

    def lost(self, axis: int) -> bool:
        """Whether a drive has left more SYNCs unanswered than it may: what it said last is out of date."""
        return self._unanswered[axis] > self._job.budgets.incomplete_in_a_row

    def uncontrolled(self, axis: int) -> bool:
        """Whether an axis must lose its torque in one step: no ramp means anything to it any more."""
        return self.lost(axis) or axis in self._motion.blind

    def _check_answer(self, axis: int) -> None:
        if self._exchange.complete[axis]:
            self._unanswered[axis] = 0
            self._answered[axis] = True
            return
        self._unanswered[axis] += 1
        self.any_lost = self.any_lost or self.lost(axis)
        # Before the first answer a drive has a longer time, which the loop itself watches.
        if self._answered[axis] and self.lost(axis):
            self.abort(f"no TPDO from {self._job.drives[axis]} in {self._unanswered[axis]} SYNCs")

    def _check_life(self, axis: int, now: float) -> None:
        """Heartbeats: the NMT state in them, and that they come."""
        seen = self._exchange
        nmt = seen.nmt_state[axis]
        if nmt is None:
            return
        if seen.booted[axis]:
            self.fault(axis, f"{self._job.drives[axis]} has started anew (boot-up message)")
        elif nmt != OPERATIONAL:
            self.fault(axis, f"{self._job.drives[axis]} left NMT operational (its heartbeat says {nmt})")
        period = self._job.links[axis].heartbeat
        if period > 0 and (silence := now - seen.heard[axis]) > self._heartbeat_patience[axis]:
            self.abort(
                f"no heartbeat from {self._job.drives[axis]} in {silence:.2f} s; it has one each {period:g} s"
            )

    def _check_state(self, axis: int, goals: list[Goal]) -> None:
        seen = self._exchange
        if not seen.complete[axis]:
            return
        word = seen.statusword[axis]
        if not self.enabled:
            if goals[axis] > Goal.SWITCH_ON_DISABLED and (reason := refusal(word)) is not None:
                self.fault(axis, f"{self._job.drives[axis]} cannot be enabled: {reason}")
            return
        if word & _STATE_BITS != _ENABLED_BITS:
            state = state_of(word)
            if state is not State.OPERATION_ENABLED:
                goals[axis] = Goal.SWITCH_ON_DISABLED
                drive = self._job.drives[axis]
                self.fault(axis, f"{drive} left operation enabled: it is in state {state.value!r}")
        elif axis == self._homing:
            self._astray[axis] = 0
        elif word & FOLLOWING_ERROR_BIT:
            self.fault(axis, f"{self._job.drives[axis]} reports a following error (statusword 0x{word:04X})")
        else:
            self._check_obedience(axis, word)
        self._limited[axis] += bool(word & INTERNAL_LIMIT_BIT)
        if seen.emergencies[axis]:
            # Where the drive goes to fault with it, its state says more and comes with the same SYNC.
            self._warned[axis] += 1
            if self._warned[axis] > _PATIENCE:
                self.fault(axis, f"{self._job.drives[axis]} sent an emergency")

    def _check_obedience(self, axis: int, word: int) -> None:
        """Bit 12, where the drive has it: does it follow its set-points?"""
        if word & FOLLOWS_BIT:
            self._follows[axis], self._astray[axis] = True, 0
        elif self._follows[axis]:
            self._astray[axis] += 1
            if self._astray[axis] > _PATIENCE:
                drive = self._job.drives[axis]
                self.fault(axis, f"{drive} does not follow its set-points (statusword 0x{word:04X}, bit 12)")

    def _check_surroundings(self) -> None:
        self.request = request = self._ring.requested()
        if request is not None and request is Request.ABORT:
            self.stop("abort requested")
        elif request is not None and request is Request.HALT:
            self.stop("halt requested")
        if self._terminated():
            self.stop("the cyclic process was told to end (SIGTERM)")
        if not self._parent_alive():
            self.abort("the process that started the stream died")
        if self._exchange.bus_failure is not None:
            self.abort(self._exchange.bus_failure)
        if self.enabled and self._pace.missed_now > self._job.budgets.missed_in_a_row:
            self.abort(f"the cyclic process stood still for {self._pace.missed_now} SYNC periods")
