"""An EMCY frame as a value, in words (CiA 301, 7.2.7)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from drivers.cia402.emcy import describe_emcy

REGISTER_BITS = ("generic", "current", "voltage", "temperature", "communication", "profile", "", "vendor")
"""Object 1001h, bit by bit."""


@dataclass(frozen=True)
class EmergencyMessage:
    """What a drive said: error code (603Fh), error register (1001h) and five bytes of the maker's own."""

    code: int
    register: int = 0
    vendor: bytes = b""

    @classmethod
    def decode(cls, data: bytes) -> Self | None:
        """From a frame's payload; None where it is too short for a code. Shorter ones than 8 bytes occur."""
        if len(data) < 2:
            return None
        return cls(int.from_bytes(data[:2], "little"), data[2] if len(data) > 2 else 0, bytes(data[3:8]))

    @property
    def is_reset(self) -> bool:
        """Whether it says that errors are gone."""
        return self.code >> 8 == 0

    def __str__(self) -> str:
        words = [describe_emcy(self.code)]
        bits = [name for bit, name in enumerate(REGISTER_BITS) if name and self.register >> bit & 1]
        # The generic bit is set with every error and says nothing beside another.
        if specific := [name for name in bits if name != "generic"]:
            words.append("error register: " + ", ".join(specific))
        if any(self.vendor):
            words.append("vendor bytes " + self.vendor.hex(" "))
        return ", ".join(words)
