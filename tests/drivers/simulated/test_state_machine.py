"""The power state machine as tables: controlword in, state out."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.simulated.set_points import AxisMode
from drivers.simulated.state_machine import POWERED, State, StateMachine, StopOptions, statusword

DISABLED, READY, ON, ENABLED, QUICK, REACTION, FAULT = (
    State.SWITCH_ON_DISABLED,
    State.READY_TO_SWITCH_ON,
    State.SWITCHED_ON,
    State.OPERATION_ENABLED,
    State.QUICK_STOP_ACTIVE,
    State.FAULT_REACTION_ACTIVE,
    State.FAULT,
)
NO_RAMP = StopOptions(quick_stop=0, shutdown=0, disable_operation=0, fault_reaction=0)


def machine_in(state: State) -> StateMachine:
    machine = StateMachine()
    machine.state = state
    return machine


@pytest.mark.parametrize(
    ("source", "controlword", "target"),
    [
        (DISABLED, 0x06, READY),
        (DISABLED, 0x07, DISABLED),
        (DISABLED, 0x0F, DISABLED),
        (DISABLED, 0x00, DISABLED),
        (READY, 0x06, READY),
        (READY, 0x07, ON),
        (READY, 0x0F, ON),
        (READY, 0x00, DISABLED),
        (READY, 0x02, DISABLED),
        (ON, 0x0F, ENABLED),
        (ON, 0x07, ON),
        (ON, 0x06, READY),
        (ON, 0x00, DISABLED),
        (ON, 0x02, DISABLED),
        (ENABLED, 0x0F, ENABLED),
        (ENABLED, 0x1F, ENABLED),
        (ENABLED, 0x07, ON),
        (ENABLED, 0x06, READY),
        (ENABLED, 0x00, DISABLED),
        (ENABLED, 0x02, DISABLED),
        (FAULT, 0x0F, FAULT),
        (FAULT, 0x80, DISABLED),
        (FAULT, 0x8F, DISABLED),
    ],
)
def test_one_controlword_without_ramps(source: State, controlword: int, target: State) -> None:
    machine = machine_in(source)
    machine.command(controlword, NO_RAMP)
    assert machine.state is target
    assert machine.pending is None


@pytest.mark.parametrize(
    ("controlword", "options", "state", "pending"),
    [
        (0x02, StopOptions(quick_stop=2), QUICK, DISABLED),
        (0x02, StopOptions(quick_stop=6), QUICK, None),
        (0x07, StopOptions(disable_operation=1), ENABLED, ON),
        (0x06, StopOptions(shutdown=1), ENABLED, READY),
        (0x06, StopOptions(shutdown=0), READY, None),
    ],
)
def test_a_stop_with_a_ramp_ends_at_standstill(
    controlword: int, options: StopOptions, state: State, pending: State | None
) -> None:
    machine = machine_in(ENABLED)
    machine.command(controlword, options)
    assert (machine.state, machine.pending) == (state, pending)
    assert machine.mode is (AxisMode.BRAKED if state is READY else AxisMode.STOPPING)
    machine.standstill()
    assert machine.state is (pending or state)


def test_a_fault_ramps_down_where_there_is_torque() -> None:
    machine = machine_in(ENABLED)
    machine.fault(StopOptions())
    assert (machine.state, machine.mode) == (REACTION, AxisMode.STOPPING)
    machine.command(0x80, StopOptions())
    assert machine.state is REACTION
    machine.standstill()
    assert (machine.state, machine.mode) == (FAULT, AxisMode.BRAKED)


@pytest.mark.parametrize("state", [DISABLED, READY, ON])
def test_a_fault_without_torque_needs_no_ramp(state: State) -> None:
    machine = machine_in(state)
    machine.fault(StopOptions())
    assert machine.state is FAULT


def test_fault_reset_wants_a_rising_edge() -> None:
    machine = StateMachine()
    machine.command(0x80, NO_RAMP)
    machine.fault(NO_RAMP)
    machine.command(0x80, NO_RAMP)
    assert machine.state is FAULT
    machine.command(0x00, NO_RAMP)
    machine.command(0x80, NO_RAMP)
    assert machine.state is DISABLED


def test_enabling_can_be_refused() -> None:
    machine = machine_in(ON)
    machine.command(0x0F, NO_RAMP, may_enable=False)
    assert machine.state is ON


@given(st.lists(st.integers(0, 0xFFFF), max_size=30))
def test_torque_comes_only_after_the_whole_sequence(words: list[int]) -> None:
    """Whatever is written, torque needs shutdown, switch on, enable operation in this order."""
    machine = StateMachine()
    stage = 0
    for word in words:
        before = machine.state
        machine.command(word, NO_RAMP)
        if machine.state is ENABLED and before is not ENABLED:
            assert before is ON
            assert word & 0x8F == 0x0F
            assert stage >= 2
        stage = {DISABLED: 0, READY: 1, ON: 2, ENABLED: 3}.get(machine.state, 0)


@pytest.mark.parametrize("state", list(State))
def test_statusword_bits_are_the_standard_ones(state: State) -> None:
    word = statusword(state, remote=True, following=False, limited=False, error=False)
    masks = {
        State.NOT_READY_TO_SWITCH_ON: (0x4F, 0x00),
        DISABLED: (0x4F, 0x40),
        READY: (0x6F, 0x21),
        ON: (0x6F, 0x23),
        ENABLED: (0x6F, 0x27),
        QUICK: (0x6F, 0x07),
        REACTION: (0x4F, 0x0F),
        FAULT: (0x4F, 0x08),
    }
    matches = [s for s, (mask, value) in masks.items() if word & mask == value]
    assert matches == [state]
    assert word & 0x200
    assert (state in POWERED) == bool(state in (ENABLED, QUICK, REACTION))
