"""Named columns of numbers from files of many kinds, and one-line errors where they are not there."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path

import numpy as np

from daq.importing.dialect import TextTable, decoded, numbers_of, text_table
from daq.recording.errors import CaptureError
from ident.listing import listed, short
from robots.arrays import FloatArray
from robots.errors import one_line

TEXTS = (".csv", ".txt", ".tsv", ".dat")
ALLOWED = ".csv, .mat, .parquet, .npz, .h5, .mcap, .db3, .bag, .txt, .tsv, .dat, a folder of .csv or of ROS 2"


_POINTER = b"version https://git-lfs.github.com/spec/"
_LARGEST_POINTER = 1024
"""Bytes, by the specification of Git LFS."""

_PART = re.compile(r"(.+)/(\d+)\[(\d+)\]")


def vector_by_vector(name: str, values: FloatArray, count: int) -> dict[str, FloatArray]:
    """A column of vectors below each other, as columns; name/7[2] is every seventh value from the second on.

    Empty where they are not smoother than the column is.
    """
    rows = values.reshape(-1, count)
    apart = float(np.abs(np.diff(rows, axis=0)).sum())
    if apart >= float(np.abs(np.diff(values)).sum()) / 2:
        return {}
    return {f"{name}/{count}[{k + 1}]": rows[:, k] for k in range(count)}


@dataclass(frozen=True)
class Table:
    """The columns of one file."""

    path: Path
    columns: dict[str, FloatArray]
    words: tuple[str, ...] = ()
    """What is missing in it, one sentence each."""
    texts: frozenset[str] = frozenset()
    """Names of further columns, which hold no numbers."""

    def pick(self, names: Sequence[str]) -> FloatArray:
        """Columns side by side, samples × names.

        Raises:
            CaptureError: a column is missing, or they differ in length.
        """
        values = {name: self._column(name) for name in names}
        lengths = {name: len(column) for name, column in values.items()}
        if len(set(lengths.values())) > 1:
            told = listed([f"{short(name)} {length}" for name, length in lengths.items()])
            raise CaptureError(f"{self.path}: variables differ in length: {told}")
        return np.column_stack([values[name] for name in names])

    def _column(self, name: str) -> FloatArray:
        if name in self.columns:
            return self.columns[name]
        part = _PART.fullmatch(name)
        if part and part[1] in self.columns and 0 < int(part[3]) <= int(part[2]):
            return self.columns[part[1]][int(part[3]) - 1 :: int(part[2])]
        if name in self.texts:
            raise CaptureError(f"{self.path}: column {short(name)!r} holds text; allowed: one of numbers")
        present = listed(sorted(self.columns), few=20) or "none"
        raise CaptureError(f"{self.path}: no variable {short(name)!r}; present: {present}")


def read_table(path: Path) -> Table:
    """Read a file of one of the kinds in ``ALLOWED``, or a folder with a ROS 2 bag.

    Raises:
        CaptureError: it is not there, not readable, or not what its name says.
    """
    _refuse_pointer(path)
    if path.is_dir() or path.suffix.lower() not in TEXTS:
        return _read_apart(path)
    try:
        return _read_csv(path)
    except FileNotFoundError:
        raise CaptureError(f"{path}: no such file") from None
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read: {error.strerror or error}") from error


def _read_apart(path: Path) -> Table:
    """Of a binary file or a bag, by a process of its own."""
    from daq.importing.table_process import TableProcess  # text needs none of these
    from daq.importing.table_readers import READERS

    if not path.is_dir() and path.suffix.lower() not in READERS:
        raise CaptureError(f"{path}: cannot be imported; allowed: {ALLOWED}")
    with TableProcess() as process:
        return Table(path, process.read(path))


def _refuse_pointer(path: Path) -> None:
    """What a repository holds in place of a large file that was not fetched reads as no format at all."""
    if path.is_file() and path.stat().st_size < _LARGEST_POINTER and path.read_bytes().startswith(_POINTER):
        raise CaptureError(f"{path}: only points to a file that Git LFS keeps; fetch that with: git lfs pull")


def _read_csv(path: Path) -> Table:
    try:
        table = text_table(decoded(path.read_bytes()))
    except (UnicodeDecodeError, csv.Error) as error:
        raise CaptureError(f"{path}: is not a text file; allowed: rows of numbers under a header") from error
    header = table.header
    if not header or not table.body or table.body.isspace():
        raise CaptureError(f"{path}: is empty; allowed: a header line and rows of numbers")
    body, words = _whole_lines(path, table)
    texts = frozenset[str]()
    try:
        values = _numbers(replace(table, body=body))
    except ValueError as error:
        try:
            kept, body = numbers_of(replace(table, body=body))
            values = _numbers(replace(table, body=body), kept)
        except ValueError:
            reason = one_line(str(error))
            raise CaptureError(
                f"{path}: is not a table of numbers under one header line: {reason}"
            ) from error
        texts = frozenset(name for k, name in enumerate(header) if name and k not in kept)
        header = [header[k] for k in kept]
    if len(set(header)) != len(header):
        raise CaptureError(f"{path}: two columns of the header have the same name")
    if values.shape[1] != len(header):
        raise CaptureError(f"{path}: {values.shape[1]} columns under {len(header)} names in the header line")
    words += (f"{path.name}: columns of text are left out: {listed(sorted(texts))}",) if texts else ()
    return Table(path, {name: values[:, k] for k, name in enumerate(header)}, words, texts)


def _numbers(table: TextTable, columns: Sequence[int] | None = None) -> FloatArray:
    """Rows × columns of a text; of all columns where None.

    Raises:
        ValueError: some field is no number.
    """
    quotes = None if columns is None else '"'
    return np.loadtxt(
        StringIO(table.body),
        delimiter=table.delimiter,
        ndmin=2,
        dtype=np.float64,
        comments=None,
        usecols=columns,
        quotechar=quotes,
    )


def _whole_lines(path: Path, table: TextTable) -> tuple[str, tuple[str, ...]]:
    """The rows of a text, without a last one that was cut off; and a sentence on that."""
    last = table.body.rfind("\n") + 1  # 0 where it is the only one; the end where the text ends a row
    if 0 < last < len(table.body) and _fields(table.body[last:], table.delimiter) < len(table.header):
        words = f"{path.name}: its last row is cut off and left out; more may be missing behind it"
        return table.body[:last], (words,)
    return table.body, ()


def _fields(row: str, delimiter: str | None) -> int:
    return len(row.split(delimiter))
