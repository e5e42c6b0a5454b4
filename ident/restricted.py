"""AR errors of a regression by restricted maximum likelihood.

Sources: Patterson and Thompson 1971; Cheang and Reinsel 2000.

Residuals r = y − Xβ̂ are what b columns leave of the errors e. Slow columns take slow errors with them, so an
AR model of r forgets too fast, and a test on rows that it whitens rejects too often. What was taken is known
in mean: with β̂ by GLS, E(eeᵀ | y) = rrᵀ + X(XᵀΓ⁻¹X)⁻¹Xᵀ. Fitting the AR model to these expected products,
then β̂ again, is the EM algorithm of restricted maximum likelihood.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ident.whitening import (
    Whitening,
    autoregressive_whitening,
    block_whitening,
    is_stable,
    largest_order,
    ljung_box,
    unbroken,
)
from robots.arrays import BoolArray, FloatArray, IntArray

_ITERATIONS = 50
_STILL = 1e-4
"""Change of a coefficient at which the EM steps end; its standard deviation, 1/√samples, is far more."""

_ORDERS_BEYOND = 4
"""Orders that are tried beyond the one that the residuals themselves ask for."""

_DEPENDENT = 1e-12
"""Eigenvalues of the scaled XᵀΓ⁻¹X below this share of the largest are no information."""

_COLUMNS_AT_ONCE = 16
"""Columns whose lagged products are summed together: bounds the memory."""

_LAGS_LEFT = 30


def regression_whitening(
    target: FloatArray, regressor: FloatArray, segment: IntArray, used: BoolArray
) -> Whitening:
    """The AR process per joint of the errors of target = regressor · β + e.

    Args:
        target: samples × joints, N·m (or N); torques, or residuals of any estimate on the same columns.
        regressor: samples × joints × b; one β for all joints. Columns may depend on one another.
        segment: (samples,) recording index.
        used: samples × joints, the rows of the fit.
    """
    whitening = independent_whitening(target, regressor, segment, used)
    residual = _solve(whitening, target, regressor, segment, used)[0]
    whitening = autoregressive_whitening(residual, segment, used, regressor.shape[2])
    largest = min(largest_order(used), max(a.size for a in whitening.coefficients) + _ORDERS_BEYOND)
    for _ in range(_ITERATIONS):
        residual, taken = _solve(whitening, target, regressor, segment, used)
        before, whitening = whitening, _expected_fit(residual, taken, segment, used, largest)
        if _change(before, whitening) < _STILL:
            break
    return replace(whitening, white_p=_whiteness(whitening, residual, segment, used))


def independent_whitening(
    target: FloatArray, regressor: FloatArray, segment: IntArray, used: BoolArray
) -> Whitening:
    """The paper's Ω: one deviation per joint, of the residuals of weighted least squares.

    Args:
        target, regressor, segment, used: as of :func:`regression_whitening`.
    """
    whitening = _start(target, used)
    for _ in range(2):
        residual = _solve(whitening, target, regressor, segment, used)[0]
        whitening = block_whitening(residual, used, regressor.shape[2])
    return whitening


def _start(target: FloatArray, used: BoolArray) -> Whitening:
    """Each joint weighed by the size of its torque."""
    size = np.sqrt(np.sum(np.where(used, target, 0.0) ** 2, axis=0) / used.sum(axis=0))
    empty = tuple(np.empty(0) for _ in range(target.shape[1]))
    return Whitening("block", empty, np.where(size > 0, size, 1.0))


def _solve(
    whitening: Whitening, target: FloatArray, regressor: FloatArray, segment: IntArray, used: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """GLS residual (samples × joints) and W (samples × joints × b') with WWᵀ = X(XᵀΓ⁻¹X)⁻¹Xᵀ."""
    y = whitening.apply(target[:, :, np.newaxis], segment, used)[:, 0]
    x = whitening.apply(regressor, segment, used)
    scale = np.linalg.norm(x, axis=0)
    scale[scale == 0.0] = 1.0
    x /= scale
    values, directions = np.linalg.eigh(x.T @ x)
    held = values > _DEPENDENT * values[-1]
    root = directions[:, held] / np.sqrt(values[held])
    basis = root / scale[:, np.newaxis]
    beta = basis @ (root.T @ (x.T @ y))
    return target - regressor @ beta, np.asarray(regressor @ basis)


def _change(before: Whitening, after: Whitening) -> float:
    """Largest change of a coefficient; one that is new or gone counts in full."""
    order = max(before.order, after.order)
    pairs = zip(before.coefficients, after.coefficients, strict=True)
    padded = [np.pad(a, (0, order - a.size)) - np.pad(b, (0, order - b.size)) for a, b in pairs]
    return float(max(np.abs(difference).max(initial=0.0) for difference in padded))


def _expected_fit(
    residual: FloatArray, taken: FloatArray, segment: IntArray, used: BoolArray, largest: int
) -> Whitening:
    """AR model per joint of the errors whose expected products are residual's own plus those of ``taken``."""
    coefficients, sigma = [], np.empty(residual.shape[1])
    for joint in range(residual.shape[1]):
        present = taken[:, joint, np.any(taken[:, joint] != 0.0, axis=0)]
        columns = np.column_stack([residual[:, joint], present])
        products, count = _lagged_products(columns, segment, used[:, joint], largest)
        a, sigma[joint] = _best_of_products(products, count)
        coefficients.append(a)
    return Whitening("ar", tuple(coefficients), sigma)


def _lagged_products(
    columns: FloatArray, segment: IntArray, used: BoolArray, largest: int
) -> tuple[FloatArray, int]:
    """Σ over columns and samples of s_{t−k}s_{t−l}, k, l = 0 … largest, and the number of samples."""
    products, count = np.zeros((largest + 1, largest + 1)), 0
    for index in np.unique(segment):
        series = columns[segment == index]
        whole = unbroken(used[segment == index], largest)
        count += int(whole.sum())
        for start in range(0, series.shape[1], _COLUMNS_AT_ONCE):
            part = series[:, start : start + _COLUMNS_AT_ONCE]
            lagged = np.stack(
                [part[largest - k : part.shape[0] - k][whole].ravel() for k in range(largest + 1)], axis=1
            )
            products += lagged.T @ lagged
    return products, count


def _best_of_products(products: FloatArray, count: int) -> tuple[FloatArray, float]:
    """AR coefficients of the order with the smallest BIC and the deviation of the innovation."""
    best: FloatArray = np.empty(0)
    variance = products[0, 0] / count
    smallest = count * np.log(variance)
    for order in range(1, products.shape[0]):
        lags = slice(1, order + 1)
        a = np.asarray(np.linalg.solve(products[lags, lags], products[lags, 0]), dtype=np.float64)
        left = (products[0, 0] - a @ products[lags, 0]) / count
        bic = count * np.log(left) + order * np.log(count)
        if bic < smallest and is_stable(a):
            best, smallest, variance = a, bic, left
    return best, float(np.sqrt(variance))


def _whiteness(whitening: Whitening, residual: FloatArray, segment: IntArray, used: BoolArray) -> FloatArray:
    """Ljung-Box p-value per joint of what the filter leaves of the residuals."""
    found = []
    for joint, coefficients in enumerate(whitening.coefficients):
        alone = Whitening("ar", (coefficients,), whitening.sigma[joint : joint + 1])
        left = alone.apply(residual[:, joint, np.newaxis, np.newaxis], segment, used[:, joint, np.newaxis])
        found.append(ljung_box(left[:, 0], _LAGS_LEFT, coefficients.size)[1])
    return np.array(found)
