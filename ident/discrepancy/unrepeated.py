"""What does not repeat from period to period: noise, or something that no fixed model of the arm can show.

A vibration, a drift or a shock goes into the noise floor, where the search for effects does not look.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm, poisson
from scipy.stats import f as f_distribution

from ident.discrepancy.examination import Examination
from ident.statistics.whitening import autoregressive_whitening
from robots.arrays import FloatArray

_LOW_ORDER = 1
"""An AR model of order two follows a single frequency and would swallow it."""

_NEAR, _FAR = 3, 16
"""Ordinates of the periodogram to either side: the nearer are of the line, those up to the far ones not."""

_BLOCKS = 16

_FEWEST = 20
"""Rows of a block of time that its variance is taken from."""

_SHOCK, _SHOCKS = 5.5, 5
"""Robust deviations of a row that is a shock, and how many make a word."""

_LOUDER = 1.35
"""Noise of a joint against that of the accepted model's recording."""

_CLEAR = 1e-6
"""p-value below which it is worth a sentence; there are several tests on each joint."""

_SMALLEST_LINE = 0.05
"""Share of the noise's energy that a single frequency has to hold."""

_UNEVEN = 3.0
"""The strongest block of time has so many times the median block's variance."""


@dataclass(frozen=True)
class Unrepeated:
    """One thing that the noise of a joint should not have, the joint from 0."""

    joint: int
    kind: str
    p_value: float
    sentence: str


def unrepeated(examination: Examination, sample_time: float) -> tuple[Unrepeated, ...]:
    """Look for a single frequency and for bursts in what does not repeat.

    Args:
        examination: with noise told from repeats; without repeats nothing is found.
        sample_time: s between rows.
    """
    if not examination.repeats:
        return ()
    found = []
    for joint in range(examination.noise.shape[1]):
        for index in np.unique(examination.segment):
            rows = examination.segment == index
            series = examination.noise[rows, joint]
            white = _nearly_white(series)
            # Around a reversal noise is that of the instant at which it comes.
            moving = examination.used[rows, joint][-white.size :]
            found += _single_frequency(joint, white, sample_time)
            found += _bursts(joint, np.where(moving, white, np.nan), sample_time)
            found += _shocks(joint, white[moving])
    found += _louder(examination)
    return tuple(found)


def _nearly_white(series: FloatArray) -> FloatArray:
    column = series[:, np.newaxis]
    segment, used = np.zeros(series.size, dtype=np.int64), np.ones_like(column, dtype=np.bool_)
    whitening = autoregressive_whitening(column, segment, used, 0)
    coefficients: FloatArray = whitening.coefficients[0]
    if coefficients.size > _LOW_ORDER:
        lagged = np.column_stack([series[_LOW_ORDER - k : -k] for k in range(1, _LOW_ORDER + 1)])
        coefficients = np.asarray(
            np.linalg.lstsq(lagged, series[_LOW_ORDER:], rcond=None)[0], dtype=np.float64
        )
    order = coefficients.size
    white = series[order:].copy()
    for lag, a in enumerate(coefficients, start=1):
        white -= a * series[order - lag : series.size - lag]
    return np.asarray(white / white.std())


def _single_frequency(joint: int, white: FloatArray, sample_time: float) -> list[Unrepeated]:
    """F-test of the largest ordinate of the periodogram against its neighbours.

    A line is one or two ordinates wide; what the loop amplifies, however sharply, is wider than the
    neighbourhood.
    """
    power = np.abs(np.fft.rfft(white * np.hanning(white.size)))[1:] ** 2
    kernel = np.ones(2 * _FAR + 1)
    kernel[_FAR - _NEAR : _FAR + _NEAR + 1] = 0.0
    padded = np.pad(power, _FAR, mode="reflect")
    around = np.convolve(padded, kernel / kernel.sum(), mode="valid")
    ratio = power / around
    peak = int(np.argmax(ratio))
    # Neighbours under a window are not independent: half of them count.
    p_value = min(1.0, power.size * float(f_distribution.sf(ratio[peak], 2, kernel.sum())))
    line = power[max(peak - 2, 0) : peak + 3].sum() - around[max(peak - 2, 0) : peak + 3].sum()
    if p_value > _CLEAR or line < _SMALLEST_LINE * power.sum():
        return []
    frequency = (peak + 1) / (white.size * sample_time)
    return [
        Unrepeated(
            joint,
            "vibration",
            p_value,
            f"joint {joint + 1}: torque at {frequency:.2f} Hz that does not keep time with the trajectory",
        )
    ]


def _bursts(joint: int, white: FloatArray, sample_time: float) -> list[Unrepeated]:
    """Bartlett's test of equal variance over blocks of time."""
    whole = [block[np.isfinite(block)] for block in np.array_split(white, _BLOCKS)]
    # Where a joint rests, quantised torques may repeat exactly: that says nothing about its noise.
    at = [k for k, block in enumerate(whole) if block.size >= _FEWEST and np.ptp(block) > 0.0]
    blocks = [whole[k] for k in at]
    if len(blocks) < 2:
        return []
    length, white = white.size, np.concatenate(blocks)
    sizes = np.array([block.size - 1.0 for block in blocks])
    variances = np.array([block.var(ddof=1) for block in blocks])
    pooled = float(sizes @ variances / sizes.sum())
    heavy = float(np.mean(white**4) / np.mean(white**2) ** 2 - 1.0) / 2.0
    statistic = float(sizes.sum() * np.log(pooled) - sizes @ np.log(variances)) / max(heavy, 1.0)
    p_value = float(chi2.sf(statistic, len(blocks) - 1))
    if p_value > _CLEAR or variances.max() < _UNEVEN * np.median(variances):
        return []
    worst = at[int(np.argmax(variances))]
    start = worst * length / _BLOCKS * sample_time
    return [
        Unrepeated(
            joint,
            "bursts",
            p_value,
            f"joint {joint + 1}: torque noise is not even, strongest around {start:.1f} s",
        )
    ]


def _shocks(joint: int, white: FloatArray) -> list[Unrepeated]:
    """Rows far outside what the bulk of the noise is like (median absolute deviation)."""
    if white.size < _FEWEST:
        return []
    centred = np.abs(white - np.median(white))
    far = centred > _SHOCK * 1.4826 * np.median(centred)
    count = int(far.sum())
    if count < _SHOCKS:
        return []
    expected = white.size * float(2.0 * norm.sf(_SHOCK))
    return [
        Unrepeated(
            joint,
            "shocks",
            float(poisson.sf(count - 1, expected)),
            f"joint {joint + 1}: {count} sudden torques that do not repeat",
        )
    ]


def _louder(examination: Examination) -> list[Unrepeated]:
    """Joints whose noise is larger than when the prior's model was accepted."""
    prior = examination.prior
    if prior is None or prior.noise is None:
        return []
    found = []
    level = noise_level(examination)
    for joint, (now, before) in enumerate(zip(level, prior.noise, strict=True)):
        if before > 0.0 and now > _LOUDER * before:
            rows = int(examination.used[:, joint].sum())
            found.append(
                Unrepeated(
                    joint,
                    "louder",
                    float(f_distribution.sf((now / before) ** 2, rows, rows)),
                    f"joint {joint + 1}: torque noise is {now / before:.2f} times that of the accepted model",
                )
            )
    return found


def noise_level(examination: Examination) -> FloatArray:
    """(n,) rms of what does not repeat where the joints move, N·m (or N)."""
    squares = np.where(examination.used, examination.noise**2, 0.0).sum(axis=0)
    return np.asarray(np.sqrt(squares / np.maximum(examination.used.sum(axis=0), 1)))
