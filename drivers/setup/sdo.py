"""SDO access by index, independent of any EDS; every failure names the drive, the object and the reason."""

from __future__ import annotations

from functools import partial

import canopen
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from drivers.bus.access import open_bus
from drivers.errors import BusError, DriveError
from drivers.frames.channel import Channel
from drivers.frames.layout import emcy_cob_id, heartbeat_cob_id, sdo_answer_cob_id

RESPONSE_TIMEOUT = 1.0
"""s; generous, because set-up is not urgent and the machine may be busy."""

BOOT_UP = 0
"""What a heartbeat carries as NMT state once, after a start (CiA 301, 7.2.8.3.3)."""

_ABSENT = (
    0x0602_0000,
    0x0609_0011,
    0x0800_0000,
    0x0601_0000,
    0x0601_0001,
    0x0604_0043,
    0x060A_0023,
    0x0800_0024,
)
"""Abort codes of a read: object or subindex does not exist; and with what else drives say so. The last two
are for an object that has no value: the library canopen, as a drive, answers so."""
_WIDTHS = {
    (0x1000, 0): 4,
    (0x1001, 0): 1,
    (0x1005, 0): 4,
    (0x1006, 0): 4,
    (0x1014, 0): 4,
    (0x1017, 0): 2,
    (0x6007, 0): 2,
    (0x603F, 0): 2,
    (0x6040, 0): 2,
    (0x6041, 0): 2,
    **{(index, 0): 2 for index in range(0x605A, 0x605F)},
    (0x6060, 0): 1,
    (0x6061, 0): 1,
    (0x6066, 0): 2,
    **{(index, 0): 2 for index in range(0x6071, 0x6075)},
    (0x6077, 0): 2,
    (0x6078, 0): 2,
    (0x607E, 0): 1,
    (0x6098, 0): 1,
    (0x60C0, 0): 2,
    (0x60C2, 1): 1,
    (0x60C2, 2): 1,
}
"""Bytes of objects of the standards that are narrower than an expedited answer (CiA 301, CiA 402-2)."""

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
    0x060A_0023: "the object has no value",
    0x0800_0020: "the value cannot be stored",
    0x0800_0022: "not possible in the present device state",
    0x0800_0024: "the object has no value",
}


def abort_words(code: int) -> str:
    """What an abort of a drive means."""
    return f"the drive refuses: {_ABORTS.get(code, 'aborted')} (SDO abort 0x{code:08X})"


def aborted(error: DriveError) -> int | None:
    """The abort code of a drive that refused; None where something else went wrong."""
    cause = error.__cause__
    return cause.code if isinstance(cause, SdoAbortedError) else None


_RECORDS = (0x1003, 0x1010, 0x1011, 0x1016, 0x1018, 0x1029, 0x607D, 0x608F, 0x6091, 0x6092, 0x6099, 0x60C1)
"""Arrays and records: subindex 0 is their number of entries."""


class SdoAccess:
    """The object dictionary of one drive.

    Args:
        node: the node on a connected canopen network.
        drive: how messages name it.
    """

    def __init__(self, node: canopen.RemoteNode, drive: str) -> None:
        self.node = node
        self.drive = drive
        self.widths: dict[tuple[int, int], int] = dict(_WIDTHS)
        """Bytes of objects, for answers that do not say how many they carry."""
        self.written: dict[tuple[int, int], bytes] = {}
        """What each object was told last, by index and subindex."""
        node.sdo.RESPONSE_TIMEOUT = RESPONSE_TIMEOUT

    def read(self, index: int, subindex: int = 0) -> bytes:
        """The bytes of an object.

        Raises:
            DriveError: no answer, or the drive aborts the transfer.
        """
        try:
            with self.node.sdo.open(index, subindex, buffering=0) as answer:
                sized, data = answer.size is not None, bytes(answer.read())
        except (SdoAbortedError, SdoCommunicationError) as error:
            raise self._failed("reading", index, subindex, error) from error
        # An expedited answer need not say how many of its four bytes count (CiA 301, 7.2.4.3.6).
        return data if sized else data[: self.width(index, subindex, len(data))]

    def width(self, index: int, subindex: int, most: int) -> int:
        """Bytes of an object; of PDO parameters and arrays by their subindex."""
        if subindex == 0 and (0x1400 <= index < 0x1C00 or index in _RECORDS):
            return 1
        if 0x1400 <= index < 0x1600 or 0x1800 <= index < 0x1A00:
            return {1: 4, 2: 1, 3: 2, 5: 2, 6: 1}.get(subindex, most)
        return self.widths.get((index, subindex), most)

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

    def ensure(self, index: int, subindex: int, value: int, size: int) -> None:
        """Like :meth:`write_checked`, but a drive that refuses the write and holds the value already suits.

        Raises:
            DriveError: the drive holds another value; says which one.
        """
        try:
            self.write_checked(index, subindex, value, size)
        except DriveError as error:
            if aborted(error) is None:
                raise
            held = self.read_optional(index, subindex, signed=value < 0)
            if held == value:
                return
            if held is None:
                raise
            raise DriveError(f"{error}; it holds {held}, {value} is needed: set it in the drive") from (
                error.__cause__
            )

    def _failed(
        self, doing: str, index: int, subindex: int, error: SdoAbortedError | SdoCommunicationError
    ) -> DriveError:
        if isinstance(error, SdoAbortedError):
            reason = abort_words(error.code)
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
