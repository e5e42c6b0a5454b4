"""Steps of a command as progress bars on a terminal, as plain lines in a pipe."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

from rich.console import Console
from rich.progress import BarColumn, Progress, Task, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text

from daq.text.progress import Update

_BAR = 14
_KNOWN_AFTER, _KNOWN_SHARE = 3.0, 0.02
"""s, and share of the work, after which what is left is estimated."""
_LONG = 10.0
"""s; less is not worth a line."""


class _Share(TextColumn):
    """The share that is done; nothing where nobody knows it: no bar stands at 0 % until it is done."""

    def __init__(self) -> None:
        super().__init__("")

    def render(self, task: Task) -> Text:
        return Text("      " if task.total is None else f"{task.percentage:>4.0f} %")


class TerminalSteps:
    """Progress bars with time left on the given console; lines with an estimate where it is no terminal."""

    def __init__(self, console: Console, clock: Callable[[], float] = monotonic) -> None:
        self._console, self._clock = console, clock

    @contextmanager
    def step(self, title: str) -> Iterator[Update]:
        """Show a bar until the block ends; it only swings until a share of the work is told."""
        if not self._console.is_terminal:
            self._console.print(f"{title} …")
            yield self._estimating()
            return
        columns = (
            BarColumn(bar_width=_BAR),
            _Share(),
            TimeElapsedColumn(),
            TimeRemainingColumn(compact=True),
            TextColumn("{task.description}", markup=False),
        )
        with Progress(*columns, console=self._console) as progress:
            task = progress.add_task(title, total=None)

            def update(share: float, word: str) -> None:
                total = 1.0 if share > 0.0 else None
                text = f"{title}: {word}" if word else title
                progress.update(task, completed=share, total=total, description=text)

            yield update
            progress.update(task, completed=1.0, total=1.0, description=title)

    def _estimating(self) -> Update:
        """In a pipe: no bar, and once a line about how long it takes, where that is long."""
        begun, said = self._clock(), False

        def update(share: float, word: str) -> None:
            nonlocal said
            passed = self._clock() - begun
            if said or passed < _KNOWN_AFTER or not _KNOWN_SHARE <= share < 1.0:
                return
            said = True
            left = passed * (1.0 - share) / share
            if left > _LONG:
                self._console.print(f"  about {_in_words(left)} more", highlight=False)

        return update


def _in_words(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90.0 else f"{seconds / 60.0:.0f} min"
