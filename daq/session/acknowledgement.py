"""``armhil acknowledge``: what stands against the next motion, until somebody has looked."""

from __future__ import annotations

from collections.abc import Callable

from daq.session.session_error import NotMoved
from drivers import ArmSession, Channel
from drivers.cia402 import State
from robots import Robot


def acknowledge(robot: Robot, channel: Channel, looked: Callable[[tuple[str, ...]], bool]) -> bool:
    """Show what stands, ask, then reset the drives' faults and the note of a stream that ended by itself.

    Args:
        robot: the arm.
        channel: where its drives are.
        looked: gets what stands, a line each; whether somebody has looked.

    Returns:
        Whether anything stood.

    Raises:
        BusError, DriveError: the bus is occupied, a drive refuses, or a fault stays.
        NotMoved: nobody has looked.
    """
    with ArmSession(robot, channel) as session:
        if not (standing := _standing(session)):
            return False
        if not looked(standing):
            raise NotMoved("not acknowledged: nothing moves until somebody has looked")
        session.acknowledge_faults()
    return True


def _standing(session: ArmSession) -> tuple[str, ...]:
    reason = session.unacknowledged
    standing = [] if reason is None else [f"the last motion did not end well: {reason}"]
    for report in session.drives:
        if report.state in (State.FAULT, State.FAULT_REACTION):
            told = [note for note in report.notes if note.startswith("603F")]
            drive = f"drive of {report.joint} (node {report.node_id}) is in state {report.state.value!r}"
            standing.append("; ".join([drive, *told]))
    return tuple(standing)
