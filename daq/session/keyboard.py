"""Single keys on the terminal conduct a stream: p, r, s, a, h."""

from __future__ import annotations

import os
import select
import sys
import termios
import threading
import tty
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from daq.session.states import Conduct, SessionState, Wish, wishes

KEYS: Mapping[str, Wish] = {"p": "pause", "r": "resume", "s": "stop", "a": "abort", "h": "halt"}

_WORDS: Mapping[Wish, str] = {
    "pause": "pause after the period",
    "resume": "go on",
    "stop": "stop after it",
    "abort": "come to rest now",
    "halt": "quick stop",
}

_LOOK = 0.1
"""How often it is looked whether the stream is over, s."""


def pressed(key: str, conduct: Conduct) -> bool:
    """Follow a key; False where it means nothing now. A second p goes on, as many players have it."""
    wish = KEYS.get(key.lower())
    if wish == "pause" and conduct.state in (SessionState.PAUSING, SessionState.PAUSED):
        wish = "resume"
    return wish is not None and conduct.wish(wish, f"by the operator, key {key.lower()}")


def help_line(state: SessionState) -> str:
    """What may be pressed in a state, in words."""
    allowed = wishes(state)
    return "  ".join(f"{key} {_WORDS[wish]}" for key, wish in KEYS.items() if wish in allowed)


@contextmanager
def keys_conduct(conduct: Conduct, descriptor: int | None = None) -> Iterator[None]:
    """Follow single keys inside the block; nothing happens where standard input is no terminal.

    Ctrl-C keeps its meaning.

    Args:
        conduct: of the stream.
        descriptor: of the terminal; standard input where None.
    """
    source = _terminal() if descriptor is None else descriptor
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


def _terminal() -> int | None:
    """Standard input, if it is a terminal that this process may read from."""
    try:
        descriptor = sys.stdin.fileno()
        foreground = os.isatty(descriptor) and os.tcgetpgrp(descriptor) == os.getpgrp()
    except (OSError, ValueError):  # closed, or no file at all
        return None
    return descriptor if foreground else None


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
