"""What was guessed of a log, on the terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console


def print_guessed(console: Console, words: Sequence[str]) -> None:
    """One line each; nothing where nothing was guessed."""
    if words:
        console.print("Guessed from the log and its URDF:", highlight=False)
    for sentence in words:
        console.print(f"  {sentence}", markup=False, highlight=False, soft_wrap=True)
