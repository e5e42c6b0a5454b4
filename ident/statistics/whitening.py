"""Making rows white before they are tested: Ω^-½ across joints, an AR model along time (method.md 5.3).

Residuals of real arms are correlated from row to row, which wrecks i.i.d. p-values. Feasible GLS: an AR
model per joint, its order by BIC, fitted to residuals; both sides of the regression pass through it,
recording by recording. :mod:`ident.statistics.restricted` fits it without the bias that residuals bring.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ident.ordered import distinct
from ident.statistics.tails import beyond_chi2
from robots.arrays import BoolArray, FloatArray, IntArray

_LARGEST_ORDER = 20
_LARGEST_POLE = 0.995

_NOT_WHITE = 0.001
"""Ljung-Box p-value below which the words say that the filter left something."""

_ROWS_PER_ORDER = 20
_FEWEST_ROWS = 40
"""A model of fewer is chance."""

_LARGEST_ORDER_WITH_GAPS = 6
"""Where rows are left out, every order costs so many rows after each gap."""


@dataclass(frozen=True)
class Whitening:
    """A linear filter of rows: AR coefficients and the deviation of the innovation, per joint.

    Attributes:
        kind: ``block`` (Ω alone, the paper's) or ``ar`` (AR prewhitening, then Ω of the innovations).
        coefficients: per joint, (order,) a₁…a_p of e_t = a₁e_{t−1} + … + u_t; empty for ``block``.
        sigma: (n,) standard deviation of u_t per joint, N·m (or N).
        white_p: (n,) Ljung-Box p-values of what the filter leaves of the errors; None where not computed.
    """

    kind: str
    coefficients: tuple[FloatArray, ...]
    sigma: FloatArray
    white_p: FloatArray | None = None

    @property
    def order(self) -> int:
        """The largest AR order over the joints: so many samples are lost at the start of a recording."""
        return max(len(a) for a in self.coefficients)

    def apply(self, values: FloatArray, segment: IntArray, used: BoolArray) -> FloatArray:
        """Filter samples × joints × k and stack joint by joint: (rows, k).

        Args:
            values: samples × joints × k.
            segment: (samples,) recording index; the filter never reaches across recordings.
            used: samples × joints; a filtered row needs itself and all the rows before it that it mixes.
        """
        pieces = []
        for joint, coefficients in enumerate(self.coefficients):
            for index in distinct(segment):
                chosen = segment == index
                series, whole = values[chosen, joint], unbroken(used[chosen, joint], self.order)
                filtered = series[self.order :].copy()
                for lag, a in enumerate(coefficients, start=1):
                    filtered -= a * series[self.order - lag : series.shape[0] - lag]
                pieces.append(filtered[whole] / self.sigma[joint])
        return np.concatenate(pieces)

    def joint_of_rows(self, segment: IntArray, used: BoolArray) -> IntArray:
        """(rows,) which joint each row of :meth:`apply` is of."""
        counts = [
            sum(int(unbroken(used[segment == index, joint], self.order).sum()) for index in distinct(segment))
            for joint in range(len(self.coefficients))
        ]
        return np.repeat(np.arange(len(counts)), counts)

    def describe(self) -> str:
        if self.kind == "block":
            return "Ω per joint, errors independent in time (the paper's)"
        orders = ", ".join(str(len(a)) for a in self.coefficients)
        words = f"AR prewhitening per joint (orders {orders} by BIC), Ω of the innovations"
        if self.white_p is None or self.white_p.min() >= _NOT_WHITE:
            return words
        coloured = ", ".join(f"{k + 1} (p {p:.1g})" for k, p in enumerate(self.white_p) if p < _NOT_WHITE)
        return f"{words}; not quite white are joints {coloured}, Ljung-Box"


def block_whitening(residual: FloatArray, used: BoolArray, parameters: int) -> Whitening:
    """The paper's Ω: one deviation per joint.

    Args:
        residual: samples × joints, N·m (or N).
        used: samples × joints, the rows of the fit.
        parameters: b, shared out over the joints as lost degrees of freedom.
    """
    joints = residual.shape[1]
    freedom = used.sum(axis=0) - parameters / joints
    sigma = np.sqrt(np.sum(np.where(used, residual, 0.0) ** 2, axis=0) / freedom)
    return Whitening("block", tuple(np.empty(0) for _ in range(joints)), sigma)


def autoregressive_whitening(
    residual: FloatArray, segment: IntArray, used: BoolArray, parameters: int
) -> Whitening:
    """Fit an AR model to each joint's residual, its order by BIC.

    A joint of which no row counts (a simulated loop may stand where the arm moves) has no innovation, and
    takes no order from the others.

    Args:
        residual: samples × joints, N·m (or N).
        segment: (samples,) recording index.
        used: samples × joints, the rows of the fit.
        parameters: b, shared out over the joints as lost degrees of freedom.
    """
    joints, there = residual.shape[1], used.any(axis=0)
    largest = largest_order(used[:, there]) if there.any() else 0
    coefficients, sigma = [np.empty(0) for _ in range(joints)], np.ones(joints)
    for joint in np.flatnonzero(there):
        lagged = _lagged(residual[:, joint], segment, used[:, joint], largest)
        coefficients[joint], deviation = best_process(lagged.T @ lagged, len(lagged))
        sigma[joint] = deviation * np.sqrt(len(lagged) / (len(lagged) - parameters / joints))
    return Whitening("ar", tuple(coefficients), sigma)


def largest_order(used: BoolArray) -> int:
    """The largest AR order that samples × joints of used rows allow to be tried.

    What counts are rows with as many used ones before them: gaps at every reversal leave few. 0 where even
    the first order has too few.
    """
    most = _LARGEST_ORDER if used.all() else _LARGEST_ORDER_WITH_GAPS
    for order in range(most, 0, -1):
        rows = int(unbroken(used, order).sum(axis=0).min()) + order
        if rows >= max(_ROWS_PER_ORDER * order, _FEWEST_ROWS):
            return order
    return 0


def unbroken(used: BoolArray, order: int) -> BoolArray:
    """Samples from ``order`` on that are used together with the ``order`` samples before them."""
    whole = used[order:].copy()
    for lag in range(1, order + 1):
        whole &= used[order - lag : used.shape[0] - lag]
    return whole


def best_process(products: FloatArray, count: int) -> tuple[FloatArray, float]:
    """AR coefficients of the order with the smallest BIC and the deviation of the innovation.

    All orders are compared on the same samples.

    Args:
        products: (p + 1, p + 1) sums of lagged products of a series, at lags from 0 on.
        count: of the samples that they are sums over.
    """
    left = _left(products) / count
    orders = np.arange(left.size)
    criterion = count * np.log(left) + orders * np.log(count)
    for order in np.argsort(criterion, kind="stable"):
        lags = slice(1, order + 1)
        a = np.asarray(np.linalg.solve(products[lags, lags], products[lags, 0]), dtype=np.float64)
        if not order or is_stable(a):
            return a, float(np.sqrt(left[order]))
    raise AssertionError  # order 0 is always stable


def _left(products: FloatArray) -> FloatArray:
    """Sum of squares that AR processes of order 0, 1, … leave, up to the first that leaves nothing,
    which is left out unless it is the only one.

    One Cholesky factor has those of all orders: it nests.
    """
    whole = products[0, 0]
    try:
        factor = np.linalg.cholesky(products[1:, 1:])
    except np.linalg.LinAlgError:
        return _left(products[:-1, :-1]) if products.shape[0] > 1 else np.array([whole])
    taken = np.linalg.solve(factor, products[1:, 0]) if factor.size else np.empty(0)
    left = whole - np.concatenate([[0.0], np.cumsum(taken**2)])
    spent = np.flatnonzero(left <= 0.0)
    return np.asarray(left[: max(1, spent[0])] if spent.size else left)


def is_stable(coefficients: FloatArray) -> bool:
    """All poles well inside the unit circle, so that the process has a variance.

    By the reflections of the process whose poles are so much larger, each below one (Schur and Cohn).
    """
    a = coefficients * _LARGEST_POLE ** -np.arange(1.0, coefficients.size + 1)
    while a.size:
        reflection = float(a[-1])
        if not abs(reflection) < 1.0:
            return False
        a = (a[:-1] + reflection * a[-2::-1]) / (1.0 - reflection**2)
    return True


def _lagged(series: FloatArray, segment: IntArray, used: BoolArray, largest: int) -> FloatArray:
    """Each sample that has ``largest`` unbroken samples before it, and those, nearest first."""
    pieces = []
    for index in distinct(segment):
        part = series[segment == index]
        whole = unbroken(used[segment == index], largest)
        columns = [part[largest - k : part.size - k][whole] for k in range(largest + 1)]
        pieces.append(np.column_stack(columns))
    return np.concatenate(pieces)


def lag1_autocorrelation(series: FloatArray) -> float:
    """Lag-1 autocorrelation of a series (samples,)."""
    centred = series - series.mean()
    return float(centred[1:] @ centred[:-1] / (centred @ centred))


def ljung_box(series: FloatArray, lags: int = 10, fitted: int = 0) -> tuple[float, float]:
    """Ljung-Box statistic of a series (samples,) and its p-value: is it white?

    Args:
        series: what is left by a model.
        lags: autocorrelations that are looked at; fewer where the series is short.
        fitted: the model's own coefficients; the statistic is χ²(lags − fitted).
    """
    centred = series - series.mean()
    power = centred @ centred
    samples = series.size
    lags = max(fitted + 1, min(lags, samples // 2))
    correlations = np.array([centred[k:] @ centred[:-k] / power for k in range(1, lags + 1)])
    statistic = samples * (samples + 2) * float(np.sum(correlations**2 / (samples - np.arange(1, lags + 1))))
    return statistic, beyond_chi2(statistic, lags - fitted)


_LARGEST_CORRELATION = 0.98


def cautious_whitening(residual: FloatArray, used: BoolArray, parameters: int) -> Whitening:
    """Where nothing repeats: Ω of the residual, as if it had only as many rows as are independent.

    An AR model of the residual would take slow effects for noise. With autocorrelation ρ, n rows tell as
    much about a slow effect as n (1 − ρ)/(1 + ρ) independent ones.
    """
    block = block_whitening(residual, used, parameters)
    sigma = [inflated_deviation(residual[used[:, j], j]) for j in range(residual.shape[1])]
    return replace(block, sigma=np.array(sigma))


def inflated_deviation(series: FloatArray) -> float:
    """Deviation of a series (rows,), as if it had only as many rows as are independent."""
    correlation = min(max(lag1_autocorrelation(series), 0.0), _LARGEST_CORRELATION)
    return float(np.sqrt(np.mean(series**2) * (1 + correlation) / (1 - correlation)))
