"""Steps of a command as progress bars on a terminal, as plain lines in a pipe."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, Task, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text

from daq.text.progress import Update

_BAR = 14


class _Share(TextColumn):
    """The share that is done; nothing where nobody knows it: no bar stands at 0 % until it is done."""

    def __init__(self) -> None:
        super().__init__("")

    def render(self, task: Task) -> Text:
        return Text("      " if task.total is None else f"{task.percentage:>4.0f} %")


class TerminalSteps:
    """Progress bars with time left on the given console; plain lines where it is no terminal."""

    def __init__(self, console: Console) -> None:
        self._console = console

    @contextmanager
    def step(self, title: str) -> Iterator[Update]:
        """Show a bar until the block ends; it only swings until a share of the work is told."""
        if not self._console.is_terminal:
            self._console.print(f"{title} …")
            yield _nothing
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


def _nothing(share: float, word: str) -> None:
    """A pipe needs no bar."""
