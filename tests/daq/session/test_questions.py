"""Questions before an arm moves: what was typed before one is no answer to it, on a real pseudo-terminal."""

from __future__ import annotations

import io
import os
import pty
import re
import select
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from daq.cli.common import asking
from daq.session import commission, home, jog, questions, run
from daq.session.admission import SIMULATED
from daq.session.motion_words import legs_of, motion_question, speed_share, time_words
from daq.session.questions import answered
from daq.session.recorded_runs import Recording
from daq.session.session_error import NotMoved
from robots import Robot
from tests.daq.catalogue.entries import identity
from tests.daq.session.askers import (
    DICE,
    acknowledge_asks,
    commission_asks,
    home_asks,
    jog_asks,
    live_asks,
    run_asks,
    standing,
    stands_asks,
    take_your_time,
    went_asks,
)
from trajectories import approach

PROMPT = b"[y/N]: "
TYPED_AHEAD = 100
"""Times, before each of the questions."""


class Screen(io.TextIOWrapper):
    """Knows whether a question has begun to be shown."""

    begun = False
    lock = threading.Lock()

    def write(self, text: str) -> int:
        with self.lock:
            self.begun = True
            return super().write(text)


@dataclass
class Keyboard:
    """The other end of a pseudo-terminal: types, and reads what is shown."""

    descriptor: int
    screen: Screen
    shown: bytes = b""

    def type_before_the_question(self, text: str) -> bool:
        """Type, unless it is too late for that."""
        with self.screen.lock:
            if self.screen.begun:
                return False
            self.type(text)
            return True

    def type(self, text: str) -> None:
        os.write(self.descriptor, text.encode())

    def wait_for(self, text: bytes, seconds: float = 20.0) -> None:
        deadline = time.monotonic() + seconds
        while text not in self.shown:
            assert select.select([self.descriptor], [], [], deadline - time.monotonic())[0], self.shown
            self.shown += os.read(self.descriptor, 4096)

    def forget(self) -> None:
        self.shown = b""


@pytest.fixture
def keyboard(monkeypatch: pytest.MonkeyPatch) -> Iterator[Keyboard]:
    """A terminal in front of this process; the quiet before a prompt is shorter, so that tests end."""
    there, here = pty.openpty()
    screen = Screen(io.FileIO(os.dup(here), "w"), encoding="utf-8", write_through=True)
    monkeypatch.setattr(questions, "terminal", lambda: here)
    monkeypatch.setattr(questions, "_screen", lambda err: screen)
    monkeypatch.setattr(questions, "QUIET", 0.02)
    yield Keyboard(there, screen)
    screen.close()
    os.close(there)
    os.close(here)


def test_what_is_typed_after_the_prompt_is_the_answer(keyboard: Keyboard) -> None:
    for typed, yes in (("y\n", True), ("Yes\n", True), ("n\n", False), ("\n", False), ("\x04", False)):
        thread, found = _in_a_thread(lambda: answered("Look.\nGo on?", "-"))
        keyboard.wait_for(b"Look.\r\nGo on? " + PROMPT)
        keyboard.type(typed)
        thread.join(20)
        assert found == [yes], typed
        keyboard.forget()


def test_an_answer_that_is_none_is_asked_for_again(keyboard: Keyboard) -> None:
    thread, found = _in_a_thread(lambda: answered("Go on?", "-"))
    keyboard.wait_for(PROMPT)
    keyboard.forget()
    keyboard.type("what?\ny\n")  # the second line was typed before its prompt
    keyboard.wait_for(PROMPT)
    assert b"Answer y or n." in keyboard.shown and not found
    keyboard.type("y\n")
    thread.join(20)
    assert found == [True]


def test_no_prompt_comes_while_somebody_types(keyboard: Keyboard, monkeypatch: pytest.MonkeyPatch) -> None:
    """A key that is held down, and half a line, too."""
    monkeypatch.setattr(questions, "QUIET", 0.2)
    thread, found = _in_a_thread(lambda: answered("Read this.\nGo on?", "-"))
    keyboard.wait_for(b"Read this.")
    for _ in range(20):
        keyboard.type("y\ny")
        assert not select.select([keyboard.descriptor], [], [], 0.03)[0] or PROMPT not in keyboard.shown
    keyboard.wait_for(PROMPT)
    keyboard.type("n\n")
    thread.join(20)
    assert found == [False]


@pytest.mark.parametrize("name", ["stdin", "stdout and stderr"])
def test_where_nobody_can_read_or_answer_it_is_refused(
    monkeypatch: pytest.MonkeyPatch, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    if name == "stdin":
        monkeypatch.setattr(sys, "stdin", io.StringIO("y\n" * 10))
    else:
        monkeypatch.setattr(questions, "terminal", lambda: 0)
    with pytest.raises(NotMoved, match="asks before the arm moves; give --yes where nobody can answer"):
        asking(yes=False, simulated=False, as_json=False)("Go on?")
    assert capsys.readouterr().out == ""


# Every question before a motion -------------------------------------------------------------------


@dataclass
class Asked:
    """A command up to its question, and how often it went on from there."""

    ask: Callable[[], object]
    moved: list[str]


@pytest.fixture(
    params=["jog", "run", "home", "commission", "live", "which way it went", "where it stands", "acknowledge"]
)
def asked(
    request: pytest.FixtureRequest, emps: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Asked:
    """A command with an arm that takes its time to open, as the set-up of drives does."""
    moved: list[str] = []
    arm = SimpleNamespace(session=standing(emps, moved), identity=identity(), admission=SIMULATED)

    @contextmanager
    def slow_to_open(*_: object, **__: object) -> Iterator[Any]:
        take_your_time()
        yield arm

    def moves(*_: object, **__: object) -> None:
        moved.append(request.param)
        raise NotMoved("this test looks no further")

    monkeypatch.setattr(Recording, "record", moves)
    for module in (jog, run, home, commission):
        monkeypatch.setattr(module, "opened", slow_to_open)
    commands = {
        "jog": jog_asks,
        "run": run_asks,
        "home": home_asks,
        "commission": commission_asks,
        "live": live_asks,
    }
    if request.param in commands:
        return Asked(commands[request.param](emps, tmp_path, arm), moved)
    looks = {"which way it went": went_asks, "where it stands": stands_asks, "acknowledge": acknowledge_asks}
    return Asked(looks[request.param](emps, monkeypatch, moved), moved)


@pytest.mark.slow
def test_what_was_typed_ahead_moves_nothing(asked: Asked, keyboard: Keyboard) -> None:
    """``y⏎`` at random moments before the question, a hundred times; then somebody reads it and says no."""
    typed = 0
    while typed < TYPED_AHEAD:
        keyboard.screen.begun = False
        thread, _ = _in_a_thread(asked.ask)
        time.sleep(DICE.uniform(0.0, 0.02))
        typed += keyboard.type_before_the_question(DICE.choice(["y\n", "y", "\ny\n", "y\n" * 5]))
        keyboard.wait_for(PROMPT)
        keyboard.forget()
        assert not asked.moved, f"the {typed}. time"
        keyboard.type("n\n")
        thread.join(20)
        assert not thread.is_alive()
    assert not asked.moved


def test_no_command_asks_in_a_way_in_which_typing_ahead_counts() -> None:
    root = Path(questions.__file__).parents[1]
    asking_ = re.compile(r"typer\.(confirm|prompt)|\binput\(|Confirm\.ask|Prompt\.ask")
    files = sorted(root.rglob("*.py"))
    assert len(files) > 100
    assert [path.name for path in files if asking_.search(path.read_text(encoding="utf-8"))] == []


def test_a_yes_that_follows_the_question_moves_it(asked: Asked, keyboard: Keyboard) -> None:
    thread, _ = _in_a_thread(asked.ask)
    keyboard.wait_for(PROMPT)
    keyboard.type("y\n")
    thread.join(20)
    assert len(asked.moved) == 1


def _in_a_thread(ask: Callable[[], object]) -> tuple[threading.Thread, list[object]]:
    found: list[object] = []

    def work() -> None:
        try:
            found.append(ask())
        except NotMoved as refused:
            found.append(refused)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    return thread, found


# What a question says -----------------------------------------------------------------------------


def test_a_question_says_what_moves_how_far_how_fast_how_long_and_the_way_there(tx40: Robot) -> None:
    home = np.array(tx40.home)
    there, beyond = home.copy(), home.copy()
    there[:2] += 0.1, -0.2
    beyond[:3] += 0.1, -0.2, 0.3
    cycle = tx40.bus.cycle_time
    way, motion = approach(tx40, home, there, cycle, 0.1), approach(tx40, there, beyond, cycle, 0.8)
    lines = motion_question(tx40, legs_of("the motion", motion, way)).splitlines()
    total = time_words(way.duration + motion.duration)
    assert lines[0] == f"tx40 is going to move for {total}."
    assert lines[1] == "First, slowly, to where the motion begins,"
    slow, fast = (int(np.ceil(100 * speed_share(tx40, leg) - 1e-6)) for leg in (way, motion))
    assert 0 < slow <= 10 < fast
    assert lines[2] == f"  for {time_words(way.duration)}, at up to {slow} % of the speed limits:"
    assert [line.split()[0] for line in lines[3:5]] == ["joint_1", "joint_2"], "only what moves"
    assert lines[5:7] == ["  The other joints stay.", "Then the motion,"]
    assert lines[7] == f"  for {time_words(motion.duration)}, at up to {fast} % of the speed limits:"
    low, high = np.degrees(home[2]), np.degrees(home[2] + 0.3)
    assert lines[8] == f"  joint_3  from {low:7.2f}°, between {low:7.2f}° and {high:7.2f}°, up to {fast:>2} %"
    assert lines[-1] == "Go on?"
    assert max(map(len, lines)) <= 78 and len(lines) <= 23, "it fits on a small terminal"


def test_times_in_words() -> None:
    assert [time_words(seconds) for seconds in (0.04, 9.94, 12.3, 59.7, 3725.0)] == [
        "0.0 s",
        "9.9 s",
        "12 s",
        "1 min 00 s",
        "62 min 05 s",
    ]
