"""The noise ε: an AR model per joint, from what does not repeat or from innovations beside the misfit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from ident.discrepancy.by_evidence.evidence.filtered import filtered
from ident.statistics.whitening import is_stable, largest_order, unbroken
from robots.arrays import BoolArray, FloatArray, IntArray

_ORDER = 4
"""Of the AR model where nothing repeats."""

_LEAST_FREEDOM = 20.0

_SMALLEST = 1e-12
"""N·m (or N), of a deviation: data without any noise."""

_MEMORY = 500
"""Rows after which an AR process has forgotten."""


@dataclass(frozen=True)
class Noise:
    """Of one joint.

    Attributes:
        coefficients: (order,) of e_t = a₁ e_{t−1} + … + u_t.
        deviation: of u_t, N·m (or N).
    """

    coefficients: FloatArray
    deviation: float

    @cached_property
    def taps(self) -> FloatArray:
        """(order + 1,) the filter that makes e_t white, of unit variance."""
        return np.asarray(np.concatenate([[1.0], -self.coefficients]) / self.deviation)

    @property
    def marginal(self) -> float:
        """Deviation of e_t, N·m (or N)."""
        impulse = np.zeros(_MEMORY)
        impulse[0] = self.deviation
        response = lfilter([1.0], np.concatenate([[1.0], -self.coefficients]), impulse)
        return float(np.linalg.norm(response))


@dataclass(frozen=True)
class Whitener:
    """Rows of one joint through its AR filter, recording by recording; rows with a gap behind them go.

    Attributes:
        noise: of the joint.
        chosen: (N,) rows that are used with all before them that they mix.
    """

    noise: Noise
    chosen: IntArray

    @classmethod
    def of(cls, noise: Noise, segment: IntArray, used: BoolArray) -> Whitener:
        """For rows with recording numbers (rows,) of which some are used (rows,)."""
        order = noise.coefficients.size
        chosen = [np.zeros(0, dtype=np.int64)]
        for index in np.unique(segment):
            rows = np.flatnonzero(segment == index)
            whole = unbroken(used[rows], order) if order else used[rows]
            chosen.append(rows[order:][whole])
        return cls(noise, np.concatenate(chosen))

    def __call__(self, values: FloatArray) -> FloatArray:
        """Rows × k of all recordings as white rows of unit variance (N, k)."""
        white = filtered(values[:, np.newaxis], 0, self.chosen, self.noise.taps)
        return np.zeros((self.chosen.size, values.shape[1])) if white is None else np.asarray(white)

    def effect(
        self, columns: FloatArray, joint: int, scale: FloatArray, single: bool, least: float = 0.0
    ) -> FloatArray | NDArray[np.float32] | None:
        """White columns (N, p) of an effect, rows × joints × p, at a joint; see :func:`filtered`."""
        return filtered(columns, joint, self.chosen, self.noise.taps, scale, single, least)

    def back(self, white: FloatArray, rows: int) -> FloatArray:
        """(rows,) what white rows (N,) come to at the rows before whitening: the adjoint, Wᵀ."""
        spread = np.zeros(rows)
        spread[self.chosen] = white
        return np.asarray(lfilter(self.noise.taps, [1.0], spread[::-1])[::-1])


def autoregressive(series: FloatArray, segment: IntArray, used: BoolArray, lost: float = 0.0) -> Noise:
    """AR model of a residual (rows,): least squares over rows without gaps.

    Args:
        series: of one joint, N·m (or N).
        segment: (rows,) recording numbers.
        used: (rows,) which rows count.
        lost: degrees of freedom that the residual has less than rows.
    """
    order = min(_ORDER, largest_order(used[:, np.newaxis]))
    target, lagged = _lagged(series, segment, used, order)
    if target.size == 0:
        return Noise(np.zeros(0), 1.0)
    coefficients = np.zeros(0)
    while order:
        coefficients = np.asarray(np.linalg.lstsq(lagged[:, :order], target, rcond=None)[0])
        if is_stable(coefficients):
            break
        order -= 1
        coefficients = np.zeros(0)
    error = target - lagged[:, :order] @ coefficients
    freedom = max(target.size - lost, _LEAST_FREEDOM)
    return Noise(coefficients, max(float(np.sqrt(error @ error / freedom)), _SMALLEST))


def _lagged(
    series: FloatArray, segment: IntArray, used: BoolArray, order: int
) -> tuple[FloatArray, FloatArray]:
    """Rows that have ``order`` unbroken ones before them, and those, nearest first."""
    targets, lags = [], []
    for index in np.unique(segment):
        part, chosen = series[segment == index], used[segment == index]
        whole = unbroken(chosen, order) if order else chosen
        targets.append(part[order:][whole])
        before = [part[order - k : part.size - k][whole] for k in range(1, order + 1)]
        lags.append(np.stack(before, axis=1) if before else np.zeros((int(whole.sum()), 0)))
    return np.concatenate(targets), np.concatenate(lags)
