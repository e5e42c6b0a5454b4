"""SDO access by index, independent of any EDS; every failure names the drive, the object and the reason."""

from __future__ import annotations

from functools import partial

import canopen
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from drivers.bus.access import open_bus
from drivers.bus.channel import Channel
from drivers.cyclic.layout import emcy_cob_id, heartbeat_cob_id, sdo_answer_cob_id
from drivers.errors import BusError, DriveError

RESPONSE_TIMEOUT = 1.0
"""s; generous, because set-up is not urgent and the machine may be busy."""

BOOT_UP = 0
"""What a heartbeat carries as NMT state once, after a start (CiA 301, 7.2.8.3.3)."""

_ABSENT = (0x0602_0000, 0x0609_0011)
"""Abort codes: object does not exist, subindex does not exist."""

_ABORTS = {
    0x0504_0001: "unknown SDO command",
    0x0601_0000: "access not supported",
    0x0601_0001: "the object cannot be read",
    0x0601_0002: "the object cannot be written",
    0x0602_0000: "the object does not exist",
    0x0604_0041: "the object cannot be mapped",
    0x0604_0042: "the mapping is longer than the PDO",
    0x0604_0043: "parameter incompatible",
    0x0607_0010: "wrong length",
    0x0609_0011: "the subindex does not exist",
    0x0609_0030: "value not allowed",
    0x0609_0031: "value too high",
    0x0609_0032: "value too low",
    0x0800_0020: "the value cannot be stored",
    0x0800_0022: "not possible in the present device state",
}


class SdoAccess:
    """The object dictionary of one drive.

    Args:
        node: the node on a connected canopen network.
        drive: how messages name it.
    """

    def __init__(self, node: canopen.RemoteNode, drive: str) -> None:
        self.node = node
        self.drive = drive
        self.written: dict[tuple[int, int], bytes] = {}
        """What each object was told last, by index and subindex."""
        node.sdo.RESPONSE_TIMEOUT = RESPONSE_TIMEOUT

    def read(self, index: int, subindex: int = 0) -> bytes:
        """The bytes of an object.

        Raises:
            DriveError: no answer, or the drive aborts the transfer.
        """
        try:
            return bytes(self.node.sdo.upload(index, subindex))
        except (SdoAbortedError, SdoCommunicationError) as error:
            raise self._failed("reading", index, subindex, error) from error

    def read_int(self, index: int, subindex: int = 0, *, signed: bool = False) -> int:
        """An integer object of whatever width the drive gives it."""
        return int.from_bytes(self.read(index, subindex), "little", signed=signed)

    def read_optional(self, index: int, subindex: int = 0, *, signed: bool = False) -> int | None:
        """Like read_int, but None where the drive does not have the object."""
        try:
            return self.read_int(index, subindex, signed=signed)
        except DriveError as error:
            if isinstance(error.__cause__, SdoAbortedError) and error.__cause__.code in _ABSENT:
                return None
            raise

    def write(self, index: int, subindex: int, value: int, size: int) -> None:
        """Write an integer of ``size`` bytes.

        Raises:
            DriveError: no answer, or the drive refuses the value.
        """
        data = value.to_bytes(size, "little", signed=value < 0)
        try:
            self.node.sdo.download(index, subindex, data)
        except (SdoAbortedError, SdoCommunicationError) as error:
            raise self._failed(f"writing 0x{value:X} to", index, subindex, error) from error
        self.written[index, subindex] = data

    def write_checked(self, index: int, subindex: int, value: int, size: int) -> None:
        """Write an integer and read it back.

        Raises:
            DriveError: the drive refuses it, or holds another value afterwards.
        """
        self.write(index, subindex, value, size)
        found = self.read_int(index, subindex, signed=value < 0)
        if found != value:
            raise DriveError(
                f"{self.drive}: {index:04X}:{subindex:02X} was set to 0x{value:X} "
                f"but reads back as 0x{found:X}"
            )

    def _failed(
        self, doing: str, index: int, subindex: int, error: SdoAbortedError | SdoCommunicationError
    ) -> DriveError:
        if isinstance(error, SdoAbortedError):
            words = _ABORTS.get(error.code, "aborted")
            reason = f"the drive refuses: {words} (SDO abort 0x{error.code:08X})"
        else:
            reason = f"no answer within {RESPONSE_TIMEOUT:g} s"
        return DriveError(f"{self.drive}: {doing} {index:04X}:{subindex:02X}: {reason}")


class SdoNetwork:
    """A canopen network on one of our buses, with one SDO client per drive.

    Args:
        channel: which bus.
        nodes: node ids.
        names: how messages name the drives.

    Raises:
        BusError: the bus cannot be opened.
    """

    def __init__(
        self, channel: Channel, nodes: tuple[int, ...], names: tuple[str, ...], bitrate: int
    ) -> None:
        answers = [f(node) for node in nodes for f in (sdo_answer_cob_id, emcy_cob_id, heartbeat_cob_id)]
        self.network = canopen.Network(open_bus(channel, answers, bitrate))
        # How long the receiving thread waits at a time: closing waits for it.
        self.network.NOTIFIER_CYCLE = 0.02
        self.network.connect()
        dictionary = canopen.ObjectDictionary()
        self.booted: set[int] = set()
        """Node ids of the drives whose boot-up message was heard: they have lost their configuration."""
        self.drives = tuple(
            SdoAccess(self.network.add_node(canopen.RemoteNode(node, dictionary)), name)
            for node, name in zip(nodes, names, strict=True)
        )
        for node, drive in zip(nodes, self.drives, strict=True):
            drive.node.nmt.add_heartbeat_callback(partial(self._note, node))

    def _note(self, node: int, state: int) -> None:
        if state == BOOT_UP:
            self.booted.add(node)

    def nmt(self, state: str) -> None:
        """Command each of the drives, and nobody else on the bus, into an NMT state."""
        for drive in self.drives:
            drive.node.nmt.state = state

    def close(self) -> None:
        """Close the bus and end the receiving thread."""
        try:
            self.network.disconnect()
        except RuntimeError as error:
            # canopen re-raises here what its receiving thread met, after the bus was closed.
            raise BusError(f"the bus failed during set-up: {error}") from error
