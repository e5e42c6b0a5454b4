"""Questions on the terminal, answered by somebody who has read them.

Whatever was typed before a question is not an answer to it. So the text is shown first, then the terminal
has to be quiet for a moment, all that has come by then is thrown away, and only then the prompt appears.
What comes out of a pipe or a file was written before the question by its nature, and what nobody can see
nobody has read: there a question is refused, and the command names the option that takes its place.
"""

from __future__ import annotations

import os
import select
import sys
import termios
import tty
from typing import TextIO

from daq.session.session_error import NotMoved
from daq.text.wrapped import width_of, wrapped

QUIET = 0.2
"""For so long nothing may be typed before a prompt, s: a key that is held down repeats sooner."""

_YES, _NO = ("y", "yes"), ("n", "no", "")


def answered(question: str, otherwise: str, *, err: bool = False) -> bool:
    """Show a question, and take its answer from whoever sits at the terminal.

    Args:
        question: as many lines as it takes; the last one is the prompt.
        otherwise: where nobody can answer: one line that says what to do instead.
        err: whether standard output carries something else.

    Returns:
        Whether the answer is yes. Enter, a no and the end of the input are a no.

    Raises:
        NotMoved: standard input is no terminal of this process, or none shows the question.
    """
    keyboard, screen = terminal(), _screen(err)
    if keyboard is None or screen is None:
        raise NotMoved(otherwise)
    text, _, prompt = "\n".join(wrapped(f"{question} [y/N]:", width_of(screen))).rpartition("\n")
    if text:
        screen.write(f"{text}\n")
    while True:
        screen.flush()
        _forget_what_was_typed(keyboard)
        screen.write(f"{prompt} ")
        screen.flush()
        line = os.read(keyboard, 4096)  # one line: the terminal hands out no more at a time
        if not line.endswith(b"\n"):  # the end of the input
            screen.write("\n")
        answer = line.decode(errors="replace").strip().lower()
        if answer in (*_YES, *_NO):
            return answer in _YES
        screen.write("Answer y or n.\n")


def terminal() -> int | None:
    """Standard input, if it is a terminal that this process may read from."""
    try:
        descriptor = sys.stdin.fileno()
        foreground = os.isatty(descriptor) and os.tcgetpgrp(descriptor) == os.getpgrp()
    except (OSError, ValueError, AttributeError):  # closed, or no file at all
        return None
    return descriptor if foreground else None


def _screen(err: bool) -> TextIO | None:
    """Where a person reads; None where both streams lead elsewhere."""
    for stream in (sys.stderr,) if err else (sys.stdout, sys.stderr):
        if stream is not None and stream.isatty():
            return stream
    return None


def _forget_what_was_typed(keyboard: int) -> None:
    """Wait until nothing has been typed for a moment; throw away all that was.

    Letters are taken one by one meanwhile and not shown, so that half a line counts as well. Ctrl-C keeps
    its meaning. The flush alone would not do: what was typed just now may still be on its way.
    """
    before = termios.tcgetattr(keyboard)
    tty.setcbreak(keyboard, termios.TCSAFLUSH)
    try:
        while select.select([keyboard], [], [], QUIET)[0]:
            if not os.read(keyboard, 4096):
                return  # the terminal is gone
    finally:
        termios.tcsetattr(keyboard, termios.TCSAFLUSH, before)
