"""Text on a terminal: lines break between words only, tables leave columns out before they cut a cell."""

from __future__ import annotations

import os
import re
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TextIO

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

_UNBOUNDED = 10_000


class WordConsole(Console):
    """A console whose lines break between words only, on a terminal; in a pipe each text is one line.

    A path or command that is longer than a line stays whole, so that it can be copied.
    """

    def print(self, *objects: Any, **options: Any) -> None:
        """As that of rich; only single texts are wrapped otherwise."""
        if len(objects) != 1 or not isinstance(objects[0], str | Text) or not self.is_terminal:
            super().print(*objects, **options)
            return
        text = objects[0]
        if isinstance(text, str):
            text = Text.from_markup(text) if options.get("markup", True) else Text(text)
        options["soft_wrap"] = True
        for line in _broken(text, self.width):
            line.rstrip()
            super().print(line, **options)


def _broken(text: Text, width: int) -> Iterator[Text]:
    """Lines of a text, each broken before the first word that would pass the width; styles stay.

    ``Text.wrap`` of rich either cuts words that are longer than a line or does not wrap at all.
    """
    for line in text.split("\n", allow_blank=True):
        breaks, begin = [], 0
        for word in re.finditer(r"\S+", line.plain):
            if (
                word.start() > begin
                and cell_len(line.plain[begin : word.end()]) > width
                and line.plain[begin : word.start()].strip()
            ):
                begin = word.start()
                breaks.append(begin)
        yield from line.divide(breaks)


def write(console: Console, text: str, style: str = "", indent: str = "") -> None:
    """Print a sentence that breaks between words only.

    Args:
        console: where a person reads.
        text: without markup.
        style: of the whole text, as rich names it.
        indent: before each line but the first.
    """
    width = console.width if console.is_terminal else None
    for line in wrapped(text, width, indent):
        console.print(Text(line, style=style), soft_wrap=True, highlight=False)


def wrapped(text: str, width: int | None, indent: str = "") -> list[str]:
    """Lines of a text of at most a width; as they are where it is None."""
    lines: list[str] = []
    for line in text.split("\n"):
        if width is None or not line:
            lines.append(line)
        else:
            lines += textwrap.wrap(
                line,
                width,
                subsequent_indent=indent,
                break_long_words=False,
                break_on_hyphens=False,
                drop_whitespace=True,
            )
    return lines


def width_of(stream: TextIO) -> int | None:
    """Columns of the terminal that a stream leads to; None where it leads elsewhere."""
    try:
        return os.get_terminal_size(stream.fileno()).columns or None if stream.isatty() else None
    except (OSError, ValueError):
        return None


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes:
        heading: its head.
        right: numbers stand on the right.
        spare: left out where the table is too wide, the largest first; 0 never.
        wraps: holds words that may go on in the next line.
    """

    heading: str
    right: bool = True
    spare: int = 0
    wraps: bool = False


def write_table(
    console: Console, title: str, columns: Sequence[Column], rows: Sequence[Sequence[str]]
) -> None:
    """Print a table that no cell is cut in; what does not fit is left out by columns, and named.

    Args:
        console: where a person reads.
        title: above it, without markup; nothing where empty.
        columns: from left to right.
        rows: one text per column.
    """
    shown = list(range(len(columns)))
    while _width(console, _table(columns, rows, shown)) > console.width:
        spare = max(shown, key=lambda column: columns[column].spare)
        if columns[spare].spare == 0:
            break
        shown.remove(spare)
    if title:
        write(console, title, style="italic")
    console.print(_table(columns, rows, shown))
    left = [column.heading for number, column in enumerate(columns) if number not in shown]
    if left:
        write(console, f"Left out at {console.width} columns: {', '.join(left)}.", style="dim")


def _table(columns: Sequence[Column], rows: Sequence[Sequence[str]], shown: Sequence[int]) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1), collapse_padding=True, pad_edge=False)
    for number in shown:
        column = columns[number]
        table.add_column(
            Text(column.heading),
            justify="right" if column.right else "left",
            no_wrap=not column.wraps,
            overflow="fold",
        )
    for row in rows:
        table.add_row(*(Text(row[number]) for number in shown))
    return table


def _width(console: Console, table: Table) -> int:
    """How wide the table is with its words wrapped as far as they go."""
    return Measurement.get(console, console.options.update(max_width=_UNBOUNDED), table).minimum
