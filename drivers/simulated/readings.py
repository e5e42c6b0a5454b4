"""What one drive reads of its axis, as its objects tell it: position, velocity, following error."""

from __future__ import annotations

from drivers.simulated.device import PositionScale
from drivers.simulated.object_dictionary import ObjectDictionary
from robots.description import Drive

_LOWEST, _HIGHEST = -(2**31), 2**31 - 1


class Encoder:
    """The encoder of one drive; it outlives a reset, and forgets nothing but what the supply takes.

    Args:
        described: the drive.
        increments_per_unit: of the drive output, rad or m.
        scale: from increments to the units of the objects.
    """

    def __init__(self, described: Drive, increments_per_unit: float, scale: PositionScale) -> None:
        self.velocity_units = {(0x606C, 0): 1.0}
        """Objects that tell the velocity, with the drive's velocity units in one unit of each."""
        self._scale = scale
        if described.velocity is not None:
            key = described.velocity.index, described.velocity.subindex
            self.velocity_units[key] = described.velocity.counts_per_second
        self._counts_per_unit = increments_per_unit
        self._zero = None if described.position_reference == "homing" else 0
        self._position = 0
        self._speed = 0.0

    @property
    def zero(self) -> int:
        """Encoder counts at which the drive reads 0; where it forgets them, it wakes up at 0."""
        return self._zero or 0

    @property
    def output_speed(self) -> float:
        """Magnitude at the drive output, rad/s or m/s, as of the latest SYNC period."""
        return abs(self._speed) / self._counts_per_unit

    def read(self, position: int, home: int | None, period: float) -> None:
        """A new reading.

        Args:
            position: encoder counts.
            home: encoder counts at which the drive reads 0 from now on; None where no home was found.
            period: s since the reading before.
        """
        if home is not None or self._zero is None:
            self._zero = position if home is None else home
        self._speed = (position - self._position) / period
        self._position = position

    def tell(self, dictionary: ObjectDictionary, set_point: int) -> int:
        """Bring the objects up to date.

        Args:
            dictionary: of the drive.
            set_point: encoder counts.

        Returns:
            Following error, position units.
        """
        zero, units = self.zero, self._scale.units
        wanted, reached = units(set_point - zero), units(self._position - zero)
        dictionary.set(0x6062, 0, _int32(wanted))
        dictionary.set(0x6064, 0, _int32(reached))
        velocity = self._scale.velocity(self._speed)
        for key, unit in self.velocity_units.items():
            dictionary.set(*key, _int32(velocity / unit))
        error = units(set_point - self._position)
        dictionary.set(0x60F4, 0, _int32(error))
        return error


def _int32(value: float) -> int:
    """As far as the object reaches."""
    return round(max(_LOWEST, min(value, _HIGHEST)))


class FollowingErrorWatch:
    """The window of 6065h and the time of 6066h.

    Args:
        dictionary: has both.
    """

    def __init__(self, dictionary: ObjectDictionary) -> None:
        self._dictionary = dictionary
        self._seconds = 0.0
        self.exceeded = False
        """Bit 13 of the statusword, in modes that follow set-points."""

    def restart(self) -> None:
        """The axis is enabled."""
        self.exceeded, self._seconds = False, 0.0

    def judge(self, error: int, follows: bool, period: float) -> bool:
        """Whether the drive must stop now.

        Args:
            error: position units.
            follows: whether the axis is led along set-points.
            period: s since the look before.
        """
        window = self._dictionary.integer(0x6065)
        if not follows or window == 0xFFFFFFFF or abs(error) <= window:
            self._seconds = 0.0
            return False
        self._seconds += period
        if self._seconds * 1000.0 <= self._dictionary.integer(0x6066):
            return False
        self.exceeded = True
        return True
