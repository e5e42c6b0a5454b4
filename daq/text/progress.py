"""Progress of a long step, told to whoever watches: a terminal, a log, nobody."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Protocol

Update = Callable[[float, str], None]
"""Called with the share that is done, 0 to 1, and a word on where it is (may be empty)."""


class Steps(Protocol):
    """Shows one step after the other."""

    def step(self, title: str) -> AbstractContextManager[Update]:
        """Show a step until the block ends."""
        ...


class Silent:
    """Nobody watches."""

    @contextmanager
    def step(self, title: str) -> Iterator[Update]:
        yield _ignore


def _ignore(share: float, word: str) -> None:
    """Nobody watches."""
