"""Names in a message: as many as fit into a line."""

from __future__ import annotations

from collections.abc import Sequence

SHOWN = 3
"""Names that a message shows where there are many."""

_FEW = 6
"""So many are not yet many."""


_EPOCH = 1e5
"""s; a clock that is farther from zero counts from somewhere else."""

_LONG = 48
"""Characters of a name that a message shows whole."""


def short(name: str) -> str:
    """A name as messages show it: of a very long one its beginning and its end."""
    return name if len(name) <= _LONG else f"{name[: _LONG - 13]}…{name[-12:]}"


def seconds(time: float) -> str:
    """An instant of a log, s: six digits, or as many as seconds since 1970 need to tell samples apart."""
    return f"{time:.6g}" if abs(time) < _EPOCH else f"{time:.3f}"


_WIDE = 64
"""Characters of names in a message, which has two lines of a terminal at most."""


def in_lines(names: Sequence[str]) -> list[str]:
    """All names, so many to a message as fit."""
    lines: list[str] = []
    for name in map(short, names):
        if lines and len(lines[-1]) + len(name) + 2 <= _WIDE:
            lines[-1] += f", {name}"
        else:
            lines.append(name)
    return lines


def listed(names: Sequence[str], few: int = _FEW) -> str:
    """All of a few names; of many, or long ones, as many as fit, and how many more there are."""
    names = [short(name) for name in names]
    shown = len(names) if len(names) <= few else SHOWN
    while shown > 1 and len(", ".join(names[:shown])) > _WIDE:
        shown = min(shown - 1, SHOWN)
    more = len(names) - shown
    return ", ".join(names[:shown]) + (f" and {more} more" if more else "")
