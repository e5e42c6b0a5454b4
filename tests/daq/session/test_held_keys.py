"""A key counts while it repeats; a tap, a burst and what was typed before are no hold."""

from __future__ import annotations

import os
import pty
import select
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.session.held_keys import MISSED_REPEATS, HeldKeys
from daq.session.questions import QUIET


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


def repeated(every: float, times: int, first: float = 0.4) -> tuple[HeldKeys, Clock]:
    """Pressed, and after the first delay of a keyboard repeated; the clock stands at the last repeat."""
    clock = Clock()
    keys = HeldKeys(0, clock)
    keys.heard(["+"])
    clock.now += first
    for _ in range(times):
        keys.heard(["+"])
        clock.now += every
    clock.now -= every
    return keys, clock


@given(every=st.floats(0.01, 0.09), times=st.integers(2, 30))
def test_it_is_held_while_it_repeats_and_let_go_soon_after(every: float, times: int) -> None:
    keys, clock = repeated(every, times)
    assert keys.held() == "+"
    last = clock.now
    clock.now = last + 2.0 * every if 2.0 * every < QUIET else last
    assert keys.held() == "+", "one repeat may be late"
    clock.now = last + min(QUIET, MISSED_REPEATS * every) + 1e-3
    assert keys.held() == ""


def test_a_tap_two_slow_taps_and_a_burst_are_no_hold() -> None:
    clock = Clock()
    keys = HeldKeys(0, clock)
    keys.heard(["+"])
    assert keys.held() == ""
    clock.now += 2 * QUIET
    keys.heard(["+"])
    assert keys.held() == "", "the second tap begins anew"
    clock.now += 2 * QUIET
    keys.heard(["+"] * 200)
    assert keys.held() == "", "what a stalled line hands over at once is one moment"
    assert [keys.pressed(0.0) for _ in range(4)] == ["+", "+", "+", ""]


@pytest.mark.parametrize("other", [["q"], ["-"], ["+", " "]])
def test_any_other_key_ends_it(other: list[str]) -> None:
    keys, _ = repeated(0.03, 10)
    keys.heard(other)
    assert keys.held() == ""


def test_arrows_of_a_real_terminal_in_pieces_and_its_end() -> None:
    keyboard, program = pty.openpty()
    os.write(keyboard, b"qq+\n")
    assert select.select([program], [], [], 5.0)[0], "it has arrived"
    with HeldKeys(program) as keys:
        assert keys.pressed(0.05) == "", "typed before it was asked for"
        os.write(keyboard, b"\x1b[A\x1bOB3")
        assert [keys.pressed(5.0) for _ in range(3)] == ["up", "down", "3"]
        os.write(keyboard, b"\x1b")
        assert keys.pressed(0.1) == ""
        os.write(keyboard, b"[C")
        assert keys.pressed(5.0) == "right"
        os.close(keyboard)
        deadline = time.monotonic() + 10.0
        while not keys.gone:
            assert time.monotonic() < deadline
    os.close(program)
