"""How a drive comes to rest: which ramp a stop takes (CiA 402-2, 605Ah to 605Eh), and when it is over."""

from __future__ import annotations

from drivers.simulated.object_dictionary import ObjectDictionary
from drivers.simulated.state_machine import State, StateMachine, StopOptions
from robots.drive_description import Brake


def stop_options(dictionary: ObjectDictionary) -> StopOptions:
    """The options as the master has set them."""
    read = dictionary.integer
    return StopOptions(read(0x605A), read(0x605B), read(0x605C), read(0x605E))


def stop_ramp(dictionary: ObjectDictionary, state: State, *, halted: bool, homes: bool) -> float:
    """Deceleration of the present stop, counts/s².

    Args:
        dictionary: with options and ramps.
        state: of the power state machine.
        halted: bit 8 of the controlword.
        homes: whether the drive is in homing mode.
    """
    if homes and state is State.OPERATION_ENABLED:
        return float(max(1, dictionary.integer(0x609A)))
    options = stop_options(dictionary)
    quickly = halted and dictionary.integer(0x605D) == 2
    slow = (
        (state is State.OPERATION_ENABLED and not quickly)
        or (state is State.QUICK_STOP_ACTIVE and options.quick_stop in (1, 5))
        or (state is State.FAULT_REACTION_ACTIVE and options.fault_reaction == 1)
    )
    return float(max(1, dictionary.integer(0x6084 if slow else 0x6085)))


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
