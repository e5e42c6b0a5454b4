"""What was probably meant by a name that does not exist."""

from __future__ import annotations

from collections.abc import Sequence


def did_you_mean(name: str, known: Sequence[str]) -> str:
    """`` (did you mean "…"?)``, or nothing where no name comes near.

    Args:
        name: as given.
        known: those that exist.
    """
    from difflib import get_close_matches  # takes time to load; a name that exists needs none

    close = get_close_matches(name, known, n=1)
    return f' (did you mean "{close[0]}"?)' if close else ""
