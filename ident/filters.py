"""Parts of filters of samples: recursions, taps, spectra and neighbourhoods, by NumPy alone.

``scipy.linalg`` and ``scipy.signal`` take longer to load than a log takes to be identified. The low-pass
filters are in :mod:`ident.recursive_filter`.

Source: Oppenheim and Schafer, Discrete-Time Signal Processing (Kaiser window, Welch's periodogram).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from robots.arrays import BoolArray, FloatArray

_BLOCK = 64
"""Samples of a recursion that are one product."""


def recursion(denominator: FloatArray, driven: FloatArray) -> FloatArray:
    """y with Σ aₖ y(n − k) = driven(n), zero before its beginning; (samples,) or samples × channels.

    Args:
        denominator: a₀ = 1, a₁, …
        driven: in.
    """
    order, samples = denominator.size - 1, driven.shape[0]
    if order == 0:
        return driven.astype(np.float64)
    length = max(_BLOCK, order)
    within, handed_on = _one_block(denominator, length)
    blocks = -(-samples // length)
    found = np.zeros((blocks * length, driven[:1].size))
    found[:samples] = driven.reshape(samples, -1)
    pieces = found.reshape(blocks, length, -1)
    pieces[:] = within @ pieces
    for before, piece in pairwise(pieces):
        piece += handed_on @ before[length - order :]
    return np.asarray(found[:samples].reshape(driven.shape))


def _one_block(denominator: FloatArray, length: int) -> tuple[FloatArray, FloatArray]:
    """What a block's input makes of it, and what the last N values before it make of it."""
    order = denominator.size - 1
    impulse = np.zeros(length + order)
    impulse[order] = 1.0
    for k in range(order + 1, length + order):
        impulse[k] = -(denominator[1:] @ impulse[k - order : k][::-1])
    late = np.arange(length) - np.arange(length)[:, np.newaxis]
    within = np.where(late <= 0, impulse[order + np.maximum(-late, 0)], 0.0)
    reach = np.arange(order)[:, np.newaxis] + order - np.arange(order)
    heard = np.where(reach <= order, -denominator[np.minimum(reach, order)], 0.0)
    return within, within[:, :order] @ heard


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
