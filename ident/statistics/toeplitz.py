"""Products with symmetric Toeplitz matrices: corners of circulant ones, which the transform makes diagonal.

By ``numpy.fft``: ``scipy.fft`` is no quicker here and loads half of SciPy's special functions.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from robots.arrays import FloatArray

ComplexArray = NDArray[np.complex128]


@lru_cache(maxsize=64)
def circle(samples: int) -> int:
    """A length 2ᵃ 3ᵇ 5ᶜ for which transforms are quick and nothing wraps around."""
    least = 2 * samples - 1
    found = 1 << (least - 1).bit_length()
    for fives in (1, 5, 25, 125):
        for threes in (1, 3, 9, 27, 81):
            factor = fives * threes
            found = min(found, factor << max(0, -(-least // factor) - 1).bit_length())
    return found


def spectrum(series: FloatArray) -> ComplexArray:
    """Of series (samples, …) on their circle; time, and so frequency, is best last in memory."""
    return np.moveaxis(np.fft.rfft(np.moveaxis(series, 0, -1), circle(series.shape[0])), -1, 0)


def times(gamma: FloatArray, series: ComplexArray) -> FloatArray:
    """The matrix with these numbers beside its diagonal, times series given by their spectra.

    Args:
        gamma: (samples,) from the diagonal on.
        series: frequencies × columns.

    Returns:
        samples × columns.
    """
    samples = gamma.size
    return np.fft.irfft(np.moveaxis(series, 0, -1) * _gain(gamma), circle(samples))[..., :samples].T


def forms(gamma: FloatArray, series: ComplexArray) -> FloatArray:
    """(columns,) quadratic forms of the same matrix in each of the series: their energy behind its gain.

    By Parseval's theorem, so that nothing is transformed back.

    Args:
        gamma, series: as of :func:`times`.
    """
    around = circle(gamma.size)
    gain = _gain(gamma)
    gain[1 : (around + 1) // 2] *= 2.0  # each of these frequencies stands for its mirror as well
    return np.asarray(gain @ (series.real**2 + series.imag**2) / around)


def _gain(gamma: FloatArray) -> FloatArray:
    """Eigenvalues of the circulant matrix whose corner it is, frequency by frequency."""
    around = circle(gamma.size)
    whole = np.concatenate([gamma, np.zeros(around - 2 * gamma.size + 1), gamma[:0:-1]])
    return np.fft.rfft(whole).real
