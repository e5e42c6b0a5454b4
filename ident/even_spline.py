"""Cubic splines through evenly spaced samples, without a knot at the second and the last but one.

The second derivatives of such a spline solve a tridiagonal system with the same numbers in every row, and a
value is a sum of two samples and two second derivatives: half the memory of a list of polynomials.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from ident.recursive_filter import RecursiveFilter
from robots.arrays import FloatArray, IntArray

_POLE = np.sqrt(3.0) - 2.0
_INVERSE = RecursiveFilter(float(np.sqrt(-_POLE)), np.array([_POLE + 0.0j]), 0)
_HEARD = 32
"""Samples beyond which one has no share in another: the pole's power is 10⁻¹⁸."""

_PLACES_AT_ONCE = 4096
"""What is computed for so many stays in the cache."""

_BENT = 3
"""Samples of which a spline is more than a line."""


class EvenSpline:
    """A cubic spline through samples × channels; places are counted in samples."""

    def __init__(self, values: FloatArray) -> None:
        """
        Args:
            values: two or more samples × channels.
        """
        self._values = values
        self._bend = _second_derivatives(values)

    def at(self, place: FloatArray) -> FloatArray:
        """Values at places (m,), m × channels; beyond the ends by the first and the last cubic."""
        return self._piece_by_piece(self._values_at, place)

    def with_between(self, parts: int) -> FloatArray:
        """Values at the samples and at ``parts`` − 1 even places between each two of them, in their order."""
        y, bend = self._values, self._bend
        found = np.empty((parts * (y.shape[0] - 1) + 1, *y.shape[1:]))
        found[::parts] = y
        for number in range(1, parts):
            part = number / parts
            rest = 1.0 - part
            found[number::parts] = rest * y[:-1] + part * y[1:]
            found[number::parts] += ((rest**3 - rest) / 6.0) * bend[:-1]
            found[number::parts] += ((part**3 - part) / 6.0) * bend[1:]
        return found

    def _values_at(self, k: IntArray, part: FloatArray) -> FloatArray:
        rest, y, bend = 1.0 - part, self._values, self._bend
        found = rest * y.take(k, 0) + part * y.take(k + 1, 0)
        found += ((rest**3 - rest) / 6.0) * bend.take(k, 0)
        found += ((part**3 - part) / 6.0) * bend.take(k + 1, 0)
        return found

    def slopes(self) -> FloatArray:
        """Derivatives at the samples, per sample."""
        y, bend = self._values, self._bend
        found = np.empty_like(bend)
        found[:-1] = np.diff(y, axis=0) - (2.0 * bend[:-1] + bend[1:]) / 6.0
        found[-1] = y[-1] - y[-2] + (bend[-2] + 2.0 * bend[-1]) / 6.0
        return found

    def integral(self, place: FloatArray) -> FloatArray:
        """From the first sample to places (m,), m × channels, in units times samples."""
        return self._piece_by_piece(self._integrals_to, place)

    def _integrals_to(self, k: IntArray, part: FloatArray) -> FloatArray:
        rest, y, bend = 1.0 - part, self._values, self._bend
        found = (
            self._whole.take(k, 0)
            + (part - 0.5 * part**2) * y.take(k, 0)
            + (0.5 * part**2) * y.take(k + 1, 0)
        )
        found += ((1.0 - rest**4 - 2.0 * (1.0 - rest**2)) / 24.0) * bend.take(k, 0)
        found += ((part**4 - 2.0 * part**2) / 24.0) * bend.take(k + 1, 0)
        return found

    def _piece_by_piece(
        self, evaluate: Callable[[IntArray, FloatArray], FloatArray], place: FloatArray
    ) -> FloatArray:
        """What is found for the sample before each place, and how far that is beyond it."""
        found = np.empty((place.size, *self._values.shape[1:]))
        for start in range(0, place.size, _PLACES_AT_ONCE):
            some = place[start : start + _PLACES_AT_ONCE]
            k = np.clip(np.floor(some).astype(np.int64), 0, self._values.shape[0] - 2)
            found[start : start + some.size] = evaluate(k, (some - k)[:, np.newaxis])
        return found

    @cached_property
    def _whole(self) -> FloatArray:
        """Integrals up to each sample but the last."""
        y, bend = self._values, self._bend
        each = 0.5 * (y[:-1] + y[1:]) - (bend[:-1] + bend[1:]) / 24.0
        return np.concatenate([np.zeros_like(each[:1]), np.cumsum(each[:-1], axis=0)])


def _second_derivatives(values: FloatArray) -> FloatArray:
    """Per squared sample, samples × channels."""
    bend = np.zeros_like(values, dtype=np.float64)
    if values.shape[0] < _BENT:
        return bend
    second = np.diff(values, 2, axis=0)
    bend[1], bend[-2] = second[0], second[-1]
    inner = values.shape[0] - 4
    if inner > 0:
        right = 6.0 * second[1:-1]
        right[0] -= bend[1]
        right[-1] -= bend[-2]
        bend[2:-2] = _solved(right)
    if values.shape[0] == _BENT:
        bend[:] = second
    else:
        bend[0], bend[-1] = 2.0 * bend[1] - bend[2], 2.0 * bend[-2] - bend[-3]
    return bend


def _solved(right: FloatArray) -> FloatArray:
    """Of a tridiagonal system with 4 on the diagonal and 1 beside it.

    Its rows say that ``right`` is a filter of the solution with a pole and a zero to either side, so the
    solution is a filter both ways of ``right``, which goes on beyond both ends with the other sign.
    """
    samples = right.shape[0]
    if samples <= _HEARD:
        beside = np.eye(samples, k=1)
        return np.asarray(np.linalg.solve(4.0 * np.eye(samples) + beside + beside.T, right))
    none = np.zeros_like(right[:1])
    parts = (-right[_HEARD - 1 :: -1], none, right, none, -right[: -_HEARD - 1 : -1])
    whole = _INVERSE.both_ways(np.concatenate(parts).T, 0)
    return np.asarray(whole[:, _HEARD + 1 : -_HEARD - 1].T)
