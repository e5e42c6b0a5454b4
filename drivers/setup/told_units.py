"""What a drive's objects say of its units: the factor group of CiA 402-2 and the SI units of CiA 303-2.

position [user units] = encoder increments × 6092 / (608F × 6091), with 608F in increments per motor turn,
6091 in motor turns per shaft turn and 6092 in user units per shaft turn. 60A8 and 60A9 name a unit instead.
Older drives have 6093 in place of all three: encoder increments per user unit (DSP 402, version 2).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi

Settings = Mapping[str, int | None]
"""Values read from a drive, by ``index`` or ``index:subindex`` in hexadecimal; None where it has none."""

INCREMENTS = 0xB5
METRE = 0x01
_PER_TURN = {0x10: 2 * pi, 0x40: 400.0, 0x41: 360.0, 0x42: 21_600.0, 0x43: 1_296_000.0, 0xB4: 1.0}
"""How many of a unit of angle make one turn: rad, gon, degree, minute and second of arc, turn (CiA 303-2)."""
_SECONDS = {0x03: 1.0, 0x47: 60.0, 0x48: 3600.0}
"""Units of time: second, minute, hour."""


@dataclass(frozen=True)
class Told:
    """One thing that a drive says of its position unit.

    Attributes:
        subject: the object that says it.
        counts: position units per turn (or metre) of the drive output.
        by: the objects and their values, for messages.
    """

    subject: str
    counts: float
    by: str
    feed: float = 0.0
    """6092, where that is the subject."""


@dataclass(frozen=True)
class FactorGroup:
    """The factor group of a drive; None for what it does not have, or has as it was delivered (608F 1/1)."""

    resolution: float | None
    """Encoder increments per motor turn (608F)."""
    gear_ratio: float | None
    """Motor turns per shaft turn (6091)."""
    feed: float | None
    """Position units per shaft turn (6092)."""
    factor: float | None
    """Encoder increments per position unit (6093); 1/1 says no more than none."""
    unit: int | None
    """60A8."""
    unconfigured: bool
    """Whether 608F stands at 1/1."""
    words: Mapping[str, str]
    """The values as the drive has them, for messages."""

    @classmethod
    def read(cls, settings: Settings) -> FactorGroup:
        """From what was read of the drive."""
        resolution = _ratio(settings, "608F")
        unit = settings.get("60A8") or None
        feed = _ratio(settings, "6092")
        unconfigured = resolution == 1.0
        if feed == 1.0 and (unconfigured or unit is not None):
            feed = None  # 1/1 as delivered
        factor = _ratio(settings, "6093")
        if factor == 1.0:
            factor = None
        words = {
            index: f"{index} {settings[f'{index}:01']}/{settings.get(f'{index}:02') or 1}"
            for index in ("608F", "6091", "6092", "6093")
            if settings.get(f"{index}:01")
        }
        if unit is not None:
            words["60A8"] = f"60A8 0x{unit:08X}"
        return cls(
            resolution=None if unconfigured else resolution,
            gear_ratio=_ratio(settings, "6091"),
            feed=feed,
            factor=factor,
            unit=unit,
            unconfigured=unconfigured,
            words=words,
        )

    def told(self, encoder_counts: float | None, gear: float, *, revolute: bool) -> list[Told]:
        """Every independent statement about the position unit; empty where the drive makes none.

        Args:
            encoder_counts: increments per motor turn where 608F does not say; None where nobody does.
            gear: motor turns per turn (or metre) of the output.
            revolute: whether the output turns.
        """
        shaft_turns = gear / (self.gear_ratio or 1.0)
        resolution = self.resolution or encoder_counts
        found = []
        if self.feed is not None:
            by = self._by("608F", "6091", "6092")
            found.append(Told("6092", self.feed * shaft_turns, by, self.feed))
        if self.factor is not None and resolution is not None:
            found.append(Told("6093", resolution * gear / self.factor, self._by("6093", "608F")))
        if self.unit is not None:
            counts = self._by_unit(resolution, gear, shaft_turns, revolute)
            if counts is not None:
                found.append(Told("60A8", counts, self._by("60A8", "608F", "6091")))
        if not found and self.resolution is not None and not self.unknown_unit(revolute=revolute):
            found.append(Told("608F", self.resolution * gear, self._by("608F", "6091")))
        return found

    def unknown_unit(self, *, revolute: bool) -> bool:
        """Whether 60A8 names a unit that says nothing of an output: steps, poles, inches …"""
        code = INCREMENTS if self.unit is None else self.unit >> 16 & 0xFF
        return code != INCREMENTS and code not in _PER_TURN and (revolute or code != METRE)

    def _by_unit(
        self, resolution: float | None, gear: float, shaft_turns: float, revolute: bool
    ) -> float | None:
        assert self.unit is not None
        power, code = _prefix(self.unit), self.unit >> 16 & 0xFF
        if code == INCREMENTS:
            return None if resolution is None else resolution * gear / power
        if code in _PER_TURN:
            return _PER_TURN[code] * shaft_turns / power
        if code == METRE and not revolute:
            return 1.0 / power
        return None

    def _by(self, *indices: str) -> str:
        return ", ".join(self.words[index] for index in indices if index in self.words)


def velocity_unit(settings: Settings, output_counts: float, gear: float) -> float | None:
    """Position units per second in one unit of the drive's velocity objects; None where it does not say.

    Args:
        settings: read from the drive.
        output_counts: position units per turn (or metre) of the drive output.
        gear: motor turns per turn (or metre) of the output.
    """
    unit = settings.get("60A9") or None
    if unit is not None:
        group = FactorGroup.read(settings)
        per_shaft_turn = output_counts * (group.gear_ratio or 1.0) / gear
        seconds = _SECONDS.get(unit >> 8 & 0xFF)
        code = unit >> 16 & 0xFF
        if seconds is None:
            return None
        if code == INCREMENTS and group.resolution is not None:
            return _prefix(unit) * output_counts / (group.resolution * gear) / seconds
        if code in _PER_TURN:
            return _prefix(unit) * per_shaft_turn / _PER_TURN[code] / seconds
        return None
    factor = _ratio(settings, "6096")
    return None if factor is None else 1.0 / factor


def _prefix(unit: int) -> float:
    """The power of ten in the highest byte, signed (CiA 303-2)."""
    exponent = unit >> 24 & 0xFF
    return float(10.0 ** (exponent - 256 if exponent > 127 else exponent))


def _ratio(settings: Settings, index: str) -> float | None:
    """Of the two entries of an object; None where it is absent or 0. A missing denominator is 1."""
    upper, lower = settings.get(f"{index}:01"), settings.get(f"{index}:02")
    return upper / (lower or 1) if upper else None
