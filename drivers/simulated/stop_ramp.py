"""How fast a drive comes to rest: which of its ramps a stop takes (CiA 402-2, 605Ah to 605Eh)."""

from __future__ import annotations

from drivers.simulated.object_dictionary import ObjectDictionary
from drivers.simulated.state_machine import State, StopOptions


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
