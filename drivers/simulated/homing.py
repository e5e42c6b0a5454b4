"""Homing by the drive itself, with the methods that need no switch (CiA 402-2, homing mode).

Positions are counts of the encoder itself, which knows nothing of where the drive's zero is.
"""

from __future__ import annotations

from drivers.simulated.device import PositionScale
from drivers.simulated.object_dictionary import ObjectDictionary
from drivers.simulated.quirks import STANDARD, Quirks

HOMING_MODE = 6
INDEX_BELOW, INDEX_ABOVE = 33, 34
HERE = (35, 37)
"""Home is where the axis stands; 35 is the older number of 37."""


class Homing:
    """One drive's search for its home.

    Args:
        dictionary: has method (6098h), speeds (6099h), acceleration (609Ah) and home offset (607Ch).
        index_every: counts between two index pulses of the encoder: one motor revolution.
        scale: from increments of the encoder to the units of the objects.
        quirks: what this kind of drive does otherwise.
    """

    def __init__(
        self,
        dictionary: ObjectDictionary,
        index_every: int,
        scale: PositionScale,
        quirks: Quirks = STANDARD,
    ) -> None:
        self._dictionary, self._scale, self._quirks = dictionary, scale, quirks
        self._index_every = index_every
        self.active = False
        """Whether the drive moves the axis, or brings it to rest, by itself."""
        self.attained = False
        """Bit 12 of the statusword."""
        self.failed = False
        """Bit 13: the method is none of this drive's, or it has no speed to move at."""
        self._started = self._searching = False
        self._direction = 0
        self._place = self._speed = 0.0
        self._before: int | None = None

    def forget(self) -> None:
        """The axis is disabled, or the mode is another: a search does not go on by itself."""
        self.active = self._started = self._searching = False

    def command(self, start: bool, set_point: int) -> None:
        """Bit 4 of the controlword: a rising edge starts, and without it the search is given up.

        Args:
            start: the bit.
            set_point: where the axis is held, counts.
        """
        rising = start and not self._started
        self._started = start
        if rising:
            self._begin(set_point)
        elif not start:
            self.active = self._searching = False

    def _begin(self, set_point: int) -> None:
        method = self._dictionary.integer(0x6098)
        self.attained = False
        self._direction = {INDEX_BELOW: -1, INDEX_ABOVE: 1}.get(method, 0)
        moves = self._direction != 0
        can_move = self._dictionary.integer(0x6099, 2) > 0 and self._dictionary.integer(0x609A) > 0
        self.failed = not (can_move if moves else method in HERE)
        self.active = self._searching = not self.failed
        if self._quirks.homed_untruly:
            self.attained, self.active, self._searching = True, False, False
        self._place, self._speed, self._before = float(set_point), 0.0, None

    def watch(self, position: int) -> int | None:
        """A new reading, in counts; where the drive's zero lies, once that is found."""
        if not self._searching:
            return None
        before, self._before = self._before, position
        home = self._home(before, position)
        if home is None:
            return None
        self._searching, self.attained = False, True
        self.active = self._direction != 0
        offset = self._scale.increments(self._dictionary.integer(0x607C))
        return home + offset if self._quirks.negated_home else home - offset

    def _home(self, before: int | None, position: int) -> int | None:
        if self._direction == 0:
            return position
        if before is None:
            return None
        turn = self._index_every
        if self._direction > 0:
            index = (before // turn + 1) * turn
            return index if position >= index else None
        index = (before - 1) // turn * turn
        return index if position <= index else None

    def target(self, period: float) -> int:
        """Set-point for the coming SYNC period (s), counts: up to the search's speed, then down to rest."""
        told = self._dictionary.integer(0x609A) * self._quirks.homing_speed_factor
        change = self._scale.speed(told) * period
        if self._searching:
            told = self._dictionary.integer(0x6099, 2) * self._quirks.homing_speed_factor
            fastest = self._scale.speed(told)
            self._speed = min(self._speed + change, fastest)
        else:
            self._speed = max(self._speed - change, 0.0)
            self.active = self._speed > 0.0
        self._place += self._direction * self._speed * period
        return round(self._place)
