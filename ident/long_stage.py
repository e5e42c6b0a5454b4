"""One stage of the decimation of a long record, at the samples that it keeps alone.

The filter and its mirror image are a finite filter and a recursion from one kept sample to the next: with M
the factor, 1/(1 − p·z⁻¹) = (1 + p·z⁻¹ + … + pᴹ⁻¹·z¹⁻ᴹ)/(1 − pᴹ·z⁻ᴹ) for each pole p. So rows far from the
ends of a record cost 8·M products for each pass and one recursion for M samples, and are the same numbers.
Near an end, where what a filter knows of beyond decides, it runs at every sample.

A series that has nothing left at half the sampling rate and above, as what follows from low-passed positions
without a jump has, need not be known at every sample: the sum over every s-th, s times, is that over all.

Source: Crochiere and Rabiner, Multirate Digital Signal Processing (recursive decimators).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from ident.recursive_filter import RecursiveFilter, chebyshev
from robots.arrays import FloatArray, IntArray

PADDING = 24
"""Samples by which the decimation filter extends a record at both ends, as MATLAB does."""

_ORDER = 8
_FORGOTTEN = 1e-9
"""Share of what is beyond an end that is as good as nothing."""

_ROWS_AT_ONCE = 2 * _ORDER
"""Rows whose finite filter is one product."""


@dataclass(frozen=True)
class LongStage:
    """Which samples of a record a stage sees: all near the ends, every ``step``-th between.

    Attributes:
        samples: of the record.
        factor: M.
        step: a divisor of it.
        near: rows at either end that the end may have a share in.
    """

    samples: int
    factor: int
    step: int
    near: int

    @classmethod
    def of(cls, samples: int, factor: int, step: int = 1) -> LongStage | None:
        """None where the record is so short that it is better filtered at every sample."""
        near = rows_near(factor)
        return cls(samples, factor, step, near) if samples > 8 * near * factor else None

    @property
    def _first(self) -> int:
        return first_kept(self.samples, self.factor)

    @property
    def head(self) -> slice:
        return slice(0, 2 * self.near * self.factor)

    @property
    def middle(self) -> slice:
        """Of all rows whose finite filter is within the record."""
        reach = _ORDER * self.factor
        behind = (self.samples - 1 - self._first - 2 * reach) // self.factor * self.factor
        return slice(self._first, self._first + behind + 2 * reach + 1, self.step)

    @property
    def tail(self) -> slice:
        return slice(self.samples - 2 * self.near * self.factor, self.samples)

    @property
    def seen(self) -> IntArray:
        """(m,) the samples that :meth:`rows` wants, some of them twice."""
        every = np.arange(self.samples)
        return np.concatenate([every[self.head], every[self.middle], every[self.tail]])

    def rows(self, series: FloatArray) -> FloatArray:
        """Channels × kept samples, of channels × those that are seen."""
        ends = self.head.stop, series.shape[1] - 2 * self.near * self.factor
        return self.joined(series[:, : ends[0]], series[:, ends[0] : ends[1]], series[:, ends[1] :])

    def joined(self, head: FloatArray, middle: FloatArray, tail: FloatArray) -> FloatArray:
        """Channels × kept samples, of the three parts of the record that are seen."""
        taps, recursion = _finite_part(self.factor)
        mixed = _mixed(middle, self.step * taps[:: self.step], self.factor // self.step)
        inner = recursion.both_ways(mixed, 0)
        beyond, channels = self.near - _ORDER, len(middle)
        smooth = _filter(self.factor).both_ways(np.concatenate([head, tail]), PADDING)
        first = smooth[:channels, self._first :: self.factor][:, : self.near]
        last = smooth[channels:, self.factor - 1 :: self.factor][:, -self.near :]
        return np.concatenate([first, inner[:, beyond : inner.shape[1] - beyond], last], axis=1)


def rows_near(factor: int) -> int:
    """Rows at either end that the end may have a share in."""
    slowest = _filter(factor).slowest ** factor
    return _ORDER + int(np.ceil(np.log(_FORGOTTEN) / np.log(slowest)))


def between_ends(series: FloatArray, factor: int) -> FloatArray:
    """A stage by its filter at every sample, channels × samples in, channels × kept samples out."""
    smooth = _filter(factor).both_ways(series, PADDING)
    return smooth[:, first_kept(series.shape[1], factor) :: factor]


def first_kept(samples: int, factor: int) -> int:
    kept = -(-samples // factor)
    return factor - (factor * kept - samples) - 1


def _filter(factor: int) -> RecursiveFilter:
    return chebyshev(_ORDER, 0.05, 0.8 / factor)


@cache
def _finite_part(factor: int) -> tuple[FloatArray, RecursiveFilter]:
    """(16·M + 1,) taps of the finite filter both ways, and the recursion from row to row of one way."""
    low = _filter(factor)
    one_way = np.array([low.gain + 0.0j])
    for pole in low.poles:
        one_way = np.convolve(np.convolve(one_way, [1.0, 1.0]), pole ** np.arange(factor))
    return np.convolve(one_way.real, one_way.real[::-1]), RecursiveFilter(1.0, low.poles**factor, 0)


def _mixed(series: FloatArray, taps: FloatArray, every: int) -> FloatArray:
    """Sums of neighbours under the taps, channels × rows whose first neighbours are ``every`` samples apart.

    Pieces of so many rows, and the piece after, times a matrix: taps reach no farther.
    """
    channels, samples = series.shape
    rows, piece = (samples - taps.size) // every + 1, _ROWS_AT_ONCE * every
    pieces = -(-rows // _ROWS_AT_ONCE) + 1
    whole = np.zeros((channels, pieces * piece))
    whole[:, : min(samples, pieces * piece)] = series[:, : pieces * piece]
    weights = np.zeros((2 * piece, _ROWS_AT_ONCE))
    for row in range(_ROWS_AT_ONCE):
        weights[row * every : row * every + taps.size, row] = taps
    split = whole.reshape(channels, pieces, piece)
    found = split[:, :-1] @ weights[:piece] + split[:, 1:] @ weights[piece:]
    return found.reshape(channels, -1)[:, :rows]
