"""From samples to motion: zero-phase low-pass, central differences, parallel decimation (method.md 2).

Sources: Gautier 1997 and section 2.1 of the paper (band-pass filtering of q, parallel decimation);
MATLAB's ``filtfilt`` and ``decimate`` for padding and phase, so that published figures are reached.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from ident.errors import IdentificationError
from ident.even_spline import EvenSpline
from ident.filters import LowPass, butterworth, chebyshev, windowed_sinc
from ident.recording import Recording
from robots.arrays import FloatArray, IntArray
from robots.description import Identification

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_LARGEST_STAGE = 13
"""A decimation filter of order 8 is well conditioned up to here; larger factors go in stages."""

_DECIMATION_PADDING = 24
"""Samples by which the decimation filter extends a record at both ends, as MATLAB does."""

DecimationFilter = Literal["chebyshev", "fir"]

_FIR_REACH = 4
"""Kept samples to either side that the finite decimation filter mixes."""

_ROWS_AT_ONCE = 1000
"""Rows of the finite filter that are computed together."""

_FIR_BETA = 6.0
"""Of its Kaiser window: 60 dB in the stop band."""

_CENTRAL_DIFFERENCE = {
    2: (1 / 2,),
    4: (2 / 3, -1 / 12),
    6: (3 / 4, -3 / 20, 1 / 60),
    8: (4 / 5, -1 / 5, 4 / 105, -1 / 280),
}
"""Weights of f(+k) − f(−k), k = 1, 2, …, for the first derivative at a step of one."""


@dataclass(frozen=True)
class Motion:
    """Filtered motion: time (samples,), q, q̇, q̈ samples × joints; rad (or m) and s."""

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


def low_pass(values: FloatArray, cutoff_hz: float, sample_time: float, order: int) -> FloatArray:
    """Butterworth low-pass, forward and reverse, so that it shifts nothing in time.

    Args:
        values: samples × channels.
        cutoff_hz: −3 dB frequency of one pass.
        sample_time: s.
        order: order of one pass.

    Raises:
        IdentificationError: the cut-off is not below half the sampling rate, or the record too short.
    """
    nyquist = 0.5 / sample_time
    if not 0 < cutoff_hz < nyquist:
        raise IdentificationError(
            f"cut-off {cutoff_hz:g} Hz; allowed: above 0 and below {nyquist:g} Hz, half the sampling rate"
        )
    padding = 3 * order
    if values.shape[0] <= padding:
        raise IdentificationError(f"{values.shape[0]} samples; allowed: more than {padding} to be filtered")
    return butterworth(order, cutoff_hz / nyquist).both_ways(values.T, padding).T


def low_pass_where_sampled(
    values: FloatArray, time: FloatArray | None, cutoff_hz: float, order: int
) -> FloatArray:
    """:func:`low_pass` of samples × channels; as they are where samples are too few or far apart for it.

    Args:
        values: samples × channels.
        time: (samples,) s, uniform; None where it is not known.
        cutoff_hz, order: as of :func:`low_pass`.
    """
    if time is None or time.shape[0] <= 3 * order:
        return values
    step = float(time[1] - time[0])
    return values if cutoff_hz * step >= 0.5 else low_pass(values, cutoff_hz, step, order)


def differentiate(values: FloatArray, sample_time: float, accuracy: int) -> FloatArray:
    """Central differences of a given order of accuracy; one-sided of first order at the very edges.

    Args:
        values: samples × channels.
        sample_time: s.
        accuracy: 2, 4, 6 or 8.
    """
    result = np.gradient(values, sample_time, axis=0)
    reach = accuracy // 2
    if accuracy == 2 or values.shape[0] <= 2 * reach:
        return np.asarray(result)
    last = values.shape[0] - reach
    inner = np.zeros_like(values[reach:last])
    for k, weight in enumerate(_CENTRAL_DIFFERENCE[accuracy], start=1):
        inner += weight * (values[reach + k : last + k] - values[reach - k : last - k])
    result[reach:last] = inner / sample_time
    return np.asarray(result)


def motion(time: FloatArray, position: FloatArray, settings: Identification) -> Motion:
    """q̂ by the zero-phase low-pass, its derivatives by central differences; the edges trimmed.

    Args:
        time: (samples,) s, uniform.
        position: samples × joints.
        settings: cut-off, order, accuracy and trim.

    Raises:
        IdentificationError: too short for the trim, or an impossible cut-off.
    """
    sample_time = float((time[-1] - time[0]) / (time.shape[0] - 1))
    q = low_pass(position, settings.cutoff_hz, sample_time, settings.filter_order)
    velocity = differentiate(q, sample_time, settings.derivative_accuracy)
    acceleration = differentiate(velocity, sample_time, settings.derivative_accuracy)
    keep = kept_samples(time.shape[0], settings)
    return Motion(time[keep], q[keep], velocity[keep], acceleration[keep])


def kept_samples(samples: int, settings: Identification) -> slice:
    """What is left of a record after the trim at both ends.

    Raises:
        IdentificationError: nothing worth fitting would be left.
    """
    start, end = settings.trim_samples
    stages = decimation_stages(settings.decimation)
    before_last = settings.decimation // stages[-1] if stages else 1
    fewest = max(10 * settings.decimation, 2 * _DECIMATION_PADDING * before_last)
    if samples - start - end < fewest:
        raise IdentificationError(
            f"{samples} samples are too short a record; allowed: at least {start + end + fewest}"
            f" with trim {start} + {end} and decimation {settings.decimation}"
        )
    return slice(start, samples - end)


@dataclass(frozen=True)
class AlignedControlSignal:
    """The torque's control signal at the instants of the positions, samples × drives, for any lag.

    A sampled controller holds its output, so the torque at an instant is on average the control signal
    of half a controller period (plus its computing delay) before. Uncorrected it reads as jerk and
    biases the inertias. What is held also moves the arm less than its samples say, the more the quicker it
    changes (by sinc f·hold: 0.13 % at 28 Hz and 1 ms): the mean over a hold about t − lag is what acts. A lag
    of zero says that nobody knows how the channels lie in time; the signal is then taken as it is.

    Attributes:
        recording: with control signals.
        hold: s, for which the controller holds its output; 0 where the recording shows what acts.
    """

    recording: Recording
    hold: float = 0.0

    def at(self, lag: float) -> FloatArray:
        if lag == 0:
            return self.recording.control_signal
        step, last = self.recording.sample_time, self.recording.time.shape[0] - 1
        half = 0.5 * self.hold / step
        place = np.clip(np.arange(last + 1) - lag / step, half, last - half)
        if half == 0.0:
            return self._spline.at(place)
        return (self._spline.integral(place + half) - self._spline.integral(place - half)) / (2.0 * half)

    @cached_property
    def _spline(self) -> EvenSpline:
        return EvenSpline(self.recording.control_signal)


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
    smooth = _chebyshev(factor).both_ways(flat, _DECIMATION_PADDING)
    kept = smooth[:, _first_kept(flat.shape[1], factor) :: factor]
    return np.moveaxis(kept.reshape(*series.shape[:-1], -1), -1, axis)


@cache
def _chebyshev(factor: int) -> LowPass:
    return chebyshev(8, 0.05, 0.8 / factor)


def _first_kept(samples: int, factor: int) -> int:
    kept = -(-samples // factor)
    return factor - (factor * kept - samples) - 1


def decimate_index(samples: int, factor: int) -> IntArray:
    """Which samples of a record :func:`decimate` keeps."""
    index = np.arange(samples)
    for stage in decimation_stages(factor):
        index = index[_first_kept(index.size, stage) :: stage]
    return index
