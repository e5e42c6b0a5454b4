"""What an EDS or DCF says of a device: its identity and its objects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from drivers.setup.findings import Finding

_SIGNED = frozenset({2, 3, 4, 0x10, 0x15})
_REAL = frozenset({8, 0x11})
_BITS = {
    1: 1,
    2: 8,
    3: 16,
    4: 32,
    5: 8,
    6: 16,
    7: 32,
    8: 32,
    0x10: 24,
    0x11: 64,
    0x15: 64,
    0x16: 24,
    0x1B: 64,
}
"""Length by data type; others are strings and domains."""


@dataclass(frozen=True)
class ObjectEntry:
    """One sub-object as the file has it.

    Attributes:
        index, subindex, name: which.
        data_type: number of CiA 301, table 44; None where the file does not say.
        access: ``ro``, ``rw``, ``wo``, ``const``, ``rwr`` or ``rww``.
        default: value after a reset; None where there is none, or it is no number.
        value: of a DCF; None in an EDS.
        mappable: whether a PDO may carry it.
        low, high: least and largest value; None where the file sets none.
    """

    index: int
    subindex: int
    name: str
    data_type: int | None
    access: str
    default: int | None
    value: int | None
    mappable: bool
    low: int | None = None
    high: int | None = None

    @property
    def whole(self) -> bool:
        """Whether it is an integer; a number with a point is none, nor a string."""
        return self.bits is not None and self.data_type not in _REAL

    @property
    def bits(self) -> int | None:
        """Length of a number; None for anything else."""
        return _BITS.get(self.data_type or 0)

    def as_value(self, number: int | None) -> int | None:
        """A number of the file with the sign that the data type gives it: 0xFF of an INTEGER8 is −1."""
        if number is None or self.bits is None or self.data_type not in _SIGNED:
            return number
        return number - (1 << self.bits) if number >= 1 << (self.bits - 1) else number


@dataclass(frozen=True)
class DeviceFile:
    """An EDS or DCF.

    Attributes:
        path: the file.
        vendor, product, revision: of its DeviceInfo; None where it does not say.
        node_id: of a DCF's commissioning.
        objects: by index and subindex.
        findings: what is wrong with the file, and what the master would miss.
    """

    path: Path
    vendor: int | None
    product: int | None
    revision: int | None
    node_id: int | None
    objects: Mapping[tuple[int, int], ObjectEntry]
    findings: tuple[Finding, ...]

    def has(self, index: int, subindex: int = 0) -> bool:
        """Whether the file has such a sub-object."""
        return (index, subindex) in self.objects

    def transmitted_cob_ids(self) -> dict[int, str]:
        """COB-IDs that a drive with these values sends on after the set-up, and the objects that say so.

        The set-up gives each PDO the COB-ID of its node where that can be written.
        """
        sent = {}
        for index in (*range(0x1800, 0x1804), 0x1014):
            entry = self.objects.get((index, 0 if index == 0x1014 else 1))
            if entry is None or (index != 0x1014 and entry.access not in ("ro", "const")):
                continue
            word = entry.value if entry.value is not None else entry.default
            if word is not None and not word >> 31:
                sent[word & 0x7FF] = f"{index:04X}"
        return sent
