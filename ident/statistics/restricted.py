"""AR errors of a regression from its residuals, without the bias that residuals have.

Residuals r = y − Xβ̂ are what b columns leave of the errors e. Slow columns take slow errors with them, so an
AR model of r forgets too fast, and a test on rows that it whitens rejects too often. With the weighted basis
U of X and the covariance Γ of the errors what was taken is known in mean,

    E(rrᵀ) = Γ − UUᵀΓ − ΓUUᵀ + U(UᵀΓU)Uᵀ,

so the products of residuals, plus those that a model says are missing, give the next model, until it stands
still. To first order these are the equations of restricted maximum likelihood (Patterson and Thompson 1971;
Cheang and Reinsel 2000). Those take r by generalised least squares; here it is by weighted least squares:
whitening dims the motion and leaves the noise of its derivatives, which pulls β̂ towards zero; what β̂ then
leaves of the motion in r makes the next model slower still, and so on without end.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ident.ordered import distinct
from ident.preparation.row_memory import torques_of
from ident.statistics.covariance import autocovariance
from ident.statistics.lagged_products import lagged_products, samples_without_gap
from ident.statistics.symmetric import eigen_of
from ident.statistics.taken import DEPENDENT, Taken, fit_of
from ident.statistics.whitening import (
    Whitening,
    autoregressive_whitening,
    best_process,
    block_whitening,
    largest_order,
    ljung_box,
)
from robots.arrays import BoolArray, FloatArray, IntArray

_ITERATIONS = 30
_STILL = 1e-4
"""Change of a coefficient at which the steps end; its standard deviation, 1/√samples, is far more."""

_ORDERS_BEYOND = 4
"""Orders that are tried beyond the one that the residuals themselves ask for."""

_MOST_SAMPLES = 20_000
"""Of which a model of the errors is made."""
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
    target, regressor, segment, used = of_the_errors(target, regressor, segment, used)
    omega = independent_whitening(target, regressor, segment, used)
    beta, taken = fit_of(omega, target, regressor, segment, used)
    residual = target - torques_of(regressor, beta)
    whitening = autoregressive_whitening(residual, segment, used, regressor.shape[2])
    largest = min(largest_order(used), max(a.size for a in whitening.coefficients) + _ORDERS_BEYOND)
    products = [
        lagged_products(residual[:, j], residual[:, j], segment, used[:, j], largest) for j in _axes(used)
    ]
    counts = [samples_without_gap(segment, used[:, j], largest) for j in _axes(used)]
    for _ in range(_ITERATIONS):
        missing = _missing(whitening, taken, omega.sigma, segment, used, largest)
        before, whitening = whitening, _model(products, missing, counts)
        if _change(before, whitening) < _STILL:
            break
    return replace(whitening, white_p=_whiteness(whitening, residual, segment, used))


def of_the_errors(
    target: FloatArray, regressor: FloatArray, segment: IntArray, used: BoolArray
) -> tuple[FloatArray, FloatArray, IntArray, BoolArray]:
    """The rows that a model of the errors is fitted to: all, or of hours whole recordings spread over them.

    An AR coefficient is known to one over the root of the samples: 0.7 % at so many. More would cost memory
    for six copies of the rows and change no deviation by as much.

    Args:
        target, regressor, segment, used: as of :func:`regression_whitening`.
    """
    names = distinct(segment)
    count = max(1, _MOST_SAMPLES * names.size // max(segment.size, 1))
    if count >= names.size:
        return target, regressor, segment, used
    places = np.linspace(0, names.size - 1, count).round().astype(int)
    rows = np.isin(segment, names[places])
    return target[rows], regressor[rows], segment[rows], used[rows]


def independent_whitening(
    target: FloatArray, regressor: FloatArray, segment: IntArray, used: BoolArray
) -> Whitening:
    """The paper's Ω: one deviation per joint, of the residuals of weighted least squares.

    Args:
        target, regressor, segment, used: as of :func:`regression_whitening`.
    """
    whitening = _start(target, used)
    parts = _normal_parts(target, regressor, used)
    for _ in range(2):
        beta = _beta_of(whitening.sigma, *parts)
        whitening = block_whitening(target - torques_of(regressor, beta), used, regressor.shape[2])
    return whitening


def _normal_parts(
    target: FloatArray, regressor: FloatArray, used: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """XᵀX (joints × b × b) and Xᵀy (joints × b) of each joint alone: weights come in afterwards."""
    joints, columns = used.shape[1], regressor.shape[2]
    squares, shares = np.empty((joints, columns, columns)), np.empty((joints, columns))
    for joint in _axes(used):
        x = regressor[used[:, joint], joint]
        squares[joint], shares[joint] = x.T @ x, x.T @ target[used[:, joint], joint]
    return squares, shares


def _beta_of(sigma: FloatArray, squares: FloatArray, shares: FloatArray) -> FloatArray:
    """β̂ (b,) with one deviation per joint, as of :func:`fit_of`."""
    whole = np.einsum("j,jkl->kl", sigma**-2.0, squares)
    scale = np.sqrt(np.diag(whole))
    scale[scale == 0.0] = 1.0
    values, directions = eigen_of(whole / np.outer(scale, scale))
    held = values > DEPENDENT * values[-1]
    root = directions[:, held] / np.sqrt(values[held])
    return np.asarray((root @ (root.T @ (sigma**-2.0 @ shares / scale))) / scale)


def _axes(used: BoolArray) -> range:
    return range(used.shape[1])


def _start(target: FloatArray, used: BoolArray) -> Whitening:
    """Each joint weighed by the size of its torque."""
    size = np.sqrt(np.sum(np.where(used, target, 0.0) ** 2, axis=0) / used.sum(axis=0))
    empty = tuple(np.empty(0) for _ in range(target.shape[1]))
    return Whitening("block", empty, np.where(size > 0, size, 1.0))


def _missing(
    whitening: Whitening,
    taken: Taken,
    omega: FloatArray,
    segment: IntArray,
    used: BoolArray,
    largest: int,
) -> list[FloatArray]:
    """Per joint: lagged products of e that the fit has taken from those of r, if the model is right."""

    def covariance(joint: int, lags: int) -> FloatArray:
        sigma = float(whitening.sigma[joint] / omega[joint])
        return autocovariance(whitening.coefficients[joint], sigma, lags)

    found = []
    for joint, (one, other) in enumerate(zip(taken.columns, taken.from_errors(covariance), strict=True)):
        half = lagged_products(omega[joint] ** 2 * one, other, segment, used[:, joint], largest)
        found.append(half + half.T)
    return found


def _model(products: list[FloatArray], missing: list[FloatArray], counts: list[int]) -> Whitening:
    """The AR process of each joint's products with what the fit has taken from them.

    Over all rows a fit takes energy away; over those alone that have no gap behind them a slow process may be
    said to have been given some, more than there is. Then the products count as they are.
    """
    whole = [
        one + other if one[0, 0] + other[0, 0] > 0.0 else one
        for one, other in zip(products, missing, strict=True)
    ]
    fits = [best_process(one, count) for one, count in zip(whole, counts, strict=True)]
    return Whitening("ar", tuple(a for a, _ in fits), np.array([sigma for _, sigma in fits]))


def _change(before: Whitening, after: Whitening) -> float:
    """Largest change of a coefficient; one that is new or gone counts in full."""
    order = max(before.order, after.order)
    pairs = zip(before.coefficients, after.coefficients, strict=True)
    padded = [np.pad(a, (0, order - a.size)) - np.pad(b, (0, order - b.size)) for a, b in pairs]
    return float(max(np.abs(difference).max(initial=0.0) for difference in padded))


def _whiteness(whitening: Whitening, residual: FloatArray, segment: IntArray, used: BoolArray) -> FloatArray:
    """Ljung-Box p-value per joint of what the filter leaves of the residuals."""
    found = []
    for joint, coefficients in enumerate(whitening.coefficients):
        alone = Whitening("ar", (coefficients,), whitening.sigma[joint : joint + 1])
        left = alone.apply(residual[:, joint, np.newaxis, np.newaxis], segment, used[:, joint, np.newaxis])
        found.append(ljung_box(left[:, 0], _LAGS_LEFT, coefficients.size)[1])
    return np.array(found)
