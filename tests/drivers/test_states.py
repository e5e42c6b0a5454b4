from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.cia402 import Goal, State, describe_emcy, has_torque, next_controlword, refusal, state_of
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
