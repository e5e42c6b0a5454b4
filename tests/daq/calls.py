"""The type of what the fixture ``armhil`` gives."""

from __future__ import annotations

from collections.abc import Callable

Call = Callable[..., tuple[int, str, str]]
"""Calls the command line with these words: exit code, stdout, stderr."""
