"""Single samples that cannot be: named with their time and set aside, before anything is filtered.

One wrong sample of a position is two wrong speeds and three wrong accelerations: it outweighs a whole record.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ident.errors import IdentificationError
from ident.listing import seconds
from ident.ordered import median, percentile
from ident.recording import LARGEST
from robots.arrays import BoolArray, FloatArray

_TIMES_USUAL = 20.0
"""Times the residual that one sample in ten exceeds: each wrong one spoils five, so 2 % may be wrong."""
_SHARE = 1e-3
"""Of all samples that may be wrong: with more it is not single samples."""
_NAMED = 3
"""Times that a sentence names."""
_FEWEST = 100
"""Samples below which nothing is usual."""
_NEIGHBOURS = 2


def without_outliers(
    name: str, what: str, time: FloatArray, values: FloatArray, impossible: FloatArray
) -> tuple[FloatArray, tuple[str, ...]]:
    """Channels with single wrong samples replaced by what their four neighbours say (a cubic through them).

    A sample is wrong where it is off that cubic by more than can be, and by far more than others are.

    Args:
        name: of the recording, for messages.
        what: of ``LARGEST``, for messages too.
        time: (samples,) s.
        values: samples × joints.
        impossible: (joints,) distance from its neighbours that no true sample has.

    Returns:
        The channels, unchanged where nothing is wrong, and a sentence for each joint that had wrong samples.

    Raises:
        IdentificationError: there are too many of them, or they stand side by side; names the first.
    """
    if values.shape[0] < _FEWEST or (np.abs(values) > LARGEST[what]).any():
        return values, ()  # what is beyond any arm is refused by Recording
    even, mended, sentences = _evenly_sampled(time), values, []
    for joint in range(values.shape[1]):
        off = _off_neighbours(values[:, joint]) * even
        residual = np.abs(off)
        far = residual > max(_TIMES_USUAL * float(percentile(residual, 90.0)), impossible[joint])
        if not far.any():
            continue
        peaks = np.flatnonzero(far & _is_peak(residual))
        at = ", ".join(seconds(time[k]) for k in peaks[:_NAMED]) + (" …" if len(peaks) > _NAMED else "")
        crowded = len(peaks) > 1 and int(np.diff(peaks).min()) <= 2 * _NEIGHBOURS
        if crowded or len(peaks) > max(1, _SHARE * len(values)):
            raise IdentificationError(
                f"{name}: {what} of joint {joint + 1} jumps at {len(peaks)} samples ({at} s), as no arm"
                " can; cut the log there"
            )
        size = float(residual[peaks].max())
        mended = values.copy() if mended is values else mended
        mended[peaks, joint] = values[peaks, joint] - off[peaks]
        number = "one sample" if len(peaks) == 1 else f"{len(peaks)} single samples"
        sentences.append(
            f"{name}: {what} of joint {joint + 1} is off by up to {size:.3g} at {number} ({at} s), set aside"
        )
    return mended, tuple(sentences)


def _off_neighbours(values: FloatArray) -> FloatArray:
    """Samples less the cubic through the two before and the two behind; 0 at the ends."""
    off = np.zeros_like(values)
    near, far = values[1:-3] + values[3:-1], values[:-4] + values[4:]
    off[2:-2] = values[2:-2] - (4.0 * near - far) / 6.0
    return off


def _evenly_sampled(time: FloatArray) -> BoolArray:
    """Samples with no gap among their five: the cubic has its neighbours where they were."""
    steps = np.diff(time)
    gap = np.pad(steps > 1.5 * median(steps), _NEIGHBOURS)
    return np.asarray(~sliding_window_view(gap, 2 * _NEIGHBOURS).any(axis=1), dtype=np.bool_)


def _is_peak(size: FloatArray) -> BoolArray:
    """Where a residual is the largest among its neighbours: a wrong sample makes theirs wrong too."""
    padded = np.pad(size, _NEIGHBOURS)
    shifted = [np.roll(padded, k)[_NEIGHBOURS:-_NEIGHBOURS] for k in (-2, -1, 1, 2)]
    return np.asarray((size >= np.max(shifted, axis=0)) & (size > 0), dtype=np.bool_)
