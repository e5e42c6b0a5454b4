"""Unnamed columns beside each other: which one is time, which is another's derivative, which are the same."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from daq.importing.channels import Channels
from daq.importing.guess_which import rises, time_of
from daq.importing.proof import derivative_of, smooth
from daq.recording.errors import CaptureError
from ident.listing import listed
from robots.arrays import BoolArray, FloatArray

_LONGEST = 60000
"""Samples from the middle of a log that are looked at."""
_CUTOFF = (10.0, 0.1)
"""Hz, and share of the sampling rate: below it columns are compared."""
_ALIKE = 0.98
"""Correlation."""


@dataclass(frozen=True)
class Block:
    """Columns that may be one quantity, one per joint."""

    places: tuple[int, ...]

    def overlaps(self, others: Sequence[Block]) -> bool:
        return any(set(self.places) & set(other.places) for other in others)


class UnnamedColumns:
    """The columns of one file, as an arm's log.

    Attributes:
        path: of the log.
        names: of its columns but the time, in the order of the file.
        values: samples × columns.
        smoothed, slopes: the same columns without noise, and their derivatives.
        rough: (columns,) what the smoothing took away, per unit of what is left.
    """

    def __init__(self, path: Path, columns: dict[str, FloatArray], sample_rate: float | None) -> None:
        self.path = path
        length = max(len(values) for values in columns.values())
        whole = {name: values for name, values in columns.items() if len(values) == length}
        stamps = _clock(path, whole, sample_rate)
        self.time = (
            None
            if stamps is None
            else Channels(stamps, (stamps,), whole[stamps][:, np.newaxis], None, "time", frozenset(), ())
        )
        self.names = [name for name in whole if name != stamps and not _counts(whole[name])]
        self.values = np.column_stack([whole[name] for name in self.names])
        same = [] if self.time is None else [self.time]
        self.stamps = time_of(path, same, length, sample_rate)[0]
        self._measure()

    def _measure(self) -> None:
        begin = max(0, (len(self.values) - _LONGEST) // 2)
        values = self.values[begin : begin + _LONGEST]
        stamps = self.stamps[begin : begin + _LONGEST]
        period = float(np.ptp(stamps) / (len(stamps) - 1))
        grid = stamps[0] + period * np.arange(len(stamps))
        even = np.column_stack([np.interp(grid, stamps, column) for column in values.T])
        smoothed = smooth(even, period, min(_CUTOFF[0], _CUTOFF[1] / period))
        edge = len(grid) // 20
        self.smoothed = smoothed[edge:-edge]
        self.slopes = derivative_of(smoothed, period)[edge:-edge]
        size = np.std(self.smoothed, axis=0)
        self.moves = size > 1e-9 * (1 + np.abs(self.smoothed).max(axis=0))
        self.rough = np.std((even - smoothed)[edge:-edge], axis=0) / np.where(self.moves, size, np.inf)

    def blocks(self, n: int) -> Iterator[Block]:
        """All that lie side by side, or at every so-and-so-many-th place of the file."""
        count = len(self.names)
        for first in range(count - n + 1):
            yield Block(tuple(range(first, first + n)))
        if n > 1 and count % n == 0:
            step = count // n
            for first in range(step if step > 1 else 0):
                yield Block(tuple(range(first, count, step)))

    def _all(self, first: Block, second: Block, related: BoolArray) -> bool:
        """Whether each of two blocks' moving columns is related to its counterpart, and there is one."""
        pairs = [(a, b) for a, b in zip(first.places, second.places, strict=True) if self.moves[a]]
        return bool(pairs) and all(related[a, b] for a, b in pairs)

    def side_by_side(self, blocks: list[Block], n: int) -> list[Block]:
        """Blocks that leave whole blocks before and behind them: without velocities little tells a shift."""
        count = len(self.names)
        if count % n:
            return blocks
        return [b for b in blocks if b.places[0] % n == 0 or b.places[-1] != b.places[0] + n - 1]

    def channel(self, block: Block, kind: str, *marks: str) -> Channels:
        columns = tuple(self.names[k] for k in block.places)
        values = self.values[:, block.places]
        return Channels(columns[0], columns, values, None, kind, frozenset(marks), ())

    def rougher(self, first: Block, second: Block) -> float:
        """How many times rougher the first is: median over the joints."""
        a, b = self.rough[list(first.places)], self.rough[list(second.places)]
        live = (a > 0) | (b > 0)
        tiny = np.finfo(float).tiny
        return float(np.median((a[live] + tiny) / (b[live] + tiny))) if live.any() else 1.0

    def same(self, first: Block, second: Block) -> bool:
        return self._all(first, second, self._alike)

    def is_derivative(self, first: Block, second: Block) -> bool:
        """Whether the second is the first's, in whatever unit."""
        return self._all(first, second, self._derivative)

    @cached_property
    def _alike(self) -> BoolArray:
        return _correlations(self.smoothed, self.smoothed) > _ALIKE

    @cached_property
    def _derivative(self) -> BoolArray:
        return _correlations(self.slopes, self.smoothed) > _ALIKE


def _counts(values: FloatArray) -> bool:
    """Whether a column counts the samples."""
    return bool((np.diff(values) == 1).all())


def _clock(path: Path, columns: dict[str, FloatArray], sample_rate: float | None) -> str | None:
    """Name of the column of times; None where there is none, or a sampling rate was given.

    Raises:
        CaptureError: several, or a mere count.
    """
    if sample_rate is not None:
        return None
    even = [name for name, values in columns.items() if rises(values) and _even(values)]
    clocks = [name for name in even if not _counts(columns[name])]
    if len(clocks) > 1 or (even and not clocks):
        raise CaptureError(
            f"{path}: {listed(clocks or even)} may be times or counts; give --sample-rate (samples per"
            " second)"
        )
    return clocks[0] if clocks else None


def _even(values: FloatArray) -> bool:
    """Whether most steps are much like each other, as a clock's."""
    steps = np.diff(values)
    usual = float(np.median(steps[steps > 0]))
    return bool(np.mean(np.abs(steps - usual) <= 0.5 * usual) > 0.7)


def _correlations(first: FloatArray, second: FloatArray) -> FloatArray:
    """Columns of the first × columns of the second."""
    a, b = first - first.mean(axis=0), second - second.mean(axis=0)
    sizes = np.outer(np.linalg.norm(a, axis=0), np.linalg.norm(b, axis=0))
    return np.asarray((a.T @ b) / np.where(sizes > 0, sizes, np.inf))
