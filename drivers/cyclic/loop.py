"""The cyclic part of a stream: enable, approach, stream, come to rest, disable, say how the arm is left."""

from __future__ import annotations

import time
from collections.abc import Callable

import can

from drivers.bus.ports import frame_port
from drivers.cyclic.cycle import Cycle
from drivers.cyclic.exchange import OPERATIONAL
from drivers.cyclic.following import Follower
from drivers.cyclic.homing import home
from drivers.cyclic.power import disable, enable, first_answers, is_up, quick_stop, retire
from drivers.frames.job import HomingJob, Job
from drivers.frames.ring import Ring
from drivers.frames.samples import StreamResult


class Loop:
    """One stream on an open bus.

    Args:
        job: what to do.
        bus: opened for foreign.receive_cob_ids.
        ring: where rows go.
        parent_alive: asked once per cycle.
        terminated: asked once per cycle: was this process told to end?
        clock, sleep: time, s.
        processor: time of the processor that this thread has used, s.
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
        processor: Callable[[], float] = time.thread_time,
    ) -> None:
        self.cycle = Cycle(job, frame_port(bus), ring, parent_alive, terminated, clock, sleep, processor)
        self._follower = Follower(self.cycle)
        self._notes: list[str] = []

    def run(self) -> StreamResult:
        """Do the job; returns when the drives are disabled, however it went."""
        cycle = self.cycle
        self._follower.warm_up()
        cycle.pace.restart()
        if first_answers(cycle) and enable(cycle):
            if cycle.job.homing is None:
                self._move()
            else:
                self._home(cycle.job.homing)
        if cycle.watch.halting and cycle.commanded:
            quick_stop(cycle, record=False)
        disable(cycle)
        hear_all(cycle)
        torque, moving = how_it_is_left(cycle)
        for axis in retire(cycle):
            self._notes.append(f"{cycle.job.drives[axis]} did not confirm the end of its watch (1016)")
        return self._result(torque, moving)

    def _move(self) -> None:
        watch = self.cycle.watch
        self._follower.approach()
        recorded = watch.fine
        if recorded:
            recorded = self._follower.stream()
        if watch.fine:
            self._follower.arrive()
        if watch.halting:
            quick_stop(self.cycle, recorded)
        else:
            self._follower.come_to_rest()

    def _home(self, homing: HomingJob) -> None:
        keeps_to_it = home(self.cycle, homing)
        if self.cycle.watch.halting or not keeps_to_it:
            quick_stop(self.cycle, record=False)
        else:
            self._follower.come_to_rest()

    def _result(self, torque: tuple[str, ...], moving: tuple[str, ...]) -> StreamResult:
        cycle = self.cycle
        cycle.hand_out_all()
        outcome, reason = cycle.watch.verdict()
        reports = [f"{text} ({count} times)" for text, count in cycle.exchange.reports.items()]
        if cycle.exchange.send_failures:
            reports.append(f"{cycle.exchange.send_failures} frames could not be sent")
        return StreamResult(
            outcome=outcome,
            reason=reason,
            cycles=cycle.recorded,
            missed_cycles=cycle.missed,
            late_cycles=cycle.late,
            incomplete_cycles=cycle.incomplete,
            incomplete_before=cycle.incomplete_before,
            notes=(*self._notes, *cycle.watch.notes(), *reports, *filter(None, [cycle.delays.words()])),
            missed_for=cycle.delays.missed,
            overflows=cycle.exchange.overflows(),
            doubtful=cycle.exchange.answers.words(),
            pauses=tuple(self._follower.pauses),
            torque_unconfirmed=torque,
            rest_unconfirmed=moving,
            restarted=tuple(
                drive for drive, anew in zip(cycle.job.drives, cycle.exchange.booted, strict=True) if anew
            ),
        )


LOOK_SECONDS = 0.05
"""Over which a drive has to stand to be at rest."""
_SLOW_SHARE = 200
"""A drive that goes slower than the limit by this factor stands: encoders and soft gears twitch."""


def hear_all(cycle: Cycle) -> None:
    """SYNCs until each drive has shown by a heartbeat that the last recorded answers were its own."""
    job, seen = cycle.job, cycle.exchange
    seconds = job.budgets.heartbeat_periods * max((link.heartbeat for link in job.links), default=0.0)
    for _ in range(cycle.turns(seconds)):
        states = zip(cycle.unconfirmed, seen.nmt_state, strict=False)
        if not any(waited_for and state == OPERATIONAL for waited_for, state in states):
            return
        cycle.turn()


def how_it_is_left(cycle: Cycle) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Look at the drives for a moment, after they were switched off.

    A drive that does not answer is not known to be at rest or without torque, whatever it said before.

    Returns:
        Drives that have not confirmed that their torque is off, and drives that were not seen at rest.
    """
    seen, drives = cycle.exchange, cycle.job.drives
    turns = cycle.turns(LOOK_SECONDS)
    answered, before = [False] * len(drives), list(seen.position)
    for _ in range(turns):
        cycle.turn()
        for axis, complete in enumerate(seen.complete):
            if complete and not answered[axis]:
                answered[axis], before[axis] = True, seen.position[axis]
    torque, moving = [], []
    for axis, drive in enumerate(drives):
        heard = answered[axis] and not cycle.watch.lost(axis)
        if not heard or is_up(seen.statusword[axis]):
            torque.append(drive)
        way = turns * cycle.job.largest_step[axis] // _SLOW_SHARE
        if not heard or abs(seen.position[axis] - before[axis]) > max(way, 1):
            moving.append(drive)
    return tuple(torque), tuple(moving)
