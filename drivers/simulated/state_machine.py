"""The CiA 402 power state machine as data (CiA 402-2, figure 3 and tables 5 and 6)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from drivers.simulated.set_points import AxisMode


class State(Enum):
    """Power states; the value is what the state puts into the statusword."""

    NOT_READY_TO_SWITCH_ON = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY_TO_SWITCH_ON = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION_ACTIVE = 0x0F
    FAULT = 0x08


POWERED = frozenset({State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE})
"""States with torque on the motor and the brake released."""


class Command(NamedTuple):
    """A command in the controlword: which bits count, and their values."""

    mask: int
    value: int

    def given(self, controlword: int) -> bool:
        """Whether the controlword says so."""
        return controlword & self.mask == self.value


SHUTDOWN = Command(0x87, 0x06)
SWITCH_ON = Command(0x8F, 0x07)
ENABLE_OPERATION = Command(0x8F, 0x0F)
DISABLE_VOLTAGE = Command(0x82, 0x00)
QUICK_STOP = Command(0x86, 0x02)


class Transition(NamedTuple):
    """One arrow of the state machine."""

    number: int
    source: State
    command: Command
    target: State


# A controlword that enables also switches on (transition 3 before 4): one step per controlword.
TRANSITIONS = (
    Transition(2, State.SWITCH_ON_DISABLED, SHUTDOWN, State.READY_TO_SWITCH_ON),
    Transition(3, State.READY_TO_SWITCH_ON, SWITCH_ON, State.SWITCHED_ON),
    Transition(3, State.READY_TO_SWITCH_ON, ENABLE_OPERATION, State.SWITCHED_ON),
    Transition(4, State.SWITCHED_ON, ENABLE_OPERATION, State.OPERATION_ENABLED),
    Transition(5, State.OPERATION_ENABLED, SWITCH_ON, State.SWITCHED_ON),
    Transition(6, State.SWITCHED_ON, SHUTDOWN, State.READY_TO_SWITCH_ON),
    Transition(7, State.READY_TO_SWITCH_ON, QUICK_STOP, State.SWITCH_ON_DISABLED),
    Transition(7, State.READY_TO_SWITCH_ON, DISABLE_VOLTAGE, State.SWITCH_ON_DISABLED),
    Transition(8, State.OPERATION_ENABLED, SHUTDOWN, State.READY_TO_SWITCH_ON),
    Transition(9, State.OPERATION_ENABLED, DISABLE_VOLTAGE, State.SWITCH_ON_DISABLED),
    Transition(10, State.SWITCHED_ON, QUICK_STOP, State.SWITCH_ON_DISABLED),
    Transition(10, State.SWITCHED_ON, DISABLE_VOLTAGE, State.SWITCH_ON_DISABLED),
    Transition(11, State.OPERATION_ENABLED, QUICK_STOP, State.QUICK_STOP_ACTIVE),
    Transition(12, State.QUICK_STOP_ACTIVE, DISABLE_VOLTAGE, State.SWITCH_ON_DISABLED),
)
_BY_SOURCE = {state: tuple(t for t in TRANSITIONS if t.source is state) for state in State}


@dataclass(frozen=True)
class StopOptions:
    """Option codes of CiA 402: how a drive stops in each case."""

    quick_stop: int = 2
    """605A: 0 no ramp; 1, 2 ramp then disable; 5, 6 ramp then stay in quick stop active."""
    shutdown: int = 0
    """605B: 0 no ramp, 1 ramp."""
    disable_operation: int = 1
    """605C: 0 no ramp, 1 ramp."""
    fault_reaction: int = 2
    """605E: 0 no ramp; 1, 2 ramp."""


class StateMachine:
    """The power state of one drive, and what its axis does in it.

    A stop with a ramp keeps the torque on until :meth:`standstill` is told; ``pending`` is the state
    that follows. Where the brake takes its time to open, operation enabled is pending, too, with torque on
    and the axis held, until :meth:`standstill`.

    Args:
        brake_opens_slowly: whether it does.
    """

    def __init__(self, brake_opens_slowly: bool = False) -> None:
        self._slow_brake = brake_opens_slowly
        self.state = State.SWITCH_ON_DISABLED
        self.pending: State | None = None
        self._reset_was_high = False

    @property
    def mode(self) -> AxisMode:
        """What the axis does now."""
        if self.pending is State.OPERATION_ENABLED:
            return AxisMode.STOPPING
        if self.state not in POWERED:
            return AxisMode.BRAKED
        if self.state is State.OPERATION_ENABLED and self.pending is None:
            return AxisMode.TRACKING
        return AxisMode.STOPPING

    def command(self, controlword: int, options: StopOptions, may_enable: bool = True) -> Transition | None:
        """Obeys one controlword.

        Args:
            controlword: object 6040.
            options: the drive's option codes.
            may_enable: False where the drive must not take transition 4 now.

        Returns:
            The transition taken, or begun with a ramp; None where there is none.
        """
        reset = bool(controlword & 0x80)
        rising, self._reset_was_high = reset and not self._reset_was_high, reset
        if self.state is State.FAULT:
            if rising:
                self._enter(State.SWITCH_ON_DISABLED)
            return None
        opening = self.pending is State.OPERATION_ENABLED
        for transition in _BY_SOURCE[self.state]:
            if opening and transition.target is State.OPERATION_ENABLED:
                continue
            if transition.command.given(controlword):
                if transition.target is State.OPERATION_ENABLED and not may_enable:
                    return None
                self._take(transition, options)
                return transition
        return None

    def fault(self, options: StopOptions) -> None:
        """Transitions 13 and, without a ramp, 14: something is wrong."""
        if self.state in (State.FAULT, State.FAULT_REACTION_ACTIVE):
            return
        if self.state in POWERED and options.fault_reaction != 0:
            self._enter(State.FAULT_REACTION_ACTIVE)
            self.pending = State.FAULT
        else:
            self._enter(State.FAULT)

    def cut(self, target: State) -> None:
        """Torque off and brake on at once, then ``target``."""
        self._enter(target)

    def quick_stop(self, options: StopOptions) -> None:
        """Quick stop from inside the drive, where it is powered."""
        if self.state is State.OPERATION_ENABLED:
            self._quick_stop(options)

    def standstill(self) -> None:
        """The ramp is over: enters the state that was pending."""
        if self.pending is not None:
            self._enter(self.pending)

    def _take(self, transition: Transition, options: StopOptions) -> None:
        if transition.number == 11:
            self._quick_stop(options)
        elif self._takes_time(transition.number, options):
            self.pending = transition.target
        else:
            self._enter(transition.target)

    def _takes_time(self, number: int, options: StopOptions) -> bool:
        if number == 4:
            return self._slow_brake
        codes = {5: options.disable_operation, 8: options.shutdown}
        return codes.get(number, 0) != 0

    def _quick_stop(self, options: StopOptions) -> None:
        if options.quick_stop == 0:
            self._enter(State.SWITCH_ON_DISABLED)
            return
        self._enter(State.QUICK_STOP_ACTIVE)
        if options.quick_stop in (1, 2, 3, 4):
            self.pending = State.SWITCH_ON_DISABLED

    def _enter(self, state: State) -> None:
        self.state = state
        self.pending = None


def statusword(
    state: State,
    *,
    remote: bool,
    following: bool,
    limited: bool,
    error: bool,
    warning: bool = False,
    reached: bool = False,
) -> int:
    """Object 6041: state, voltage enabled (4), warning (7), remote (9), limit (11), and the mode's own bits.

    Those are 10 (target reached), 12 (in csp: follows; in homing: attained) and 13 (error).
    """
    bits = state.value | 0x10
    bits |= 0x80 if warning else 0
    bits |= 0x200 if remote else 0
    bits |= 0x400 if reached else 0
    bits |= 0x800 if limited else 0
    bits |= 0x1000 if following else 0
    bits |= 0x2000 if error else 0
    return bits
