"""Repeats of one motion within a recording: what differs between them is noise, whatever the model is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import fftconvolve

from ident.effects import State
from robots.arrays import FloatArray

_SHORTEST = 1.0
"""s; what repeats faster is an oscillation, not a period of the trajectory."""

_SAME = 1e-6
"""rad (or m): references of two periods agree within this; a count of an encoder is smaller."""


def repeat_length(reference: FloatArray | None, sample_time: float) -> int | None:
    """Samples per period where the whole reference repeats at least once; None where it does not.

    Args:
        reference: samples × joints position references, or None where none was recorded.
        sample_time: s.
    """
    if reference is None:
        return None
    samples = reference.shape[0]
    fewest = round(_SHORTEST / sample_time)
    longest = samples // 2
    spread = np.ptp(reference, axis=0)
    if longest < fewest or spread.max() <= _SAME:
        return None
    lead = reference[:, int(np.argmax(spread))]
    for lag in _likely_lags(lead, fewest, longest):
        if np.abs(reference[lag:] - reference[:-lag]).max() <= _SAME:
            return int(lag)
    return None


def _likely_lags(values: FloatArray, fewest: int, longest: int) -> FloatArray:
    """Lags at which a series differs little from itself, shortest first."""
    centred = values - values.mean()
    samples = centred.size
    power = np.concatenate([[0.0], np.cumsum(centred**2)])
    product = fftconvolve(centred, centred[::-1])[samples - 1 :]
    lags = np.arange(fewest, longest + 1)
    differing = power[samples - lags] + (power[-1] - power[lags]) - 2 * product[lags]
    small = differing / (samples - lags) < 1e-6 * float(np.mean(centred**2))
    return np.asarray(lags[small])


def others_mean(values: FloatArray, period: int) -> FloatArray:
    """At each sample the mean of the same phase in the other periods; samples × channels.

    A last period that is not whole takes part as far as it goes. A phase that one period alone holds
    keeps its own value.
    """
    samples = values.shape[0]
    phase = np.arange(samples) % period
    total = np.zeros((period, values.shape[1]))
    np.add.at(total, phase, values)
    count = np.bincount(phase, minlength=period)[phase][:, np.newaxis]
    rest = total[phase] - values
    return np.where(count > 1, rest / np.maximum(count - 1, 1), values)


def motion_of_others(state: State, period: int) -> State:
    """Each sample's motion and torque as the other periods show them; time stays the sample's own."""
    torque, asked = state.torque, state.asked
    return replace(
        state,
        position=others_mean(state.position, period),
        velocity=others_mean(state.velocity, period),
        acceleration=others_mean(state.acceleration, period),
        torque=None if torque is None else others_mean(torque, period),
        asked=None if asked is None else asked.then(lambda made: others_mean(made, period)),
    )


def mean_period(values: FloatArray, period: int) -> FloatArray:
    """At each sample the mean of its phase in all periods, its own among them; samples × channels.

    Its noise has nothing in common with what differs between the periods.
    """
    phase = np.arange(values.shape[0]) % period
    total = np.zeros((period, values.shape[1]))
    np.add.at(total, phase, values)
    return np.asarray((total / np.maximum(np.bincount(phase, minlength=period), 1)[:, np.newaxis])[phase])


def not_repeating(values: FloatArray, period: int) -> FloatArray:
    """What differs from the mean period, scaled to the variance of a single one; samples × channels."""
    samples = values.shape[0]
    count = np.bincount(np.arange(samples) % period, minlength=period)[np.arange(samples) % period]
    share = np.sqrt(np.maximum(count - 1, 1) / np.maximum(count, 1))[:, np.newaxis]
    return np.asarray((values - others_mean(values, period)) * share)
