"""Single keys on the terminal conduct a stream: p, e, r, s, a, h."""

from __future__ import annotations

import os
import select
import termios
import threading
import tty
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from daq.session.questions import terminal
from daq.session.states import Conduct, SessionState, Wish, wishes

KEYS: Mapping[str, Wish] = {
    "p": "pause",
    "e": "pause_after",
    "r": "resume",
    "s": "stop",
    "a": "abort",
    "h": "halt",
}

_WORDS: Mapping[Wish, str] = {
    "pause": "pause now",
    "pause_after": "pause after this pass",
    "resume": "go on",
    "stop": "stop after this pass",
    "abort": "end now",
    "halt": "quick stop",
}

DOING: Mapping[SessionState, str] = {
    SessionState.PAUSING: "Slows down along its path to rest, in half a second or so, then holds there.",
    SessionState.PAUSING_AFTER: "Goes on to the end of this pass, then comes to rest and holds.",
    SessionState.PAUSED: "Holds under torque. Going on, it speeds up from here along its path.",
    SessionState.STOPPING: "Goes on to the end of this pass, then comes to rest; torque off, brakes on.",
    SessionState.ABORTING: "Comes to rest now on a ramp; then torque off, brakes on.",
    SessionState.HALTING: "The drives stop it themselves, quickly; then torque off, brakes on.",
}
"""What the arm does and is going to do, for whoever has pressed a key."""

_LOOK = 0.1
"""How often it is looked whether the stream is over, s."""


def pressed(key: str, conduct: Conduct) -> bool:
    """Follow a key; False where it means nothing now."""
    wish = KEYS.get(key.lower())
    return wish is not None and conduct.wish(wish, f"by the operator, key {key.lower()}")


def help_lines(state: SessionState, width: int) -> list[str]:
    """What may be pressed in a state, in words: lines of at most ``width`` that break between keys only."""
    lines: list[str] = []
    for entry in _shown(state):
        if lines and len(lines[-1]) + 2 + len(entry) <= width:
            lines[-1] += f"  {entry}"
        else:
            lines.append(entry)
    return lines


def _shown(state: SessionState) -> list[str]:
    allowed = wishes(state)
    return [f"{key} {_WORDS[wish]}" for key, wish in KEYS.items() if wish in allowed]


@contextmanager
def keys_conduct(conduct: Conduct, descriptor: int | None = None) -> Iterator[None]:
    """Follow single keys inside the block; nothing happens where standard input is no terminal.

    Ctrl-C keeps its meaning.

    Args:
        conduct: of the stream.
        descriptor: of the terminal; standard input where None.
    """
    source = terminal() if descriptor is None else descriptor
    if source is None:
        yield
        return
    before = termios.tcgetattr(source)
    ended = threading.Event()
    reader = threading.Thread(target=_read, args=(source, conduct, ended), name="keys", daemon=True)
    tty.setcbreak(source, termios.TCSANOW)
    reader.start()
    try:
        yield
    finally:
        ended.set()
        reader.join()
        termios.tcsetattr(source, termios.TCSANOW, before)


@contextmanager
def by_keyboard() -> Iterator[Conduct]:
    """A stream that single keys conduct."""
    conduct = Conduct()
    with keys_conduct(conduct):
        yield conduct


def _read(source: int, conduct: Conduct, ended: threading.Event) -> None:
    while not ended.is_set():
        readable, _, _ = select.select([source], [], [], _LOOK)
        if not readable:
            continue
        data = os.read(source, 64)
        if not data:
            return  # the terminal is gone
        for key in data.decode(errors="replace"):
            pressed(key, conduct)
