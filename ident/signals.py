"""From samples to motion: zero-phase low-pass and central differences (method.md 2).

Sources: Gautier 1997 and section 2.1 of the paper (band-pass filtering of q); MATLAB's ``filtfilt`` for
padding, so that published figures are reached.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ident.decimation import decimation_stages, rows_at_end
from ident.errors import IdentificationError
from ident.even_spline import EvenSpline
from ident.long_stage import PADDING
from ident.recording import Recording
from ident.recursive_filter import butterworth
from robots.arrays import FloatArray
from robots.description import Identification

Scalar = TypeVar("Scalar", bound=np.generic)

_CENTRAL_DIFFERENCE = {
    2: (1 / 2,),
    4: (2 / 3, -1 / 12),
    6: (3 / 4, -3 / 20, 1 / 60),
    8: (4 / 5, -1 / 5, 4 / 105, -1 / 280),
}
"""Weights of f(+k) − f(−k), k = 1, 2, …, for the first derivative at a step of one."""

_FORGOTTEN = 1e-6
"""Share of its state that a filter still has when it is said to have forgotten it."""


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


def own_settings(recording: Recording, settings: Identification) -> Identification:
    """Settings whose trim gives up what a low-pass spoils of samples that others lent a recording.

    Of those that are left the decimation makes rows as well; :func:`own_rows` takes them away.
    """
    beside = rows_at_end(settings.decimation, settings.decimation_filter) * settings.decimation
    return _trimmed_by(settings, (recording.lent[0] - beside, recording.lent[1] - beside))


def own_samples(recording: Recording, settings: Identification) -> Identification:
    """Settings whose trim gives up all samples that others lent a recording."""
    return _trimmed_by(settings, recording.lent)


def _trimmed_by(settings: Identification, least: tuple[int, int]) -> Identification:
    begin, end = (max(pair) for pair in zip(settings.trim_samples, least, strict=True))
    return settings.model_copy(update={"trim_samples": (begin, end)})


def own_rows(rows: NDArray[Scalar], recording: Recording, settings: Identification) -> NDArray[Scalar]:
    """Rows × … of a recording under :func:`own_settings`, without those that are of its neighbours."""
    beside = rows_at_end(settings.decimation, settings.decimation_filter)
    begin, end = (beside if lent else 0 for lent in recording.lent)
    return rows[begin : len(rows) - end]


def lendable(settings: Identification, sample_time: float) -> int:
    """Samples of a neighbour that make the rows at a seam those of the whole.

    Args:
        settings: filters, decimation and trim.
        sample_time: s.
    """
    beside = rows_at_end(settings.decimation, settings.decimation_filter) * settings.decimation
    return max(*settings.trim_samples, filter_memory(settings, sample_time)) + beside


def filter_memory(settings: Identification, sample_time: float) -> int:
    """Samples after which the positions' low-pass and differences know no more of an end of a record.

    By the slowest pole of the low-pass; 0 where the cut-off is none.

    Args:
        settings: cut-off, order and accuracy.
        sample_time: s.
    """
    share = 2.0 * settings.cutoff_hz * sample_time
    if not 0.0 < share < 1.0:
        return 0
    slowest = butterworth(settings.filter_order, share).slowest
    return int(np.ceil(np.log(_FORGOTTEN) / np.log(slowest))) + settings.derivative_accuracy


def kept_samples(samples: int, settings: Identification) -> slice:
    """What is left of a record after the trim at both ends.

    Raises:
        IdentificationError: nothing worth fitting would be left.
    """
    start, end = settings.trim_samples
    stages = decimation_stages(settings.decimation)
    before_last = settings.decimation // stages[-1] if stages else 1
    fewest = max(10 * settings.decimation, 2 * PADDING * before_last)
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
