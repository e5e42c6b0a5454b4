"""A drive that exists as its EDS or DCF only: it answers the set-up as the file says a drive would."""

from __future__ import annotations

from canopen.sdo.exceptions import SdoAbortedError

from drivers.cia402 import objects
from drivers.errors import DriveError
from drivers.frames.layout import PDO_BITS
from drivers.setup.device_file import DeviceFile, ObjectEntry
from drivers.setup.findings import Finding
from drivers.setup.sdo import SdoAccess, abort_words

_NO_OBJECT, _NO_SUBINDEX = 0x0602_0000, 0x0609_0011
_READ_ONLY, _WRITE_ONLY = 0x0601_0002, 0x0601_0001
_TOO_HIGH, _TOO_LOW = 0x0609_0031, 0x0609_0032
_NOT_MAPPABLE, _TOO_LONG, _WRONG_LENGTH = 0x0604_0041, 0x0604_0042, 0x0607_0010
_SWITCH_ON_DISABLED = 0x0040
_COMMUNICATION = range(0x1000, 0x2000)
_RECEIVED, _SENT = range(0x1600, 0x1800), range(0x1A00, 0x1C00)


class FileDrive(SdoAccess):
    """The objects of a device file with their access rights, widths and mapping rules.

    Where a file gives no value, an object of the communication profile is 0, and one of the device profile is
    taken for not told.

    Args:
        file: the EDS or DCF.
        drive: how messages name it.
    """

    def __init__(self, file: DeviceFile, drive: str) -> None:
        # No bus and no node: everything that would use them is answered here.
        self.drive = drive
        self.widths: dict[tuple[int, int], int] = {}
        self.written: dict[tuple[int, int], bytes] = {}
        self._file = file
        self._indices = {index for index, _ in file.objects}
        self._values = {
            key: entry.value if entry.value is not None else entry.default
            for key, entry in file.objects.items()
        }
        self._values[objects.STATUSWORD, 0] = _SWITCH_ON_DISABLED

    def read(self, index: int, subindex: int = 0) -> bytes:
        """The bytes that the drive would answer with.

        Raises:
            DriveError: it would abort.
        """
        entry = self._entry("reading", index, subindex)
        if entry.access == "wo":
            raise self._aborted("reading", index, subindex, _WRITE_ONLY)
        value = self._values[index, subindex] or 0
        return value.to_bytes(8, "little", signed=value < 0)[: max(1, (entry.bits or 32) // 8)]

    def tells(self, index: int, subindex: int = 0) -> bool:
        """Whether the file gives the object a value."""
        return self._values.get((index, subindex)) is not None

    def read_optional(self, index: int, subindex: int = 0, *, signed: bool = False) -> int | None:
        """As of a drive; also None for an object of the device profile that the file gives no value."""
        known = index in _COMMUNICATION or self.tells(index, subindex) or index in _SET_HERE
        return super().read_optional(index, subindex, signed=signed) if known else None

    def write(self, index: int, subindex: int, value: int, size: int) -> None:
        """As a drive would take it.

        Raises:
            DriveError: it would abort.
        """
        doing = f"writing 0x{value:X} to"
        entry = self._entry(doing, index, subindex)
        if entry.access in ("ro", "const"):
            raise self._aborted(doing, index, subindex, _READ_ONLY)
        if entry.bits is not None and entry.bits != 8 * size:
            raise self._aborted(doing, index, subindex, _WRONG_LENGTH)
        if not consumer_limit(index, entry):
            if entry.high is not None and value > entry.high:
                raise self._aborted(doing, index, subindex, _TOO_HIGH)
            if entry.low is not None and value < entry.low:
                raise self._aborted(doing, index, subindex, _TOO_LOW)
        if index in _RECEIVED or index in _SENT:
            self._check_mapping(doing, index, subindex, value)
        self._values[index, subindex] = value
        self.written[index, subindex] = value.to_bytes(size, "little", signed=value < 0)
        if index == objects.MODE:
            self._values[objects.MODE_DISPLAY, 0] = value

    def _check_mapping(self, doing: str, index: int, subindex: int, value: int) -> None:
        if subindex == 0:
            words = [self._values.get((index, k + 1)) or 0 for k in range(value)]
            if any((index, k + 1) not in self._file.objects for k in range(value)):
                raise self._aborted(doing, index, subindex, _TOO_LONG)
            if sum(word & 0xFF for word in words) > PDO_BITS:
                raise self._aborted(doing, index, subindex, _TOO_LONG)
            return
        mapped = self._file.objects.get((value >> 16, value >> 8 & 0xFF))
        if mapped is None:
            raise self._aborted(doing, index, subindex, _NO_OBJECT)
        if not mapped.mappable or (mapped.bits or 0) != value & 0xFF:
            raise self._aborted(doing, index, subindex, _NOT_MAPPABLE)

    def _entry(self, doing: str, index: int, subindex: int) -> ObjectEntry:
        entry = self._file.objects.get((index, subindex))
        if entry is None:
            code = _NO_SUBINDEX if index in self._indices else _NO_OBJECT
            raise self._aborted(doing, index, subindex, code)
        return entry

    def _aborted(self, doing: str, index: int, subindex: int, code: int) -> DriveError:
        error = DriveError(f"{self.drive}: {doing} {index:04X}:{subindex:02X}: {abort_words(code)}")
        error.__cause__ = SdoAbortedError(code)
        return error


def consumer_limit(index: int, entry: ObjectEntry) -> bool:
    """Whether an entry of 1016h has a limit below the node id, which stands in its bits 16 to 22.

    Such a file contradicts CiA 301, 7.5.2.14, and says nothing of the drive.
    """
    return index == objects.HEARTBEAT_CONSUMER and entry.high is not None and 0 <= entry.high < 1 << 16


def consumer_limit_findings(file: DeviceFile) -> list[Finding]:
    """What to know of a file whose 1016h has no room for a node id."""
    entry = file.objects.get((objects.HEARTBEAT_CONSUMER, 1))
    if entry is None or not consumer_limit(objects.HEARTBEAT_CONSUMER, entry):
        return []
    text = (
        f"the file's HighLimit {entry.high} has no room for a node id (bits 16 to 22): a mistake of the "
        "file, or the drive cannot watch its master; the opening tells which"
    )
    return [Finding("warning", "1016", text)]


_SET_HERE = frozenset({objects.INTERPOLATION_SUBMODE, objects.INTERPOLATION_PERIOD, objects.ABORT_OPTION})
"""Objects of the device profile that the set-up writes: being there is enough."""
