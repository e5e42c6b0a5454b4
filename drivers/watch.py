"""The checks of every cycle, and the first reason to end a stream."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from drivers.cia402.emcy import describe_emcy
from drivers.cia402.states import FOLLOWING_ERROR_BIT, Goal, State, refusal, state_of
from drivers.exchange import OPERATIONAL, Exchange
from drivers.job import Job
from drivers.pacemaker import Pacemaker
from drivers.ring import Ring
from drivers.samples import Outcome


class Watch:
    """Judges each cycle after its TPDOs; the first reason to stop is kept, later ones do not replace it.

    Args:
        job: with windows and budgets.
        exchange: latest words of the drives.
        pace: deadlines.
        ring: carries the parent's request to stop.
        parent_alive, terminated: asked once per cycle.
    """

    def __init__(
        self,
        job: Job,
        exchange: Exchange,
        pace: Pacemaker,
        ring: Ring,
        parent_alive: Callable[[], bool],
        terminated: Callable[[], bool],
    ) -> None:
        self.enabled = False
        """Whether every axis is meant to be in operation enabled."""
        self._job = job
        self._exchange = exchange
        self._pace = pace
        self._ring = ring
        self._parent_alive = parent_alive
        self._terminated = terminated
        self._window = [int(counts) for counts in job.following_error]
        self._unanswered = [0] * len(job.nodes)
        self._answered = [False] * len(job.nodes)
        self._verdict: tuple[Outcome, str, int | None] | None = None

    @property
    def fine(self) -> bool:
        """Whether there is no reason yet to end."""
        return self._verdict is None

    def abort(self, reason: str) -> None:
        """End for a reason that the master found."""
        self._verdict = self._verdict or ("aborted", reason, None)

    def fault(self, axis: int, reason: str) -> None:
        """End for a reason that the drive of an axis gave."""
        self._verdict = self._verdict or ("fault", reason, axis)

    def stop(self, reason: str) -> None:
        """End because somebody asked for it."""
        self._verdict = self._verdict or ("stopped", reason, None)

    def verdict(self) -> tuple[Outcome, str]:
        """How the stream ended and why, with the emergencies of the drive that is to blame."""
        if self._verdict is None:
            return "completed", "the whole reference was streamed"
        outcome, reason, axis = self._verdict
        codes = dict.fromkeys(self._exchange.emergencies[axis]) if axis is not None else {}
        return outcome, "; ".join([reason, *(describe_emcy(code) for code in codes)])

    def check(self, set_points: Sequence[int], goals: list[Goal]) -> None:
        """Judge the cycle whose TPDOs have come.

        Args:
            set_points: counts that the drives' set-points have reached at this SYNC.
            goals: per axis; an axis that has left operation enabled is not led back up.
        """
        for axis in range(len(goals)):
            self._check_answer(axis)
            self._check_state(axis, goals)
            if self.enabled and self._exchange.complete[axis]:
                self._check_following(axis, set_points[axis])
        self._check_surroundings()

    def lost(self, axis: int) -> bool:
        """Whether a drive has left more SYNCs unanswered than it may: what it said last is out of date."""
        return self._unanswered[axis] > self._job.budgets.incomplete_in_a_row

    def _check_answer(self, axis: int) -> None:
        if self._exchange.complete[axis]:
            self._unanswered[axis] = 0
            self._answered[axis] = True
            return
        self._unanswered[axis] += 1
        # Before the first answer a drive has a longer time, which the loop itself watches.
        if self._answered[axis] and self.lost(axis):
            self.abort(f"no TPDO from {self._job.drives[axis]} in {self._unanswered[axis]} SYNCs")

    def _check_state(self, axis: int, goals: list[Goal]) -> None:
        seen, drive = self._exchange, self._job.drives[axis]
        if (nmt := seen.nmt_state[axis]) is not None and nmt != OPERATIONAL:
            self.fault(axis, f"{drive} left NMT operational (its heartbeat says {nmt})")
        if not seen.complete[axis]:
            return
        word = seen.statusword[axis]
        state = state_of(word)
        if self.enabled and state is not State.OPERATION_ENABLED:
            goals[axis] = Goal.SWITCH_ON_DISABLED
            self.fault(axis, f"{drive} left operation enabled: it is in state {state.value!r}")
        elif goals[axis] > Goal.SWITCH_ON_DISABLED and (reason := refusal(word)) is not None:
            self.fault(axis, f"{drive} cannot be enabled: {reason}")
        elif self.enabled and word & FOLLOWING_ERROR_BIT:
            self.fault(axis, f"{drive} reports a following error (statusword 0x{word:04X})")

    def _check_following(self, axis: int, set_point: int) -> None:
        error = abs(set_point - self._exchange.position[axis])
        if error > self._window[axis]:
            self.abort(
                f"following error of {self._job.drives[axis]} is {error} counts; "
                f"allowed: {self._window[axis]}"
            )

    def _check_surroundings(self) -> None:
        if self._ring.stop_requested:
            self.stop("stop requested")
        if self._terminated():
            self.stop("the cyclic process was told to end (SIGTERM)")
        if not self._parent_alive():
            self.abort("the process that started the stream died")
        if self._exchange.bus_off:
            self.abort("the CAN controller went off the bus (bus-off)")
        if self.enabled and self._pace.missed_now > self._job.budgets.missed_in_a_row:
            self.abort(f"the cyclic process stood still for {self._pace.missed_now} SYNC periods")
