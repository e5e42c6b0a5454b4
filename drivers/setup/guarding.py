"""The drives' watch over the master: heartbeat consumer, RPDO deadline, abort option; set, and proved.

A drive that goes on by itself when its master is gone is the worst fault of all. So the watch is not only
written and read back: before anything is enabled, the master's heartbeat is started and stopped, and each
drive has to say that it missed it (EMCY 8130h). Torque is off all the while.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

from drivers.cia402 import objects
from drivers.cia402.emcy import describe_emcy
from drivers.cia402.states import Command, State, state_of
from drivers.errors import DriveError
from drivers.frames.layout import heartbeat_cob_id
from drivers.setup.findings import Finding
from drivers.setup.sdo import SdoAccess, SdoNetwork, aborted

HEARTBEAT_LOST = 0x8130
HEARTBEAT_MILLISECONDS = 100
_SUPPOSED_STATE = 5
_BEATS = 3
_BEAT_SECONDS = 0.02
_PATIENCE = 2.0
"""s beyond the consumer time; generous, because a simulated drive may have to wait for a processor."""
_FAULT, _DISABLE_VOLTAGE, _QUICK_STOP = 1, 2, 3


def consumer_word(master: int, seconds: float) -> int:
    """1016h:01 for a master's node id and a time (s)."""
    return master << 16 | max(1, round(seconds * 1000))


def set_abort_option(sdo: SdoAccess) -> list[Finding]:
    """6007h: a lost connection is a fault. Where the drive knows none, it does what it does.

    Raises:
        DriveError: the drive has the object but takes none of the options that stop it.
    """
    if sdo.read_optional(objects.ABORT_OPTION, signed=True) is None:
        return [Finding("info", "6007", "absent: how the drive reacts to a lost master is its own affair")]
    for option in (_FAULT, _QUICK_STOP, _DISABLE_VOLTAGE):
        try:
            sdo.ensure(objects.ABORT_OPTION, 0, option, 2)
        except DriveError:
            continue
        if option == _FAULT:
            return []
        return [Finding("info", "6007", f"the drive takes no fault as abort option, it has {option} now")]
    raise DriveError(f"{sdo.drive}: 6007 takes no option that stops the drive when its master is lost")


def set_deadline(sdo: SdoAccess, seconds: float) -> bool:
    """1400h:05, where present: RPDOs that stay away for this time are a fault. Whether it is set."""
    if sdo.read_optional(objects.RPDO_COMMUNICATION, 5) is None:
        return False
    try:
        sdo.write_checked(objects.RPDO_COMMUNICATION, 5, max(1, round(seconds * 1000)), 2)
    except DriveError:
        return False
    return True


def set_heartbeat(sdo: SdoAccess, findings: list[Finding]) -> float:
    """1017h: s between the drive's heartbeats, its own where it cannot be written; 0 where it has none."""
    own = sdo.read_optional(objects.HEARTBEAT_PRODUCER)
    if own is not None:
        try:
            sdo.write_checked(objects.HEARTBEAT_PRODUCER, 0, HEARTBEAT_MILLISECONDS, 2)
        except DriveError as error:
            if aborted(error) is None:
                raise
            if own:
                text = f"cannot be written: its own {own} ms between heartbeats are used"
                findings.append(Finding("info", "1017", text))
                return own / 1000
        else:
            return HEARTBEAT_MILLISECONDS / 1000
    text = "heartbeat producer absent: only missing TPDOs show a dead drive"
    findings.append(Finding("warning", "1017", text))
    return 0.0


def no_consumer(sdo: SdoAccess, master: int, seconds: float) -> str | None:
    """Why the drive cannot watch the master's heartbeat; None where it can. It watches nobody after this.

    Args:
        sdo: the drive.
        master: node id in the heartbeat.
        seconds: consumer time.
    """
    if sdo.read_optional(objects.HEARTBEAT_CONSUMER, 1) is None:
        return "absent"
    try:
        sdo.write_checked(objects.HEARTBEAT_CONSUMER, 1, consumer_word(master, seconds), 4)
        sdo.write(objects.HEARTBEAT_CONSUMER, 1, 0, 4)
    except DriveError as error:
        if aborted(error) is None:
            raise
        return str(error).removeprefix(f"{sdo.drive}: ")
    return None


def watch_findings(unwatched: str | None, deadline: bool) -> list[Finding]:
    """How the drive notices a lost master; one that cannot is refused.

    Args:
        unwatched: why it cannot watch the master's heartbeat.
        deadline: whether it has an RPDO deadline.
    """
    if unwatched is None:
        return []
    if deadline:
        text = f"{unwatched}: the drive notices a lost master by its RPDO deadline only"
        return [Finding("warning", "1016", text)]
    text = (
        f"no heartbeat consumer ({unwatched}) and no RPDO deadline (1400:05): the drive would go on without "
        "a master; it needs a firmware with one of them (node guarding, 100C, is not spoken here)"
    )
    return [Finding("refusal", "1016", text)]


def arm(drives: Sequence[SdoAccess], master: int, seconds: float) -> None:
    """Set the consumers; each begins to watch with the first heartbeat that it hears (CiA 301, 7.2.8.2.2.3).

    Raises:
        DriveError: a drive refuses it.
    """
    for sdo in drives:
        sdo.write_checked(objects.HEARTBEAT_CONSUMER, 1, consumer_word(master, seconds), 4)


def disarm(drives: Sequence[SdoAccess]) -> None:
    """Let the consumers watch nobody."""
    for sdo in drives:
        sdo.write(objects.HEARTBEAT_CONSUMER, 1, 0, 4)


def prove(network: SdoNetwork, drives: Sequence[SdoAccess], master: int, seconds: float) -> frozenset[int]:
    """Start and stop the master's heartbeat; every drive has to notice.

    A fault that comes of it is reset again where it is this one and the drive had none before.

    Args:
        network: of the drives, in NMT pre-operational, torque off.
        drives: those that have a consumer.
        master: node id in the heartbeat.
        seconds: consumer time.

    Returns:
        Node ids of the drives that noticed; those in fault could not show it.

    Raises:
        DriveError: names the drives that did not notice.
    """
    # A drive in fault says no more. It must be acknowledged first, and is proved with the next set-up.
    waiting = {
        int(sdo.node.id or 0): sdo
        for sdo in drives
        if state_of(sdo.read_int(objects.STATUSWORD)) is not State.FAULT
    }
    watching = list(waiting.values())
    for sdo in watching:
        sdo.node.emcy.reset()
    # A drive in fault is left alone: a lost heartbeat would take the place of what stopped it (603F).
    arm(watching, master, seconds)
    for _ in range(_BEATS):
        network.network.send_message(heartbeat_cob_id(master), bytes([_SUPPOSED_STATE]))
        time.sleep(_BEAT_SECONDS)
    deadline = time.monotonic() + seconds + _PATIENCE
    silent = dict(waiting)
    while silent and time.monotonic() < deadline:
        time.sleep(0.01)
        silent = {node: sdo for node, sdo in silent.items() if not _noticed(sdo)}
    disarm(watching)
    if silent:
        names = ", ".join(sdo.drive for sdo in silent.values())
        raise DriveError(
            f"{names}: 1016 is set, but a heartbeat of the master that stopped for {seconds:g} s was not "
            "noticed (no EMCY 0x8130): the drive would go on without its master"
        )
    for sdo in waiting.values():
        _reset(sdo)
    return frozenset(waiting)


def _noticed(sdo: SdoAccess) -> bool:
    return any(error.code == HEARTBEAT_LOST for error in sdo.node.emcy.log)


def _reset(sdo: SdoAccess) -> None:
    """Take back the fault that the proof itself has made; no other one."""
    if state_of(sdo.read_int(objects.STATUSWORD)) not in (State.FAULT, State.FAULT_REACTION):
        return
    if sdo.read_optional(objects.ERROR_CODE) in (None, HEARTBEAT_LOST):
        acknowledge_fault(sdo)


def acknowledge_fault(sdo: SdoAccess, timeout: float = 1.0) -> None:
    """Reset a drive's fault by a rising edge of controlword bit 7.

    Raises:
        DriveError: the fault stays.
    """
    sdo.write(objects.CONTROLWORD, 0, 0x00, 2)
    sdo.write(objects.CONTROLWORD, 0, Command.FAULT_RESET, 2)
    deadline = time.monotonic() + timeout
    while state_of(sdo.read_int(objects.STATUSWORD)) in (State.FAULT, State.FAULT_REACTION):
        if time.monotonic() > deadline:
            raise DriveError(f"{sdo.drive}: the fault stays after a fault reset{_why(sdo)}")
        time.sleep(0.02)
    sdo.write(objects.CONTROLWORD, 0, 0x00, 2)


def _why(sdo: SdoAccess) -> str:
    code = sdo.read_optional(objects.ERROR_CODE)
    return f"; {describe_emcy(code)}" if code else ""
