"""CiA 402: the power state machine, its commands, and error codes in words."""

from drivers.cia402.emcy import describe_emcy
from drivers.cia402.states import Command, Goal, State, has_torque, next_controlword, refusal, state_of

__all__ = [
    "Command",
    "Goal",
    "State",
    "describe_emcy",
    "has_torque",
    "next_controlword",
    "refusal",
    "state_of",
]
