"""Records with jitter or a few missing samples, made uniform; worse ones refused with the place."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from ident.errors import IdentificationError
from ident.recording import JITTER_ALLOWED, Recording
from robots.arrays import FloatArray

_LARGEST_JITTER = 0.5
"""Sampling periods by which a time stamp may be off its place."""

_LONGEST_GAP = 10
"""Samples in a row that may be missing: what is missing then is still below a usual cut-off."""

_MISSING_ALLOWED = 0.01
"""Share of all samples."""


def uniform_recording(
    name: str,
    time: FloatArray,
    reference: FloatArray | None,
    position: FloatArray,
    control_signal: FloatArray,
) -> tuple[Recording, tuple[str, ...]]:
    """A recording from samples that need not be evenly spaced.

    Evenly spaced samples pass unchanged. Otherwise all channels are interpolated by cubic splines on an even
    grid of the same clock, and a sentence says so.

    Args:
        name: for messages.
        time: (samples,) s.
        reference: samples × joints, rad (or m); None where it was not recorded.
        position: samples × joints, rad (or m).
        control_signal: samples × drives.

    Returns:
        The recording, and what was done as sentences of warning.

    Raises:
        IdentificationError: time does not increase, jitters too much, or too much is missing; says where.
    """
    if time.shape[0] < 3:
        raise IdentificationError(f"{name}: {time.shape[0]} samples are too few to identify")
    steps = np.diff(time)
    period = float(np.median(steps))
    _check_increasing(name, time, steps)
    if np.abs(steps - period).max() <= JITTER_ALLOWED * period:
        return Recording(name, time, reference, position, control_signal), ()
    index = np.concatenate([[0], np.cumsum(np.rint(steps / period))])
    # The median of jittering steps is a little off; over the whole record the clock is not.
    period = float((time[-1] - time[0]) / index[-1])
    off = (time - time[0]) / period - index
    off -= np.median(off)
    words = _judge(name, time, steps, period, off)
    grid = time[0] + period * np.arange(int(index[-1]) + 1)
    resampled = [
        None if values is None else np.asarray(CubicSpline(time, values, axis=0)(grid))
        for values in (reference, position, control_signal)
    ]
    assert resampled[1] is not None
    assert resampled[2] is not None
    return Recording(name, grid, resampled[0], resampled[1], resampled[2]), (f"{name}: {words}",)


def _check_increasing(name: str, time: FloatArray, steps: FloatArray) -> None:
    back = np.flatnonzero(steps <= 0)
    if back.size:
        at = int(back[0])
        raise IdentificationError(
            f"{name}: time does not increase after {time[at]:.6g} s (sample {at}), {back.size} times in all"
        )


def _judge(name: str, time: FloatArray, steps: FloatArray, period: float, off: FloatArray) -> str:
    """What is wrong with the sampling, in words, where it can be mended.

    Raises:
        IdentificationError: where it cannot.
    """
    missing = np.rint(steps / period).astype(np.int64) - 1
    if missing.min() < 0:
        at = float(time[int(np.argmin(steps)) + 1])
        raise IdentificationError(
            f"{name}: sampling is not uniform: {1e3 * steps.min():.3g} ms before {at:.6g} s, median"
            f" {1e3 * period:.6g} ms; allowed: time stamps off by {_LARGEST_JITTER:g} periods"
        )
    longest, total = int(missing.max()), int(missing.sum())
    at = float(time[int(np.argmax(missing))])
    if longest > _LONGEST_GAP or total > _MISSING_ALLOWED * time.shape[0]:
        raise IdentificationError(
            f"{name}: sampling is not uniform: {total} of {time.shape[0] + total} samples are missing,"
            f" {longest} in a row after {at:.6g} s; allowed: {_LONGEST_GAP} in a row and"
            f" {_MISSING_ALLOWED:.0%} in all"
        )
    jitter = float(np.abs(off).max())
    worst = int(np.argmax(np.abs(off)))
    if jitter > _LARGEST_JITTER:
        raise IdentificationError(
            f"{name}: sampling is not uniform: the sample at {time[worst]:.6g} s is off by {jitter:.2g}"
            f" periods of {period:.6g} s; allowed: {_LARGEST_JITTER:g}"
        )
    words = f"sampling is not uniform (time stamps are off by up to {1e3 * jitter * period:.2g} ms)"
    if total:
        words += f", {total} samples are missing, {longest} in a row after {at:.6g} s"
    return f"{words}; resampled every {1e3 * period:.6g} ms by cubic splines"
