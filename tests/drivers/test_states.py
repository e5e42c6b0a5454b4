from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.cia402 import (
    Goal,
    State,
    describe_emcy,
    has_torque,
    next_controlword,
    refusal,
    state_of,
    states,
)
from tests.drivers.fake_arm import UP, WORDS

STATUSWORDS = st.integers(0, 0xFFFF)


@pytest.mark.parametrize(
    ("statusword", "state"),
    [
        (0x0000, State.NOT_READY),
        (0x0250, State.SWITCH_ON_DISABLED),
        (0x0231, State.READY),
        (0x0233, State.SWITCHED_ON),
        (0x1637, State.OPERATION_ENABLED),
        (0x0217, State.QUICK_STOP),
        (0x021F, State.FAULT_REACTION),
        (0x0218, State.FAULT),
        (0x0238, State.FAULT),
        (0x0001, State.UNKNOWN),
    ],
)
def test_statusword_shows_the_state(statusword: int, state: State) -> None:
    assert state_of(statusword) is state


@given(STATUSWORDS)
def test_bits_outside_the_patterns_do_not_matter(statusword: int) -> None:
    assert state_of(statusword) is state_of(statusword & 0x6F)


@pytest.mark.parametrize("goal", [goal for goal in Goal if goal is not Goal.QUICK_STOP])
@pytest.mark.parametrize("state", [s for s in WORDS if s not in (State.FAULT, State.QUICK_STOP)])
def test_commands_lead_to_the_goal_and_keep_it(state: State, goal: Goal) -> None:
    names = [State.SWITCH_ON_DISABLED, State.READY, State.SWITCHED_ON, State.OPERATION_ENABLED]
    for _ in range(4):
        controlword = next_controlword(WORDS[state], goal)
        state = State.SWITCH_ON_DISABLED if controlword & 2 == 0 else UP.get((state, controlword), state)
    assert state is names[goal]


@given(STATUSWORDS, st.sampled_from(list(Goal)))
def test_no_command_resets_a_fault_or_goes_above_the_goal(statusword: int, goal: Goal) -> None:
    controlword = next_controlword(statusword, goal)
    assert not controlword & 0x80
    highest = {Goal.SWITCH_ON_DISABLED: 0x07, Goal.READY: 0x07, Goal.SWITCHED_ON: 0x07}.get(goal, 0x0F)
    assert controlword <= highest
    if state_of(statusword) in (State.QUICK_STOP, State.FAULT, State.FAULT_REACTION, State.UNKNOWN):
        assert controlword == 0
        assert refusal(statusword) is not None


@given(STATUSWORDS)
def test_only_a_drive_that_can_be_enabled_is_not_refused(statusword: int) -> None:
    way_up = {*list(WORDS)[:4], State.NOT_READY}
    assert (refusal(statusword) is None) == (state_of(statusword) in way_up)
    assert not (has_torque(statusword) and state_of(statusword) is State.SWITCHED_ON)


_CONTROLWORDS = {
    # statusword: for quick stop, switch on disabled, ready, switched on, operation enabled
    0x0040: (0x00, 0x00, 0x06, 0x06, 0x06),
    0x0021: (0x00, 0x00, 0x06, 0x07, 0x07),
    0x0023: (0x00, 0x06, 0x06, 0x07, 0x0F),
    0x0027: (0x02, 0x07, 0x07, 0x07, 0x0F),
    0x0007: (0x02, 0x00, 0x00, 0x00, 0x00),
    0x000F: (0x00, 0x00, 0x00, 0x00, 0x00),
    0x0008: (0x00, 0x00, 0x00, 0x00, 0x00),
    0x0000: (0x00, 0x00, 0x00, 0x00, 0x00),
    0x0002: (0x00, 0x00, 0x00, 0x00, 0x00),
}


@pytest.mark.parametrize("statusword", _CONTROLWORDS)
@pytest.mark.parametrize("bits", [0x0000, 0xFF90])
def test_each_step_is_the_transition_of_the_standard(statusword: int, bits: int) -> None:
    """One step at a time, whatever the bits say that are not of the state."""
    goals = (Goal.QUICK_STOP, Goal.SWITCH_ON_DISABLED, Goal.READY, Goal.SWITCHED_ON, Goal.OPERATION_ENABLED)
    found = tuple(next_controlword(statusword | bits, goal) for goal in goals)
    assert found == _CONTROLWORDS[statusword]


def test_torque_is_where_the_standard_has_it() -> None:
    having = {word for word in _CONTROLWORDS if has_torque(word)}
    assert having == {0x0027, 0x0007, 0x000F}


def test_refusals_in_words() -> None:
    assert refusal(0x0008) == "it is in state 'fault'"
    assert refusal(0x0007) == "it is in state 'quick stop active'"
    assert refusal(0x0202) == "its statusword 0x0202 shows no CiA 402 state"
    assert [refusal(word) for word in (0x0000, 0x0040, 0x0021, 0x0023, 0x0027)] == [None] * 5


def test_bits_of_the_modes_are_where_the_standard_has_them() -> None:
    """6041h: 10 target reached, 11 internal limit, 12 and 13 by mode; 6040h: 4 by mode."""
    assert (states.TARGET_REACHED, states.INTERNAL_LIMIT_BIT) == (1 << 10, 1 << 11)
    assert states.FOLLOWS_BIT == states.HOMING_ATTAINED == 1 << 12
    assert states.FOLLOWING_ERROR_BIT == states.HOMING_ERROR == 1 << 13
    assert states.MODE_BIT == 1 << 4
    assert states.Command.FAULT_RESET == 1 << 7


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (0x8130, "EMCY 0x8130 (heartbeat or life guard lost)"),
        (0x4312, "EMCY 0x4312 (motor temperature)"),
        (0x62A0, "EMCY 0x62A0 (user software)"),
        (0x9ABC, "EMCY 0x9ABC (external error)"),
        (0xFF77, "EMCY 0xFF77 (vendor-specific)"),
        (0xA000, "EMCY 0xA000 (unknown)"),
    ],
)
def test_emergencies_in_words(code: int, words: str) -> None:
    assert describe_emcy(code) == words
