"""The search for a drive's home, seen from the master: start, watch, end it (CiA 402-2, homing mode)."""

from __future__ import annotations

from drivers.cia402.states import HOMING_ATTAINED, HOMING_ERROR, TARGET_REACHED
from drivers.cyclic.cycle import Cycle
from drivers.frames.job import HomingJob

_BEFORE_IT_SHOWS = 4
"""SYNCs until a statusword can tell of the search that was started, and not of an earlier one."""
_SPEED_MARGIN = 1.1
"""Speed ripple and overshoot of a drive's own profile."""


def home(cycle: Cycle, job: HomingJob) -> bool:
    """Have one drive search its home while the others hold; ends with a reason where it does not find it.

    The drive moves the axis by itself. The master watches what it can see from outside: answers,
    heartbeats, states, torque, the way that the axis goes, how fast, the time that it takes, and what the
    drive reads where it has found its home.

    Args:
        cycle: enabled, at rest.
        job: which drive, and the bounds of the search.

    Returns:
        Whether the drive keeps to what it was told; else its own ramp down is not to be relied on either.
    """
    axis, watch, astray = job.axis, cycle.watch, False
    drive = cycle.job.drives[axis]
    start, began, way = cycle.exchange.position[axis], cycle.clock(), 0
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
                _arrive(cycle, job)
                break
        if word & HOMING_ATTAINED:
            continue  # its position has jumped
        way = abs(cycle.exchange.position[axis] - start)
        if (reason := _astray(job, way, cycle.clock() - began)) is not None:
            watch.abort(f"{drive} {reason}")
            astray = True
            break
    else:
        watch.abort(f"{drive} has not found its home in {job.seconds:g} s; it has moved {way} counts")
    cycle.bit_four.discard(axis)
    return not astray


def _astray(job: HomingJob, way: int, seconds: float) -> str | None:
    """Why a search that has gone so many counts in this time is ended, or None."""
    if way > job.travel:
        return f"moved {way} counts without finding its home; allowed: {job.travel}"
    if way > _SPEED_MARGIN * job.speed * seconds + job.near:
        return (
            f"moved {way} counts in {seconds:.2g} s of its search; it was told {job.speed:.0f} counts per "
            "second: its unit of 6099 may be another (60A9, 6096)"
        )
    return None


def _arrive(cycle: Cycle, job: HomingJob) -> None:
    """Wait until the drive reads what it was told to read at its home."""
    if job.home is None:
        return
    for _ in range(cycle.turns(cycle.job.budgets.standstill_seconds)):
        if abs(cycle.exchange.position[job.axis] - job.home) <= job.near or not cycle.watch.fine:
            return
        cycle.command(cycle.hold())
        cycle.turn()
    cycle.watch.abort(
        f"{cycle.job.drives[job.axis]} says that it has found its home but reads "
        f"{cycle.exchange.position[job.axis]} counts there; homing.position is {job.home} (607C), allowed: "
        f"{job.near} apart"
    )
