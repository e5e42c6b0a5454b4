"""Keys of a real terminal, by a pseudo-terminal."""

from __future__ import annotations

import os
import pty
import termios
import time
from collections.abc import Iterator

import pytest

from daq.session.keyboard import by_keyboard, keys_conduct
from daq.session.states import Conduct, SessionState


@pytest.fixture
def terminal() -> Iterator[tuple[int, int]]:
    """Both ends of a pseudo-terminal: the keyboard's and the program's."""
    keyboard, program = pty.openpty()
    yield keyboard, program
    os.close(keyboard)
    os.close(program)


def wait_for(conduct: Conduct, state: SessionState) -> None:
    deadline = time.monotonic() + 10.0
    while conduct.state is not state:
        assert time.monotonic() < deadline, conduct.state
        time.sleep(0.01)


def test_single_keys_conduct_and_the_terminal_is_given_back(terminal: tuple[int, int]) -> None:
    keyboard, program = terminal
    before = termios.tcgetattr(program)
    conduct = Conduct()
    conduct.begin()
    with keys_conduct(conduct, program):
        assert not termios.tcgetattr(program)[3] & termios.ICANON, "no Enter is needed"
        assert termios.tcgetattr(program)[3] & termios.ISIG, "Ctrl-C keeps its meaning"
        os.write(keyboard, b"xs")
        wait_for(conduct, SessionState.STOPPING)
        assert conduct.control.reason == "by the operator, key s"
        os.write(keyboard, b"h")
        wait_for(conduct, SessionState.HALTING)
        assert conduct.control.reason == "by the operator, key h"
    assert termios.tcgetattr(program) == before
    os.write(keyboard, b"a\n")
    assert os.read(program, 10) == b"a\n", "nobody reads it away any more"


def test_the_terminal_is_given_back_after_an_error(terminal: tuple[int, int]) -> None:
    _, program = terminal
    before = termios.tcgetattr(program)

    def fail() -> None:
        with keys_conduct(Conduct(), program):
            raise ValueError

    with pytest.raises(ValueError):  # noqa: PT011
        fail()
    assert termios.tcgetattr(program) == before


def test_without_a_terminal_there_are_no_keys(capsys: pytest.CaptureFixture[str]) -> None:
    with by_keyboard() as conduct:
        assert conduct.state is SessionState.IDLE
