"""Text tables as programs write them: any usual delimiter, decimal commas, a row of units, no header."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass

_COMMENTS = ("#", "%", "//")
_LEAST_TEXT = 9
"""Code of the tabulator: no text has a byte below it, and nearly every binary file has."""
_HEAD = 60
"""Lines in which header, units and comments are looked for."""
_LIST = re.compile(r'(?<=[,;\t\n])[ ]*"?[\[(]([-+\d.eE,;\s]*\d[-+\d.eE,;\s]*)[\])]"?(?=[ ]*[,;\t\r\n]|$)')
"""A cell that holds numbers in brackets, as pandas writes one; NumPy breaks the lines within."""
_COUNT = "\x01"
"""Before the length of a list: no text has it."""
_SEPARATORS = re.compile(r"[,;\s]+")
_LOOK = 100_000
"""Characters in which such cells are looked for."""
_TRUTH = re.compile(r"\b(?:true|false)\b", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"-?\d+,\d+")


@dataclass(frozen=True)
class TextTable:
    """A text table, split into names and numbers.

    Attributes:
        header: names of the columns; ``c1``, ``c2`` … where the file has none.
        body: the rows of numbers, with points in them.
        delimiter: between numbers; None for white space.
    """

    header: list[str]
    body: str
    delimiter: str | None


def decoded(content: bytes) -> str:
    """The text of a file: UTF-8 or UTF-16 by its mark, else a Western code page.

    Raises:
        UnicodeDecodeError: it is no text.
    """
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        if content and min(content) < _LEAST_TEXT:
            raise
        return content.decode("cp1252")


def text_table(text: str) -> TextTable:
    """Find names, delimiter and rows of a text; a table without rows has an empty body.

    Raises:
        csv.Error: the first line is no line of a table.
    """
    lines = text.split("\n", _HEAD)  # the last holds all that follows
    while lines and not lines[0].strip():
        lines.pop(0)
    comments: list[str] = []
    while lines and lines[0].lstrip().startswith(_COMMENTS):
        comments.append(lines.pop(0).lstrip().lstrip("#%/").strip())
    if not lines:
        return TextTable([], "", ",")
    if _LIST.search("\n".join(lines)[:_LOOK]):
        lines = _spread("\n".join(lines)).split("\n", _HEAD)
    delimiter = _delimiter(lines[min(1, len(lines) - 1)])
    header = _split(lines[0], _delimiter(lines[0]) if len(lines) == 1 else delimiter)
    count, of_numbers = len(header), [_is_number(field) for field in header]
    named = _split(comments[-1], _delimiter(comments[-1])) if comments else []
    if any(of_numbers) and len(named) == count and not any(map(_is_number, named)):
        header = named
    elif all(of_numbers):
        header = [f"c{k}" for k in range(1, count + 1)]
    else:
        lines.pop(0)
        if lines and not any(_is_number(field) for field in _split(lines[0], delimiter)):
            lines.pop(0)  # a row of units
    body = "\n".join(lines)
    if delimiter != "," and "." not in body and _DECIMAL_COMMA.search(body):
        body = body.replace(",", ".")
    return TextTable(header, body, delimiter)


def numbers_of(table: TextTable) -> tuple[list[int], str]:
    """Which columns hold numbers, by the first rows, and the rows with 1 and 0 for True and False.

    A column of which some rows are numbers counts as one of numbers.

    Raises:
        ValueError: there is none, or a line is none of a table.
    """
    body = _TRUTH.sub(lambda word: "1" if word[0].lower() == "true" else "0", table.body)
    try:
        rows = [_split(row, table.delimiter) for row in body.split("\n", _HEAD)[:_HEAD] if row.strip()]
    except csv.Error as error:
        raise ValueError(error) from error
    some = [any(k < len(row) and _is_number(row[k]) for row in rows) for k in range(len(table.header))]
    if not any(some):
        raise ValueError("there is no number in the first rows")
    return [k for k, numbers in enumerate(some) if numbers], body


def _spread(text: str) -> str:
    """A table whose cells hold lists with a column for each of their numbers, called name:1, name:2 …"""
    head, _, body = text.partition("\n")
    delimiter = _delimiter(head) or " "
    counted = _LIST.sub(
        lambda cell: f"{_COUNT}{len(_SEPARATORS.sub(' ', cell[1]).split())}", "\n" + body[:_LOOK]
    )
    names: list[str] = []
    for name, cell in zip(
        _split(head, delimiter), counted[1:].partition("\n")[0].split(delimiter), strict=False
    ):
        count = cell.strip()
        names += [f"{name}:{k + 1}" for k in range(int(count[1:]))] if count[:1] == _COUNT else [name]
    rows = _LIST.sub(lambda cell: delimiter.join(_SEPARATORS.sub(" ", cell[1]).split()), "\n" + body)
    return delimiter.join(names) + rows


def _delimiter(line: str) -> str | None:
    """That of one line; white space where it has none of the usual ones."""
    return next(
        (mark for mark in (";", "\t", ",", "|") if mark in line), "," if len(line.split()) < 2 else None
    )


def _split(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return line.split()
    return [name.strip() for name in next(csv.reader([line], delimiter=delimiter), [])]


def _is_number(field: str) -> bool:
    try:
        float(field.replace(",", "."))
    except ValueError:
        return False
    return True
