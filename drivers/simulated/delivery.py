"""What a simulated drive holds after a reset: as delivered, or as it was stored (1010h, 1011h)."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from drivers.simulated.device import Device
from drivers.simulated.object_dictionary import (
    DEVICE_STATE,
    NOT_STORED,
    VALUE_RANGE,
    Entry,
    Key,
    ObjectDictionary,
    SdoAbort,
)
from drivers.simulated.parameters import control_signal_bits, set_parameters
from robots import Robot

_STORE, _RESTORE, _HISTORY = 0x1010, 0x1011, 0x1003
_SAVE, _LOAD = int.from_bytes(b"save", "little"), int.from_bytes(b"load", "little")
_NEVER_STORED = frozenset({_STORE, _RESTORE, _HISTORY, 0x6040, 0x607A, 0x60C1})
"""Commands, targets and the history of errors."""


class Delivery:
    """The non-volatile memory of one drive.

    Args:
        robot: the arm's description.
        axis: index of the drive from 0.
        serial: serial number, object 1018:04.
        device: what the drive is built of.
        velocity_units: objects that tell a velocity.
    """

    def __init__(
        self, robot: Robot, axis: int, serial: int, device: Device, velocity_units: Iterable[Key]
    ) -> None:
        self.changed_values: dict[Key, int] = {}
        """Objects that this device has otherwise than the EDS says."""
        self._robot, self._axis, self._serial, self._device = robot, axis, serial, device
        self._velocity_units = tuple(velocity_units)
        self._stored: dict[Key, int | bytes] = {}

    def dictionary(self) -> ObjectDictionary:
        """A dictionary as it is after a reset."""
        drive = self._robot.drive[self._axis]
        dictionary = ObjectDictionary(drive.node_id)
        signal = drive.control_signal.index, drive.control_signal.subindex
        if not dictionary.has(*signal):
            width = "h" if control_signal_bits(self._robot, self._axis) == 16 else "i"
            dictionary.add(Entry(*signal, width, "ro", 0, None, None, mappable=True))
        for key in self._velocity_units:
            if not dictionary.has(*key):
                dictionary.add(Entry(*key, "i", "ro", 0, None, None, mappable=True))
        set_parameters(dictionary, self._robot, self._axis, self._serial, self._device)
        self._device.quirks.apply(dictionary, drive.node_id)
        for key, value in self.changed_values.items():
            dictionary.set(*key, value)
        dictionary.values.update(self._stored)
        return dictionary

    def reset_communication(self, dictionary: ObjectDictionary) -> None:
        """Give a live dictionary's communication objects their values after a reset, but for the errors."""
        fresh = self.dictionary()
        for area in (range(0x1000, 0x1001), range(0x1004, 0x2000)):
            dictionary.take(fresh, area)

    def attach(self, dictionary: ObjectDictionary, has_torque: Callable[[], bool]) -> None:
        """Let a live dictionary store and restore: "save" into 1010:01, "load" into 1011:01.

        Restored defaults hold after the next reset (CiA 301, 7.5.2.13 and 7.5.2.14).
        """

        def guard(signature: int) -> Callable[[int, int | bytes], None]:
            def judge(subindex: int, value: int | bytes) -> None:
                if value != signature:
                    raise SdoAbort(NOT_STORED)
                if has_torque():
                    raise SdoAbort(DEVICE_STATE)

            return judge

        def store(subindex: int, value: int | bytes) -> None:
            dictionary.set(_STORE, subindex, 1)
            self._stored = {
                key: held
                for key, held in dictionary.values.items()
                if key[0] not in _NEVER_STORED and dictionary.has(*key) and dictionary.entry(*key).writable
            }

        def restore(subindex: int, value: int | bytes) -> None:
            dictionary.set(_RESTORE, subindex, 1)
            self._stored.clear()

        def clear_history(subindex: int, value: int | bytes) -> None:
            if value != 0:
                raise SdoAbort(VALUE_RANGE)

        dictionary.guards[_STORE], dictionary.guards[_RESTORE] = guard(_SAVE), guard(_LOAD)
        dictionary.listeners[_STORE], dictionary.listeners[_RESTORE] = store, restore
        dictionary.guards[_HISTORY] = clear_history
