"""What of the other periods' motion is motion: the rest is their noise.

Columns of effects are made of the other periods' motion, since noise of the same period stands in y. That of
the others is not in y, but it is in the columns, and a column with noise is too long: on waypoints a torque's
rate is noise above 25 Hz, and of a lag of 3.9 ms a column of it found 0.3 ms, where a rotor inertia, a column
of less noise, stood for its largest part. So the motion is taken as the others let this period expect it
(regression calibration; Carroll and others 2006, ch. 4): split into bands of half an octave, each of them
into where it is louder than noise and where it is not, and each part has the share that least squares of a
joint's own acceleration gives it where the joint moves. Noise of two periods has nothing in common, so a part
of noise alone goes, and one of motion alone stays. Bands overlap, so shares are not cut off at one: where the
highest is noise, the next makes up for what that had of its tones.

Where and when: a loop that rings after each reversal and is quiet between has a tone in the one and noise in
the other. And no share is negative: with negative ones (of bands that hold little but what leaks of a
neighbour's tone) a delay of 5.1 ms came out as 1.6 ms beside the misfit, and a lag was named.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.ndimage import convolve1d
from scipy.optimize import nnls
from scipy.signal import butter, sosfiltfilt
from scipy.signal.windows import hann

from ident.effects import State
from robots.arrays import BoolArray, FloatArray

_BANDS = 8
"""Half octaves below the cut-off; what is below a sixteenth of it is motion."""

_ORDER = 4
"""Of the low-passes that tell the bands apart."""

_REACH = 3.0
"""Periods of the lowest cut-off in which such a low-pass has settled."""

_CELLS = 4.0
"""Inverses of a band's width over which its power is averaged: five values that are independent."""

_LOUD = 4.0
"""Of the noise's power, which noise itself reaches in one window of a thousand (chi-squared of five)."""

_SAME = 1e-12
"""Of the power of all: what least squares of columns that are the same need."""


def expected_motion(
    own: State, other: State, used: BoolArray, cutoff_hz: float, step: float, period: int
) -> State:
    """The motion of other periods less what of it is their noise.

    Args:
        own, other: motion of a recording and of the same phases in its other periods, at every sample.
        used: samples × joints, where the joints move.
        cutoff_hz: that both have passed.
        step: between samples, s.
        period: samples after which the motion repeats.
    """
    cutoffs = [cutoff_hz / 2.0 ** (k / 2.0) for k in range(1, _BANDS + 1)]
    reach = min(period, round(_REACH / (cutoffs[-1] * step)))

    def split(values: FloatArray) -> FloatArray:
        return _bands(_continued(values, period, reach), cutoffs, step, reach)

    channels = (other.position, other.velocity, other.acceleration)
    position, velocity, acceleration = (split(values) for values in channels)
    # The mean of k − 1 periods has 1 / k of the variance of its difference from one more.
    differing = split(own.acceleration - other.acceleration) / np.sqrt(max(round(used.shape[0] / period), 2))
    windows = [min(round(_CELLS / (wide * step)), period) for wide in -np.diff([cutoff_hz, *cutoffs])]
    shares = np.ones_like(acceleration)
    for j in np.flatnonzero(used.any(axis=0)):
        rows = used[:, j]
        noise = np.mean(differing[:, rows, j] ** 2, axis=1)
        loud = _loud(acceleration[:, :, j], noise, windows)
        shares[:, :, j] = _shares(acceleration[:, :, j], own.acceleration[:, j], rows, loud)
    position, velocity, acceleration = (
        np.einsum("bsj,bsj->sj", part, shares) for part in (position, velocity, acceleration)
    )
    return replace(other, position=position, velocity=velocity, acceleration=acceleration)


def _continued(values: FloatArray, period: int, reach: int) -> FloatArray:
    """With what a period before and a period after goes on with: a filter has no ends to spoil."""
    samples = values.shape[0]
    return np.concatenate([values[period - reach : period], values, values[samples - period :][:reach]])


def _bands(values: FloatArray, cutoffs: list[float], step: float, reach: int) -> FloatArray:
    """Bands × samples × channels, the highest first; they sum up to the values."""
    filters = (butter(_ORDER, cutoff, fs=1.0 / step, output="sos") for cutoff in cutoffs)
    passed = [values, *(sosfiltfilt(one, values, axis=0) for one in filters)]
    bands = np.stack([*(high - low for high, low in pairwise(passed)), passed[-1]])
    return np.asarray(bands[:, reach : values.shape[0] - reach])


def _loud(bands: FloatArray, noise: FloatArray, windows: list[int]) -> BoolArray:
    """Bands × samples: where a band is louder than noise; the lowest is motion.

    Args:
        bands: of a joint's acceleration, the highest first.
        noise: (bands,) variance of it.
        windows: samples over which the power of each band but the lowest is averaged.
    """
    loud = np.ones(bands.shape, dtype=np.bool_)
    for band, of_noise, above, length in zip(bands, noise, loud, windows, strict=False):
        weights = hann(length + 2)[1:-1]
        above[:] = convolve1d(band**2, weights / weights.sum(), axis=0) >= _LOUD * of_noise
    return loud


def _shares(bands: FloatArray, own: FloatArray, used: BoolArray, loud: BoolArray) -> FloatArray:
    """Bands × samples of a joint: what its own acceleration has of each; 1 ± 1 before any row is seen."""
    parts = np.concatenate([np.where(loud, bands, 0.0), np.where(loud, 0.0, bands)])[:, used]
    rest = own[used] - bands[:, used].sum(axis=0)
    system = parts @ parts.T + (float(rest @ rest) / rest.size + _SAME * np.sum(parts**2)) * np.eye(
        len(parts)
    )
    factor = np.linalg.cholesky(system)
    right = np.linalg.solve(factor, parts @ rest + system.sum(axis=1))
    of_loud, of_quiet = np.split(nnls(factor.T, right)[0][:, np.newaxis], 2)
    return np.where(loud, of_loud, of_quiet)
