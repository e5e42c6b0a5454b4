"""When a stop is over: the set-point stands, the axis stands, and the brake has had its time."""

from __future__ import annotations

from drivers.simulated.state_machine import State, StateMachine
from robots.drive_description import Brake

STANDSTILL_SPEED = 0.02
"""Speed of a drive output below which a stop is over, rad/s or m/s."""
PATIENCE = 1.0
"""A stop is over this long after the set-point stopped, whatever the speed, s."""


class StopEnd:
    """Finishes the stop of one axis.

    Args:
        machine: the drive's power state machine, with a state pending while it stops.
        brake: of the drive.
    """

    def __init__(self, machine: StateMachine, brake: Brake) -> None:
        self._machine, self._brake = machine, brake
        self._ramp_time = self._brake_time = 0.0

    def follow(self, set_point_stands: bool, axis_stands: bool, period: float) -> None:
        """End of a SYNC period.

        Args:
            set_point_stands, axis_stands: as of now.
            period: s.
        """
        if self._machine.pending is None or not set_point_stands:
            self._ramp_time = self._brake_time = 0.0
            return
        self._ramp_time += period
        if axis_stands or self._ramp_time > PATIENCE:
            # The axis is held while the brake opens, and until it has fallen in.
            opens = self._machine.pending is State.OPERATION_ENABLED
            if self._brake_time >= (self._brake.release if opens else self._brake.engage):
                self._machine.standstill()
            self._brake_time += period
