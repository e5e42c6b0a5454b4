"""What the master asks of one axis, read from the objects it writes: mode, halt, target, homing."""

from __future__ import annotations

from drivers.simulated.device import Device, PositionScale
from drivers.simulated.homing import HOMING_MODE, Homing
from drivers.simulated.object_dictionary import ObjectDictionary
from drivers.simulated.set_points import AxisMode
from drivers.simulated.state_machine import StateMachine
from drivers.simulated.stop import stop_ramp

INTERPOLATED_POSITION, CYCLIC_SYNCHRONOUS_POSITION = 7, 8
_HALT, _MODE_BIT = 0x100, 0x10
"""Bits of the controlword; bit 4 enables interpolation, or starts homing."""


class AxisCommand:
    """The operation modes of one drive: what its axis does while the power state machine lets it.

    Args:
        dictionary: has controlword, mode, targets and limits.
        machine: the drive's power state machine.
        homing: its search for home.
        device: units and quirks of the drive.
    """

    def __init__(
        self, dictionary: ObjectDictionary, machine: StateMachine, homing: Homing, device: Device
    ) -> None:
        self._dictionary, self._machine, self._homing = dictionary, machine, homing
        self._scale, self._quirks = PositionScale(device), device.quirks
        self._target_known = False
        self.limited = False
        """Whether the latest target was outside 607D."""
        dictionary.listeners[0x607A] = lambda subindex, value: self.note_target()
        dictionary.listeners[0x60C1] = lambda subindex, value: self.note_target()

    @property
    def homes(self) -> bool:
        """Whether the drive is in homing mode."""
        return self._dictionary.integer(0x6060) == HOMING_MODE

    @property
    def halted(self) -> bool:
        """Bit 8 of the controlword."""
        return bool(self._dictionary.integer(0x6040) & _HALT)

    @property
    def mode(self) -> AxisMode:
        """What the axis does now.

        In interpolated position mode it follows only while bit 4 says so, in homing mode only while it homes,
        and in none while it is halted (bit 8).
        """
        mode = self._machine.mode
        if mode is not AxisMode.TRACKING:
            return mode
        idle = self._interpolates and not self._dictionary.integer(0x6040) & _MODE_BIT
        idle = idle or self.halted or (self.homes and not self._homing.active)
        return AxisMode.STOPPING if idle else mode

    @property
    def follows_targets(self) -> bool:
        """Whether the mode is one that this drive has."""
        modes = (CYCLIC_SYNCHRONOUS_POSITION, INTERPOLATED_POSITION, HOMING_MODE)
        return self._dictionary.integer(0x6060) in modes

    def note_target(self) -> None:
        """The master has given a target."""
        self._target_known = True

    def forget_target(self) -> None:
        """The axis is disabled: the next target is where it stands."""
        self._target_known = False

    def target(self, position: int, zero: int, period: float) -> int:
        """Target in counts of the encoder, within 607D; the present position while no target is known.

        Args:
            position: counts of the encoder.
            zero: counts of the encoder at which the drive reads 0.
            period: of the SYNC, s.
        """
        if self.homes:
            return self._homing.target(period)
        key = (0x60C1, 1) if self._interpolates else (0x607A, 0)
        if not self._target_known or self._quirks.holds_set_points(self._dictionary):
            self._dictionary.set(*key, self._scale.units(position - zero))
        wanted = self._dictionary.integer(*key)
        low, high = self._dictionary.integer(0x607D, 1), self._dictionary.integer(0x607D, 2)
        allowed = min(max(wanted, low), high)
        self.limited = allowed != wanted
        return self._scale.increments(allowed) + zero

    def deceleration(self) -> float:
        """Ramp of the present stop, increments/s²."""
        ramp = stop_ramp(self._dictionary, self._machine.state, halted=self.halted, homes=self.homes)
        return self._scale.speed(ramp)

    def command_homing(self, zero: int) -> None:
        """Bit 4 in homing mode, under torque.

        Args:
            zero: counts of the encoder at which the drive reads 0.
        """
        if not self.homes or self._machine.mode is not AxisMode.TRACKING:
            self._homing.forget()
            return
        start = bool(self._dictionary.integer(0x6040) & _MODE_BIT) and not self.halted
        set_point = self._scale.increments(self._dictionary.integer(0x6062)) + zero
        self._homing.command(start, set_point)

    @property
    def _interpolates(self) -> bool:
        return self._dictionary.integer(0x6060) == INTERPOLATED_POSITION
