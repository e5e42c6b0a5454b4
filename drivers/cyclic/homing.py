"""The search for a drive's home, seen from the master: start, watch, end it (CiA 402-2, homing mode)."""

from __future__ import annotations

from drivers.cia402.states import HOMING_ATTAINED, HOMING_ERROR, TARGET_REACHED
from drivers.cyclic.cycle import Cycle
from drivers.frames.job import HomingJob

_BEFORE_IT_SHOWS = 4
"""SYNCs until a statusword can tell of the search that was started, and not of an earlier one."""


def home(cycle: Cycle, job: HomingJob) -> None:
    """Have one drive search its home while the others hold; ends with a reason where it does not find it.

    The drive moves the axis by itself. The master watches what it can see from outside: answers,
    heartbeats, states, torque, the way that the axis goes, and the time that it takes.

    Args:
        cycle: enabled, at rest.
        job: which drive, and the bounds of the search.
    """
    axis, watch = job.axis, cycle.watch
    drive = cycle.job.drives[axis]
    start = cycle.exchange.position[axis]
    cycle.bit_four.add(axis)
    for turn in range(cycle.turns(job.seconds)):
        cycle.command(cycle.hold())
        cycle.turn()
        if not watch.fine:
            break
        word = cycle.exchange.statusword[axis]
        if turn >= _BEFORE_IT_SHOWS:
            if word & HOMING_ERROR:
                watch.fault(axis, f"{drive} reports a homing error (statusword 0x{word:04X}, bit 13)")
                break
            if word & HOMING_ATTAINED and word & TARGET_REACHED:
                break
        way = abs(cycle.exchange.position[axis] - start)
        if not word & HOMING_ATTAINED and way > job.travel:
            watch.abort(f"{drive} moved {way} counts without finding its home; allowed: {job.travel}")
            break
    else:
        watch.abort(f"{drive} has not found its home in {job.seconds:g} s")
    cycle.bit_four.discard(axis)
