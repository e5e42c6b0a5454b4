"""What of the other periods' motion is motion: the rest is their noise.

Columns of effects are made of the other periods' motion, since noise of the same period stands in y. That of
the others is not in y, but it is in the columns, and a column with noise is too long: on waypoints a torque's
rate is noise above 25 Hz, and of a lag of 3.9 ms a column of it found 0.3 ms, where a rotor inertia, a column
of less noise, stood for its largest part. So the motion is taken as the others let this period expect it
(regression calibration; Carroll and others 2006, ch. 4): split into bands of half an octave, each with the
share that least squares of a joint's own acceleration gives it where the joint moves. Noise of two periods
has nothing in common, so a band of noise alone goes, and one of motion alone stays. Bands overlap, so shares
are not cut off at one: where the highest is noise, the next makes up for what that had of its tones.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.signal import butter, sosfiltfilt

from ident.effects import State
from robots.arrays import BoolArray, FloatArray

_BANDS = 8
"""Half octaves below the cut-off; what is below a sixteenth of it is motion."""

_ORDER = 4
"""Of the low-passes that tell the bands apart."""

_REACH = 3.0
"""Periods of the lowest cut-off in which such a low-pass has settled."""


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
    channels = (other.position, other.velocity, other.acceleration)
    split = [_bands(_continued(values, period, reach), cutoffs, step, reach) for values in channels]
    shares = np.stack(
        [_shares(split[2][:, :, j], own.acceleration[:, j], used[:, j]) for j in range(used.shape[1])], axis=1
    )
    position, velocity, acceleration = (np.einsum("bsj,bj->sj", part, shares) for part in split)
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


def _shares(bands: FloatArray, own: FloatArray, used: BoolArray) -> FloatArray:
    """(bands,) of each that this period's own acceleration has, too; 1 ± 1 before any row is seen."""
    columns, rest = bands[:, used].T, own[used] - bands[:, used].sum(axis=0)
    freedom = rest.size - bands.shape[0]
    if freedom < 1:
        return np.ones(bands.shape[0])
    fit = np.linalg.lstsq(columns, rest, rcond=None)[0]
    noise = float(np.sum((rest - columns @ fit) ** 2)) / freedom
    system = columns.T @ columns + noise * np.eye(bands.shape[0])
    return np.asarray(1.0 + np.linalg.lstsq(system, columns.T @ rest, rcond=None)[0])
