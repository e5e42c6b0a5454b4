"""Low-pass filters of samples, run forward and in reverse so that they shift nothing in time.

A low-pass by the bilinear transform has all its zeros at half the sampling rate, so its numerator is
g·(1 + z⁻¹)ᴺ, and its denominator is a lower triangular band that LAPACK solves (``dtbtrs``). That is as quick
and as accurate as ``scipy.signal``, which takes longer to load than a log takes to be identified.

Sources: Oppenheim and Schafer, Discrete-Time Signal Processing (Butterworth and Chebyshev I prototypes,
bilinear transform, Kaiser window); MATLAB's ``filtfilt`` for padding and initial states.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtbtrs

from robots.arrays import BoolArray, FloatArray

_IN_CACHE = 1 << 16
"""Values that are filtered together: half a megabyte stays in the cache of a core."""


@dataclass(frozen=True)
class LowPass:
    """A low-pass filter g·(1 + z⁻¹)ᴺ / (a₀ + a₁·z⁻¹ + …), a₀ = 1.

    Attributes:
        gain: g.
        denominator: (N + 1,) a.
        steady: what is left of a constant.
    """

    gain: float
    denominator: FloatArray
    steady: float

    def both_ways(self, series: FloatArray, padding: int) -> FloatArray:
        """Forward and in reverse, channels × samples in and out.

        Both ends are continued by their point reflections, and each pass begins in the state that its first
        sample would have left had it always been there.

        Args:
            series: channels × samples.
            padding: samples by which the ends are continued; fewer than there are.
        """
        samples = series.shape[1]
        band = np.repeat(self.denominator[np.newaxis, :], samples + 2 * padding, axis=0).T
        found = np.empty(series.shape)
        rows = max(1, _IN_CACHE // max(samples, 1))
        for first in range(0, len(series), rows):
            part = series[first : first + rows]
            before = 2.0 * part[:, :1] - part[:, padding:0:-1]
            behind = 2.0 * part[:, -1:] - part[:, -2 : -2 - padding : -1]
            values = np.concatenate([before, part, behind], axis=1)
            for _ in range(2):
                values = self._settled(values, band)[:, ::-1]
            found[first : first + rows] = values[:, padding : padding + samples]
        return found

    def _settled(self, values: FloatArray, band: FloatArray) -> FloatArray:
        """One pass, begun in the steady state of the first sample; channels × samples."""
        start = values[:, :1].copy()
        driven = np.subtract(values, start, order="C")
        other = np.empty_like(driven)
        for _ in range(self.denominator.size - 1):
            np.add(driven[:, 1:], driven[:, :-1], out=other[:, 1:])
            other[:, 0] = driven[:, 0]
            driven, other = other, driven
        driven *= self.gain
        found, _ = dtbtrs(band, driven.T, uplo="L", diag="U", overwrite_b=True)
        filtered: FloatArray = found.T
        filtered += self.steady * start
        return filtered


def butterworth(order: int, cutoff: float) -> LowPass:
    """Butterworth's low-pass.

    Args:
        order: N.
        cutoff: −3 dB frequency, of half the sampling rate.
    """
    angle = np.pi * np.arange(1 - order, order, 2) / (2 * order)
    return _bilinear(-np.exp(1j * angle), cutoff, 1.0)


def chebyshev(order: int, ripple: float, cutoff: float) -> LowPass:
    """Chebyshev's low-pass of type I and even order.

    Args:
        order: N, even: a constant is at the lower edge of the ripple.
        ripple: of the pass band, dB.
        cutoff: frequency at which the ripple ends, of half the sampling rate.
    """
    angle = np.pi * np.arange(1 - order, order, 2) / (2 * order)
    bend = np.arcsinh(1.0 / np.sqrt(10.0 ** (0.1 * ripple) - 1.0)) / order
    return _bilinear(-np.sinh(bend + 1j * angle), cutoff, 10.0 ** (-ripple / 20.0))


def _bilinear(poles: NDArray[np.complex128], cutoff: float, steady: float) -> LowPass:
    """The digital filter of an analogue one with these poles and its edge at 1 rad/s."""
    warped = np.tan(0.5 * np.pi * cutoff) * poles
    denominator = np.poly((1.0 + warped) / (1.0 - warped)).real
    gain = steady * float(denominator.sum()) / 2.0**poles.size
    return LowPass(gain, np.asarray(denominator, dtype=np.float64), steady)


def recursion(denominator: FloatArray, driven: FloatArray) -> FloatArray:
    """y with Σ aₖ y(n − k) = driven(n), zero before its beginning; (samples,) or samples × channels.

    Args:
        denominator: a₀ = 1, a₁, …
        driven: in.
    """
    band = np.repeat(denominator[np.newaxis, :], driven.shape[0], axis=0).T
    found, _ = dtbtrs(band, driven.reshape(driven.shape[0], -1), uplo="L", diag="U")
    return np.asarray(found.reshape(driven.shape))


def windowed_sinc(reach: int, cutoff: float, beta: float) -> FloatArray:
    """(2·reach + 1,) taps of a finite low-pass under a Kaiser window; a constant passes unchanged.

    Args:
        reach: samples to either side.
        cutoff: −6 dB frequency, of half the sampling rate.
        beta: of the window.
    """
    taps = np.sinc(cutoff * np.arange(-reach, reach + 1)) * np.kaiser(2 * reach + 1, beta)
    return np.asarray(taps / taps.sum())


def power_density(values: FloatArray, rate: float, piece: int) -> tuple[FloatArray, FloatArray]:
    """Welch's periodogram: pieces that overlap by half, without their means, under Hann's window.

    Args:
        values: samples × channels.
        rate: samples per second.
        piece: samples of a piece.

    Returns:
        (f,) frequencies, Hz, and f × channels one-sided power per Hz.
    """
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(piece) / piece)
    starts = range(0, values.shape[0] - piece + 1, piece - piece // 2)
    total = np.zeros((piece // 2 + 1, values.shape[1]))
    for start in starts:
        part = values[start : start + piece]
        total += np.abs(np.fft.rfft((part - part.mean(axis=0)) * window[:, np.newaxis], axis=0)) ** 2
    density = total / (len(starts) * rate * float(window @ window))
    density[1 : (piece + 1) // 2] *= 2.0  # neither zero nor half the sampling rate has a mirror image
    return np.asarray(np.fft.rfftfreq(piece, 1.0 / rate), dtype=np.float64), density


def near(mask: BoolArray, reach: int) -> BoolArray:
    """samples × channels: whether the mask holds within so many samples to either side."""
    padded = np.zeros((mask.shape[0] + 2 * reach + 1, mask.shape[1]), dtype=np.int32)
    np.cumsum(mask, axis=0, out=padded[reach + 1 : reach + 1 + mask.shape[0]])
    padded[reach + 1 + mask.shape[0] :] = padded[reach + mask.shape[0]]
    return np.asarray(padded[2 * reach + 1 :] > padded[: mask.shape[0]])
