"""What the command line prints, as a text."""

from __future__ import annotations

import io
from collections.abc import Callable

from rich.console import Console

_WIDTH = 80


def said(print_to: Callable[[Console], None]) -> str:
    """The text that a function prints, without colours."""
    console = Console(file=io.StringIO(), width=_WIDTH, force_terminal=True, color_system=None)
    print_to(console)
    assert isinstance(console.file, io.StringIO)
    return "\n".join(line.rstrip() for line in console.file.getvalue().strip().splitlines())
