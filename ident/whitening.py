"""Making rows white before they are tested: Ω^-½ across joints, an AR model along time (METHOD 5.3).

Residuals of real arms are correlated from row to row, which wrecks i.i.d. p-values. Feasible GLS: an AR
model per joint, its order by BIC, fitted to residuals; both sides of the regression pass through it,
recording by recording.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scipy.stats import chi2

from robots.arrays import FloatArray, IntArray

_LARGEST_ORDER = 20


@dataclass(frozen=True)
class Whitening:
    """A linear filter of rows: AR coefficients and the deviation of the innovation, per joint.

    Attributes:
        kind: ``block`` (Ω alone, the paper's) or ``ar`` (AR prewhitening, then Ω of the innovations).
        coefficients: per joint, (order,) a₁…a_p of e_t = a₁e_{t−1} + … + u_t; empty for ``block``.
        sigma: (n,) standard deviation of u_t per joint, N·m (or N).
    """

    kind: str
    coefficients: tuple[FloatArray, ...]
    sigma: FloatArray

    @property
    def order(self) -> int:
        """The largest AR order over the joints: so many samples are lost at the start of a recording."""
        return max(len(a) for a in self.coefficients)

    def apply(self, values: FloatArray, segment: IntArray) -> FloatArray:
        """Filter samples × joints × k and stack joint by joint: (rows, k).

        Args:
            values: samples × joints × k.
            segment: (samples,) recording index; the filter never reaches across recordings.
        """
        order = self.order
        pieces = []
        for joint, coefficients in enumerate(self.coefficients):
            for index in np.unique(segment):
                series = values[segment == index, joint]
                filtered = series[order:].copy()
                for lag, a in enumerate(coefficients, start=1):
                    filtered -= a * series[order - lag : series.shape[0] - lag]
                pieces.append(filtered / self.sigma[joint])
        return np.concatenate(pieces)

    def describe(self) -> str:
        if self.kind == "block":
            return "Ω per joint, errors independent in time (the paper's)"
        orders = ", ".join(str(len(a)) for a in self.coefficients)
        return f"AR prewhitening per joint (orders {orders} by BIC), Ω of the innovations"


def block_whitening(residual: FloatArray, parameters: int) -> Whitening:
    """The paper's Ω: one deviation per joint.

    Args:
        residual: samples × joints, N·m (or N).
        parameters: b, shared out over the joints as lost degrees of freedom.
    """
    samples, joints = residual.shape
    sigma = np.sqrt(np.sum(residual**2, axis=0) / (samples - parameters / joints))
    return Whitening("block", tuple(np.empty(0) for _ in range(joints)), sigma)


def autoregressive_whitening(residual: FloatArray, segment: IntArray, parameters: int) -> Whitening:
    """Fit an AR model to each joint's residual, its order by BIC.

    Args:
        residual: samples × joints, N·m (or N).
        segment: (samples,) recording index.
        parameters: b, shared out over the joints as lost degrees of freedom.
    """
    largest = min(_LARGEST_ORDER, residual.shape[0] // 20)
    coefficients = [_best_ar(residual[:, joint], segment, largest) for joint in range(residual.shape[1])]
    draft = Whitening("ar", tuple(coefficients), np.ones(residual.shape[1]))
    innovations = draft.apply(residual[:, :, np.newaxis], segment).reshape(residual.shape[1], -1)
    freedom = innovations.shape[1] - parameters / residual.shape[1]
    sigma = np.sqrt(np.sum(innovations**2, axis=1) / freedom)
    return Whitening("ar", tuple(coefficients), sigma)


def _best_ar(series: FloatArray, segment: IntArray, largest: int) -> FloatArray:
    """AR coefficients of the order with the smallest BIC, all orders compared on the same samples."""
    target, lagged = _lagged(series, segment, largest)
    best, smallest = np.empty(0), target.size * np.log(np.mean(target**2))
    for order in range(1, largest + 1):
        a = np.linalg.lstsq(lagged[:, :order], target, rcond=None)[0]
        error = target - lagged[:, :order] @ a
        bic = target.size * np.log(np.mean(error**2)) + order * np.log(target.size)
        if bic < smallest:
            best, smallest = a, bic
    return best


def _lagged(series: FloatArray, segment: IntArray, largest: int) -> tuple[FloatArray, FloatArray]:
    targets, lags = [], []
    for index in np.unique(segment):
        part = series[segment == index]
        targets.append(part[largest:])
        columns = [part[largest - k : part.size - k] for k in range(1, largest + 1)]
        lags.append(np.column_stack(columns) if columns else np.empty((part.size, 0)))
    return np.concatenate(targets), np.concatenate(lags)


def lag1_autocorrelation(residual: FloatArray) -> FloatArray:
    """Lag-1 autocorrelation of each joint's residual (samples × joints), (n,)."""
    centred = residual - residual.mean(axis=0)
    return np.asarray(np.sum(centred[1:] * centred[:-1], axis=0) / np.sum(centred**2, axis=0))


def ljung_box(series: FloatArray, lags: int = 10) -> tuple[float, float]:
    """Ljung-Box statistic of a series (samples,) and its p-value against χ²(lags): is it white?"""
    centred = series - series.mean()
    power = centred @ centred
    samples = series.size
    correlations = np.array([centred[k:] @ centred[:-k] / power for k in range(1, lags + 1)])
    statistic = samples * (samples + 2) * float(np.sum(correlations**2 / (samples - np.arange(1, lags + 1))))
    return statistic, float(chi2.sf(statistic, lags))
