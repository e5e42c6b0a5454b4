"""When what comes and goes in time begins and ends, to a row.

Noise that remembers hides what is constant and shows edges. A period that is a hundredth beside the true one
has its edges elsewhere after a few turns and shows nothing, and another one, of which some edges are there by
chance, shows more: periods are tried so close together that an edge stays in its cell to the end.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ident.discrepancy.by_evidence.decide.peaks import highest
from ident.kernels.folding import best_parts
from robots.arrays import FloatArray

Part = tuple[float, float, float]
"""Period (s), share of it, and beginning in it as a share."""

_MOST_CELLS = 600
"""Of a period; else a cell is a row."""

_SIZES = np.geomspace(0.1, 10.0, 7)
"""Of a drag, in its scales: between two of them a tenth of the gain is lost."""

_STRETCH = 40.0
"""s of a recording that all periods are tried on; what they show is then looked at in all of it."""


@dataclass(frozen=True, eq=False)
class Agreement:
    """Of a column that is there all the time, row by row.

    Attributes:
        time: (rows,) s.
        agreed: (rows,) with the white residual.
        products: (lags, rows) of the white column with itself, as pairs of a row and the one so many behind.
        scale: deviation of its parameter.
    """

    time: FloatArray
    agreed: FloatArray
    products: FloatArray
    scale: float

    @cached_property
    def spacing(self) -> float:
        """s between rows."""
        return float(np.median(np.diff(self.time)))

    @property
    def duration(self) -> float:
        """s."""
        return float(np.ptp(self.time))

    @cached_property
    def crossing(self) -> FloatArray:
        """(rows,) products of the pairs of which the earlier is before this row, and the later is not."""
        total = np.zeros(self.time.size)
        for k, weights in enumerate(self.products):
            before = np.concatenate([np.zeros(k + 1), np.cumsum(weights)])
            total += before[k : k + self.time.size] - before[: self.time.size]
        return total

    def first(self, duration: float) -> Agreement:
        """The same of the first so many seconds."""
        rows = slice(int(np.searchsorted(np.maximum.accumulate(self.time - self.time[0]), duration)))
        return Agreement(self.time[rows], self.agreed[rows], self.products[:, rows], self.scale)

    def parts(self, frequencies: FloatArray) -> tuple[FloatArray, list[Part]]:
        """About how many nats the best part has at each frequency, Hz, and that part."""
        periods = 1.0 / frequencies
        cells = np.clip(periods / self.spacing, 3, _MOST_CELLS).astype(np.int64)
        of_rows = self.agreed, np.asarray(self.products.sum(axis=0)), self.crossing
        turns = self.time, frequencies, cells
        gain, first, count = best_parts(turns, of_rows, _SIZES * self.scale, 1.0 / self.scale**2)
        parts = zip(periods.tolist(), (count / cells).tolist(), (first / cells).tolist(), strict=True)
        return gain, list(parts)


def best_edges(seen: Agreement, periods: tuple[float, float], most: int) -> list[tuple[float, Part]]:
    """The best parts at the highest peaks of the gain over the period, and about how many nats each has.

    As if nothing else could take up what they explain.

    Args:
        seen: of the column with the residual.
        periods: s, the shortest and the longest.
        most: peaks.
    """
    some = seen.first(_STRETCH)
    low, high = 1.0 / periods[1], 1.0 / periods[0]
    step = some.spacing / some.duration
    frequencies = np.geomspace(low, high, max(3, int(np.log(high / low) / step)))
    gain, _ = some.parts(frequencies)
    fine = 1.0 + step * np.linspace(-1.0, 1.0, 4 * int(np.ceil(seen.duration / some.duration)) + 1)
    found = []
    for k in highest(gain)[:most]:
        near, parts = seen.parts(np.clip(frequencies[k] * fine, low, high))
        best = int(np.argmax(near))
        found.append((float(near[best]), parts[best]))
    return found
