"""Parallel decimation: both sides of eq. 6 through one low-pass, then one sample in so many (method.md 2).

Sources: section 2.1 of the paper; MATLAB's ``decimate`` for filter, padding and phase, so that published
figures are reached.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from ident.filters import windowed_sinc
from ident.long_stage import LongStage, between_ends, first_kept, rows_near
from robots.arrays import FloatArray, IntArray

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_LARGEST_STAGE = 13
"""A decimation filter of order 8 is well conditioned up to here; larger factors go in stages."""

DecimationFilter = Literal["chebyshev", "fir"]

_FIR_REACH = 4
"""Kept samples to either side that the finite decimation filter mixes."""

_ROWS_AT_ONCE = 1000
"""Rows of the finite filter that are computed together."""

_FIR_BETA = 6.0
"""Of its Kaiser window: 60 dB in the stop band."""


def decimate(
    values: FloatArray, factor: int, kind: DecimationFilter = "chebyshev", axis: int = 0
) -> FloatArray:
    """Parallel decimation: a zero-phase low-pass at 0.8/factor of half the sampling rate, then down.

    ``chebyshev``: type I of order 8, 0.05 dB, both ways, as MATLAB's ``decimate``; factors above 13 go in
    stages. ``fir``: a windowed sinc that reaches 4·factor samples to either side and no farther; an error
    that is confined in time, as that of friction at a reversal, stays so.

    The phase is MATLAB's: the first kept sample is factor − (factor·nout − samples), counted from one, with
    nout = ceil(samples/factor).

    Args:
        values: samples × channels (or more axes).
        factor: keep one in so many.
        kind: the filter.
        axis: of time.
    """
    if kind == "fir":
        if factor == 1:
            return values
        series = np.moveaxis(values, axis, 0)
        rows = _fir(series.reshape(series.shape[0], -1), factor)
        return np.moveaxis(rows.reshape(-1, *series.shape[1:]), 0, axis)
    for stage in decimation_stages(factor):
        values = _decimate_once(values, stage, axis)
    return values


def _fir(series: FloatArray, factor: int) -> FloatArray:
    """The finite filter at the samples that are kept alone, samples × channels; ends are held.

    Each block of rows is the same few numbers on another stretch of samples.
    """
    samples, reach = series.shape[0], decimation_reach(factor, "fir")
    kept = decimate_index(samples, factor)
    found = np.empty((kept.size, series.shape[1]))
    for start in range(0, kept.size, _ROWS_AT_ONCE):
        rows = kept[start : start + _ROWS_AT_ONCE]
        first, last = int(rows[0]) - reach, int(rows[-1]) + reach
        seen = series[max(first, 0) : last + 1]
        if first < 0 or last >= samples:
            seen = np.pad(seen, ((max(-first, 0), max(last + 1 - samples, 0)), (0, 0)), mode="edge")
        found[start : start + rows.size] = _fir_rows(rows.size, factor) @ seen
    return found


@lru_cache(maxsize=8)
def _fir_rows(rows: int, factor: int) -> csr_array:
    """The taps of so many rows that stand ``factor`` samples apart, rows × samples that they see."""
    from scipy.sparse import csr_array  # takes time to load; most decimations need none

    taps = windowed_sinc(decimation_reach(factor, "fir"), 0.8 / factor, _FIR_BETA)
    seen = factor * np.arange(rows)[:, np.newaxis] + np.arange(taps.size)
    ends = taps.size * np.arange(rows + 1)
    shape = (rows, factor * (rows - 1) + taps.size)
    return csr_array((np.tile(taps, rows), seen.ravel(), ends), shape=shape)


def decimation_reach(factor: int, kind: DecimationFilter) -> int:
    """Samples to either side that a row of the finite filter is made of; 0 where the filter has no end."""
    return _FIR_REACH * factor if kind == "fir" and factor > 1 else 0


def rows_at_end(factor: int, kind: DecimationFilter) -> int:
    """Rows at either end of a record that the end has a share in."""
    if kind == "fir":
        return _FIR_REACH if factor > 1 else 0
    rows = 0
    for stage in decimation_stages(factor):
        rows = -(-rows // stage) + rows_near(stage)
    return rows


def decimation_stages(factor: int) -> list[int]:
    """Split a factor into stages of at most 13, largest first; a large prime stays whole."""
    stages: list[int] = []
    while factor > _LARGEST_STAGE:
        stage = next((d for d in range(_LARGEST_STAGE, 1, -1) if factor % d == 0), factor)
        stages.append(stage)
        factor //= stage
    return [*stages, factor] if factor > 1 else stages


def _decimate_once(values: FloatArray, factor: int, axis: int) -> FloatArray:
    series = np.moveaxis(values, axis, -1)
    flat = series.reshape(-1, series.shape[-1])
    stage = LongStage.of(flat.shape[1], factor)
    if stage is None:
        kept = between_ends(flat, factor)
    else:
        kept = stage.joined(flat[:, stage.head], flat[:, stage.middle], flat[:, stage.tail])
    return np.moveaxis(kept.reshape(*series.shape[:-1], -1), -1, axis)


def decimate_index(samples: int, factor: int) -> IntArray:
    """Which samples of a record :func:`decimate` keeps."""
    index = np.arange(samples)
    for stage in decimation_stages(factor):
        index = index[first_kept(index.size, stage) :: stage]
    return index


def decimate_seen(series: FloatArray, stage: LongStage, factor: int) -> FloatArray:
    """Rows, channels × kept samples, of channels × the samples that the first stage of ``chebyshev`` sees."""
    rows = stage.rows(series)
    for more in decimation_stages(factor)[1:]:
        rows = _decimate_once(rows, more, 1)
    return rows
