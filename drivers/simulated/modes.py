"""Modes of operation of one simulated drive: which ones it takes, and when it shows them (6060h, 6061h)."""

from __future__ import annotations

from collections.abc import Callable

from drivers.simulated.object_dictionary import DEVICE_STATE, VALUE_RANGE, ObjectDictionary, SdoAbort
from drivers.simulated.quirks import Quirks


class Modes:
    """6060h and 6061h.

    Args:
        dictionary: has both, and 6502h.
        has_torque: whether the mode is fixed now.
        quirks: what this kind of drive does otherwise.
    """

    def __init__(self, dictionary: ObjectDictionary, has_torque: Callable[[], bool], quirks: Quirks) -> None:
        self._dictionary, self._has_torque = dictionary, has_torque
        self._shown_late = quirks.mode_shown_late
        if quirks.period_fixed_when_enabled:
            dictionary.guards[0x60C2] = self._guard_period
        dictionary.guards[0x6060] = self._guard
        dictionary.listeners[0x6060] = lambda subindex, value: self._show(dictionary.integer(0x6060))

    def follow(self) -> None:
        """The power state may have changed."""
        if self._shown_late:
            self._show(self._dictionary.integer(0x6060))

    def _show(self, mode: int) -> None:
        hidden = self._shown_late and not self._has_torque()
        self._dictionary.set(0x6061, 0, 0 if hidden else mode)

    def _guard_period(self, subindex: int, value: int | bytes) -> None:
        if self._has_torque():
            raise SdoAbort(DEVICE_STATE)

    def _guard(self, subindex: int, value: int | bytes) -> None:
        assert isinstance(value, int)
        supported = self._dictionary.integer(0x6502)
        if value != 0 and not (value > 0 and supported >> (value - 1) & 1):
            raise SdoAbort(VALUE_RANGE)
        if self._has_torque():
            raise SdoAbort(DEVICE_STATE)
