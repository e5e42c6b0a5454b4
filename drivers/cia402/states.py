"""The CiA 402 power state machine as data: statusword patterns, commands, and the way to a goal.

Source: CiA 402-2 (IEC 61800-7-201), "Power drive system finite state automaton", controlword 6040h
and statusword 6041h.
"""

from __future__ import annotations

from enum import Enum, IntEnum


class State(Enum):
    """The states of a drive; the values are their names in the standard."""

    NOT_READY = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch on disabled"
    READY = "ready to switch on"
    SWITCHED_ON = "switched on"
    OPERATION_ENABLED = "operation enabled"
    QUICK_STOP = "quick stop active"
    FAULT_REACTION = "fault reaction active"
    FAULT = "fault"
    UNKNOWN = "unknown"


class Command(IntEnum):
    """Controlwords of the commands (bits 0–3 and 7)."""

    DISABLE_VOLTAGE = 0x00
    QUICK_STOP = 0x02
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    DISABLE_OPERATION = 0x07  # the same bits as switch on; an alias
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80


class Goal(IntEnum):
    """How far up the state machine a drive shall be; the order is the order of the steps."""

    QUICK_STOP = -1
    """Stop by the drive's own quick stop (605Ah), then stay down."""
    SWITCH_ON_DISABLED = 0
    READY = 1
    SWITCHED_ON = 2
    OPERATION_ENABLED = 3


STATUSWORD_PATTERNS: tuple[tuple[State, int, int], ...] = (
    (State.NOT_READY, 0x4F, 0x00),
    (State.SWITCH_ON_DISABLED, 0x4F, 0x40),
    (State.READY, 0x6F, 0x21),
    (State.SWITCHED_ON, 0x6F, 0x23),
    (State.OPERATION_ENABLED, 0x6F, 0x27),
    (State.QUICK_STOP, 0x6F, 0x07),
    (State.FAULT_REACTION, 0x4F, 0x0F),
    (State.FAULT, 0x4F, 0x08),
)
"""State, mask, value: a drive is in the state whose masked statusword has the value."""

TORQUE_STATES = (State.OPERATION_ENABLED, State.QUICK_STOP, State.FAULT_REACTION)
"""States in which a drive may put torque on its motor."""

INTERNAL_LIMIT_BIT = 0x800
"""A limit inside the drive acts (of position, speed or current): it does not do what it is asked for."""
FOLLOWS_BIT = 0x1000
"""Bit 12 of the statusword: in csp the drive follows the command value, in ip interpolation is active."""
MODE_BIT = 0x10
"""Bit 4 of the controlword: in ip enable interpolation, in homing mode start and go on."""

FOLLOWING_ERROR_BIT = 0x2000
"""Bit 13 of the statusword in the modes csp and ip: the drive's own following error window was left."""

TARGET_REACHED, HOMING_ATTAINED, HOMING_ERROR = 0x0400, 0x1000, 0x2000
"""Bits 10, 12 and 13 of the statusword in homing mode: found and standing, found, failed."""

LEVEL: dict[State, Goal] = {
    State.SWITCH_ON_DISABLED: Goal.SWITCH_ON_DISABLED,
    State.READY: Goal.READY,
    State.SWITCHED_ON: Goal.SWITCHED_ON,
    State.OPERATION_ENABLED: Goal.OPERATION_ENABLED,
}
"""The states on the way up, as goals."""

_UP: dict[State, Command] = {
    State.SWITCH_ON_DISABLED: Command.SHUTDOWN,
    State.READY: Command.SWITCH_ON,
    State.SWITCHED_ON: Command.ENABLE_OPERATION,
}
_HOLD: dict[State, Command] = {
    State.SWITCH_ON_DISABLED: Command.DISABLE_VOLTAGE,
    State.READY: Command.SHUTDOWN,
    State.SWITCHED_ON: Command.SWITCH_ON,
    State.OPERATION_ENABLED: Command.ENABLE_OPERATION,
}
_DOWN: dict[State, Command] = {
    State.READY: Command.DISABLE_VOLTAGE,
    State.SWITCHED_ON: Command.SHUTDOWN,
    State.OPERATION_ENABLED: Command.DISABLE_OPERATION,
}


def _all_states() -> tuple[State, ...]:
    table = []
    for statusword in range(0x80):
        found = [state for state, mask, value in STATUSWORD_PATTERNS if statusword & mask == value]
        table.append(found[0] if found else State.UNKNOWN)
    return tuple(table)


_STATES = _all_states()


def state_of(statusword: int) -> State:
    """The state that a statusword (6041h) shows; UNKNOWN for a pattern that the standard does not have."""
    return _STATES[statusword & 0x7F]


def next_controlword(statusword: int, goal: Goal) -> int:
    """The controlword that brings a drive one transition nearer to a goal, or keeps it there.

    It never resets a fault and never leads up from quick stop: from every state off the way up it
    orders "disable voltage", which only takes energy away.

    Args:
        statusword: latest 6041h.
        goal: how far up the drive shall be.
    """
    return _NEXT[goal + _BELOW][statusword & 0x7F]


def _next_controlword(state: State, goal: Goal) -> int:
    if goal is Goal.QUICK_STOP:
        stops = state in (State.OPERATION_ENABLED, State.QUICK_STOP)
        return int(Command.QUICK_STOP if stops else Command.DISABLE_VOLTAGE)
    level = LEVEL.get(state)
    if level is None:
        return int(Command.DISABLE_VOLTAGE)
    if level < goal:
        return int(_UP[state])
    if level > goal:
        return int(_DOWN[state])
    return int(_HOLD[state])


_BELOW = -int(Goal.QUICK_STOP)
"""Goals below zero; a look at an Enum's member costs more than all the rest of a cycle's arithmetic."""
_NEXT = tuple(tuple(_next_controlword(state, goal) for state in _STATES) for goal in sorted(Goal))
"""By goal and by the low bits of the statusword: the cycle asks for six of them each time."""


def refusal(statusword: int) -> str | None:
    """Why a drive cannot be enabled from where it is, in words; None where it can."""
    state = state_of(statusword)
    if state in LEVEL or state is State.NOT_READY:
        return None
    if state is State.UNKNOWN:
        return f"its statusword 0x{statusword:04X} shows no CiA 402 state"
    return f"it is in state {state.value!r}"


def has_torque(statusword: int) -> bool:
    """Whether the drive may put torque on the motor in this state."""
    return state_of(statusword) in TORQUE_STATES
