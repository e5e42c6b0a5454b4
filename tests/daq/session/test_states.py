"""States of a session: which wish is followed when, and what reaches the stream."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.session.keyboard import KEYS, help_lines, pressed
from daq.session.states import REST_SECONDS, TRANSITIONS, Conduct, SessionState, Wish, wishes
from drivers import Request, StreamControl
from tests.daq.captures import samples

S = SessionState
URGENCY = {
    S.RUNNING: 0,
    S.PAUSING: 0,
    S.PAUSING_AFTER: 0,
    S.PAUSED: 0,
    S.STOPPING: 1,
    S.ABORTING: 2,
    S.HALTING: 3,
}


class Listening(StreamControl):
    """Notes what it is asked."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[str] = []

    def _ask(self, request: Request, reason: str) -> None:
        self.asked.append(request.name.lower())
        super()._ask(request, reason)

    def resume(self) -> None:
        self.asked.append("resume")
        super().resume()


class Clock:
    def __init__(self) -> None:
        self.time = 0.0

    def __call__(self) -> float:
        return self.time


def test_every_state_and_wish_is_known() -> None:
    assert set(TRANSITIONS) == set(SessionState)
    assert TRANSITIONS[S.HALTING] == {}
    assert set(TRANSITIONS[S.IDLE]) == {"stop", "abort", "halt"}, "nothing that lets an arm move"


@given(
    st.lists(
        st.sampled_from(["pause", "pause_after", "resume", "stop", "abort", "halt", "sample", "wait"]),
        max_size=25,
    )
)
def test_no_wish_makes_it_less_urgent_and_a_refused_one_does_nothing(events: list[str]) -> None:
    clock, control = Clock(), Listening()
    conduct = Conduct(control, clock)
    conduct.begin()
    for event in events:
        before, asked = conduct.state, list(control.asked)
        if event == "wait":
            clock.time += 2 * REST_SECONDS
        elif event == "sample":
            conduct.on_samples(samples(0, 1))
        else:
            followed = conduct.wish(event)  # type: ignore[arg-type]
            assert followed == (event in TRANSITIONS[before])
            assert control.asked == ([*asked, event] if followed else asked)
        assert URGENCY[conduct.state] >= URGENCY[before]
        ends = [word for word in control.asked if word in ("stop", "abort", "halt")]
        assert (control.reason is not None) == bool(ends)


def test_a_pause_is_over_once_the_arm_rests_and_no_sooner() -> None:
    clock = Clock()
    conduct = Conduct(StreamControl(), clock)
    conduct.begin()
    assert conduct.wish("pause") and conduct.state is S.PAUSING
    for _ in range(10):
        clock.time += 0.05
        conduct.on_samples(samples(0, 3))
        assert conduct.state is S.PAUSING
    clock.time += 1.1 * REST_SECONDS
    assert conduct.state is S.PAUSED
    assert conduct.wish("resume") and conduct.state is S.RUNNING
    clock.time += 10.0
    assert conduct.state is S.RUNNING, "only one that was to pause is paused"
    conduct.end()
    assert conduct.state is S.IDLE and not conduct.wish("halt")


def test_the_reason_reaches_the_record() -> None:
    conduct = Conduct()
    conduct.begin()
    assert conduct.wish("stop", "the guard was opened")
    assert conduct.control.reason == "the guard was opened"


def test_keys_are_shown_exactly_where_they_work() -> None:
    for state in SessionState:
        shown = {entry.split()[0] for entry in help_lines(state, 1)}
        assert {KEYS[key] for key in shown} == set(wishes(state))


@pytest.mark.parametrize(
    ("key", "state"),
    [("p", S.PAUSING), ("e", S.PAUSING_AFTER), ("S", S.STOPPING), ("a", S.ABORTING), ("h", S.HALTING)],
)
def test_keys(key: str, state: SessionState) -> None:
    conduct = Conduct()
    conduct.begin()
    assert pressed(key, conduct) and conduct.state is state
    told = None if state in (S.PAUSING, S.PAUSING_AFTER) else f"by the operator, key {key.lower()}"
    assert conduct.control.reason == told, "a pause ends nothing"


def test_an_end_that_is_wished_for_before_the_stream_counts_for_it() -> None:
    conduct = Conduct()
    assert not pressed("p", conduct) and not pressed("r", conduct)
    assert pressed("a", conduct)
    conduct.begin()
    assert conduct.state is S.ABORTING and conduct.control.reason == "by the operator, key a"
    assert not conduct.wish("resume")


def test_a_second_p_does_not_go_on_and_other_keys_do_nothing() -> None:
    """Whoever hits a key again and again wants it to stop."""
    conduct = Conduct()
    conduct.begin()
    assert pressed("p", conduct) and not pressed("p", conduct) and conduct.state is S.PAUSING
    assert pressed("r", conduct) and conduct.state is S.RUNNING
    assert not any(pressed(key, conduct) for key in "xq \x1b\n")
    wish: Wish = "resume"
    assert not conduct.wish(wish), "it is not paused"
