"""How the arm is left: whether each drive has said that torque is off, and whether it stands."""

from __future__ import annotations

from drivers.cyclic.cycle import Cycle
from drivers.cyclic.exchange import OPERATIONAL
from drivers.cyclic.power import is_up

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
