"""The autocovariance of errors where rows are left out: lagged products under a window.

A filter needs unbroken rows, so a whitening has a low order where every reversal is a gap, and torque behind
a low-pass has a spectrum with an edge, which six coefficients do not follow: the density at the slow end,
where the motion is, comes out up to 40 % too small. A variance needs no filter. Each pair of rows tells of
the autocovariance, whatever lies between them; lags beyond the memory are noise and are windowed away
(Politis and Romano 1995), the memory being read off the correlogram (Politis 2003).

Errors that forget exponentially have a tail below what a correlogram shows, a tenth of the variance where
they remember 50 ms of 12 s. So the window is put on what an AR(1) filter leaves of the autocovariance, and
the result filtered back (prewhitening, Andrews and Monahan 1992): on numbers, so that it needs no unbroken
rows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.ordered import distinct
from ident.preparation.row_memory import torques_of
from ident.statistics.restricted import independent_whitening, of_the_errors
from ident.statistics.taken import Taken, fit_of
from ident.statistics.toeplitz import ComplexArray, circle, forms, spectrum
from robots.arrays import BoolArray, FloatArray, IntArray

_LONGEST = 200
"""Rows; no memory is looked for beyond, nor beyond a quarter of the rows."""

_QUIET = 5
"""So many lags in a row without correlation end the memory."""

_LARGEST_ROOT = 0.97
"""Of the AR(1); Andrews and Monahan's, so that what is filtered back stays finite."""

_STILL = 0.01
"""Deviations of an autocovariance; a smaller change ends the steps."""

_STEPS = 4
"""Of what the fit has taken from the errors; each changes the last by a share of parameters in rows."""


def windowed_autocovariance(
    target: FloatArray, regressor: FloatArray, segment: IntArray, used: BoolArray
) -> tuple[FloatArray, ...]:
    """Autocovariances γ₀, γ₁, … per joint of the errors of target = regressor · β + e.

    What the fit has taken from the errors is added, as :mod:`ident.statistics.restricted` does for AR models.

    Args:
        target: samples × joints, N·m (or N); torques, or residuals of any estimate on the same columns.
        regressor: samples × joints × b.
        segment: (samples,) recording index.
        used: samples × joints, the rows of the fit.
    """
    target, regressor, segment, used = of_the_errors(target, regressor, segment, used)
    omega = independent_whitening(target, regressor, segment, used)
    beta, taken = fit_of(omega, target, regressor, segment, used)
    residual = np.where(used, target - torques_of(regressor, beta), 0.0)[:, :, np.newaxis]
    longest = max(1, min(_LONGEST, int(used.sum(axis=0).min()) // 4))
    joints = range(used.shape[1])
    present = used.astype(np.float64)[:, :, np.newaxis]
    pairs = [np.maximum(_lagged(present[:, j], present[:, j], taken.pieces, longest), 1.0) for j in joints]
    seen = [_lagged(residual[:, j], residual[:, j], taken.pieces, longest) for j in joints]
    gamma = tuple(_windowed(one / count, count[0]) for one, count in zip(seen, pairs, strict=True))
    for _ in range(_STEPS):
        hidden = _hidden(gamma, taken, omega.sigma, used, longest)
        whole = zip(seen, hidden, pairs, strict=True)
        before = gamma
        gamma = tuple(_windowed((one + other) / count, count[0]) for one, other, count in whole)
        steps = zip(before, gamma, pairs, strict=True)
        if all(_stands(old, new, float(count[0])) for old, new, count in steps):
            break
    return gamma


def variances(weights: FloatArray, gamma: tuple[FloatArray, ...], segment: IntArray) -> FloatArray:
    """Variances (b,) of Σ weights · e, errors of different joints and recordings being independent.

    Args:
        weights: samples × joints × b, zero where a row is left out.
        gamma: autocovariances per joint, as far as they go; zero beyond.
        segment: (samples,) recordings.
    """
    total = np.zeros(weights.shape[2])
    for joint, covariance in enumerate(gamma):
        for index in distinct(segment):
            part = weights[segment == index, joint]
            total += forms(_padded(covariance, part.shape[0]), spectrum(part))
    return np.maximum(total, 0.0)


def _stands(before: FloatArray, after: FloatArray, rows: float) -> bool:
    """Whether no autocovariance has changed by a good part of its own deviation, γ₀/√rows."""
    return bool(np.abs(after - before).max() <= _STILL * after[0] / np.sqrt(rows))


def _padded(gamma: FloatArray, lags: int) -> FloatArray:
    found = np.zeros(lags)
    count = min(lags, gamma.size)
    found[:count] = gamma[:count]
    return found


def _lagged(
    one: FloatArray | Sequence[ComplexArray], other: FloatArray, pieces: tuple[slice, ...], longest: int
) -> FloatArray:
    """½ Σ (a_t·b_{t−k} + b_t·a_{t−k}) within recordings and over columns, k = 0 … longest.

    Of ``one`` the spectra, piece by piece, will do.
    """
    sums = np.zeros(longest + 1)
    for number, chosen in enumerate(pieces):
        samples = chosen.stop - chosen.start
        first = spectrum(one[chosen]) if isinstance(one, np.ndarray) else one[number]
        second = first if one is other else spectrum(other[chosen])
        density = np.sum(first.real * second.real + first.imag * second.imag, axis=1)
        count = min(longest + 1, samples)
        sums[:count] += np.fft.irfft(density, circle(samples))[:count]
    return sums


def _windowed(gamma: FloatArray, rows: float) -> FloatArray:
    """Of what an AR(1) leaves: flat to the end of the memory, then straight down to zero at twice that."""
    if gamma[0] <= 0.0 or gamma.size < 3:
        return np.asarray(gamma * (np.arange(gamma.size) == 0))
    root = float(np.clip(gamma[1] / gamma[0], -_LARGEST_ROOT, _LARGEST_ROOT))
    before = np.concatenate([gamma[1:2], gamma[:-2]])
    white = (1.0 + root**2) * gamma[:-1] - root * (before + gamma[1:])
    memory = max(1, memory_of(white / white[0], rows)) if white[0] > 0.0 else 1
    white = white * np.clip(2.0 - np.arange(white.size) / memory, 0.0, 1.0)
    both = np.concatenate([white[:0:-1], white])
    answer = root ** np.abs(np.arange(-2 * gamma.size, 2 * gamma.size + 1)) / (1.0 - root**2)
    start = 2 * gamma.size + white.size - 1
    return np.asarray(np.convolve(both, answer)[start : start + gamma.size])


def memory_of(correlation: FloatArray, rows: float) -> int:
    """The last lag before so many quiet ones: |ρ| < 2·√(log₁₀ r / r), by Politis' rule (2003).

    Args:
        correlation: ρ₀ = 1, ρ₁, …
        rows: r that they are computed from.
    """
    quiet = np.abs(correlation[1:]) < 2.0 * np.sqrt(np.log10(rows) / rows)
    for lag in range(quiet.size - _QUIET + 1):
        if quiet[lag : lag + _QUIET].all():
            return lag
    return int(quiet.size)


def _hidden(
    gamma: tuple[FloatArray, ...],
    taken: Taken,
    omega: FloatArray,
    used: BoolArray,
    longest: int,
) -> list[FloatArray]:
    """Per joint: lagged products of the errors that the fit has taken, were ``gamma`` right."""
    found = []
    others = taken.from_errors(lambda joint, lags: _padded(gamma[joint], lags) / omega[joint] ** 2)
    for joint, (known, other) in enumerate(zip(taken.spectra, others, strict=True)):
        seen = other * used[:, joint, np.newaxis]
        found.append(2.0 * omega[joint] ** 2 * _lagged(known, seen, taken.pieces, longest))
    return found
