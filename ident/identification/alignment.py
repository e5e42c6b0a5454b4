"""The time between a reading of the control signal and its torque, found in the data.

Where the lag is off by δ, the torque of the rows is off by δ·dτ/dt. So the torque is regressed on dτ/dt
beside the regressor's own columns, the lag corrected by the coefficient, and that repeated until it is zero.

In a closed loop the encoders' noise and whatever else moves the arm stand in the motion and in the control
signal, in an order of time that the controller gives: by least squares that is a lag, of milliseconds
where the motion is slow. The reference knows of no noise. So wherever one was recorded, the instruments of
this regression are the columns and dτ/dt along what the reference says of the motion (its first stage).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ident.estimators import Stacked
from ident.estimators.fit import stack_columns
from ident.parameters.base import BaseParameters
from ident.preparation.observation import Rows, observed_columns
from ident.preparation.observed_torque import ObservedTorque
from ident.recording import Recording
from ident.signals import differentiate, low_pass, own_settings
from ident.statistics.covariance import weighted_score_covariance
from ident.statistics.triangle import triangle_beside
from ident.statistics.whitening import Whitening
from robots.arrays import FloatArray
from robots.description import Identification, Robot

_ITERATIONS = 20
_STILL = 0.03
"""Deviations of the estimate; smaller steps end the iteration."""

_FARTHEST = 0.02
"""s; an estimate that leaves the given lag by more is none: the channels are not merely shifted."""

_SAME_RATE = 0.02
"""Rows that the lag may move before dτ/dt is computed anew: shifted against the torque, its noise is
correlated with that of the torque."""

_DERIVATIVES = 4
"""Of the reference, from which the motion follows: those of a loop with a velocity filter and a delay."""

_OTHER_ERRORS = 0.15
"""Rows from which on a wrong lag is a good part of the errors, so that their size is found anew."""

_SIGNIFICANT = 4.0
"""Deviations between setting and estimate that are reported."""

_SMALL = 0.02
"""Samples; a smaller disagreement biases nothing that is seen."""


@dataclass(frozen=True)
class LagEstimate:
    """Lag of the whole arm, s.

    Attributes:
        lag: estimate; v_τ(t − lag) is the torque at t.
        sigma: its standard deviation, errors autoregressive per joint.
        given: the setting that it is compared with.
        sample_time: of the recordings.
        converged: whether the steps came to an end near the given lag.
    """

    lag: float
    sigma: float
    given: float
    sample_time: float
    converged: bool

    @property
    def disagrees(self) -> bool:
        """Whether the setting is off by more than chance, and by enough to matter."""
        away = abs(self.lag - self.given)
        return self.converged and away > max(_SIGNIFICANT * self.sigma, _SMALL * self.sample_time)


def estimate_lag(
    base: BaseParameters,
    recordings: tuple[Recording, ...],
    rows: Rows,
    stacked: Stacked,
    whitening: Whitening,
    settings: Identification,
) -> LagEstimate:
    """Find the lag, starting from that of the settings.

    Args:
        base: the model, whose arm has gains and transmission.
        recordings: control signals, and references where there are any.
        rows: of these recordings.
        stacked: the same, stacked joint by joint.
        whitening: of the errors; weighs the joints, and makes the deviation honest.
        settings: filter, decimation and the given lag.
    """
    robot = base.model.robot
    deviations = _error_deviations(stacked)
    weights = stacked.spread(1.0 / deviations)
    reference = _along_reference(base, recordings, rows, stacked, settings)
    given, sample_time = settings.control_signal_lag, recordings[0].sample_time
    row = sample_time * settings.decimation
    lag, step, sigma, rate_at = given, np.inf, np.inf, np.inf
    torque = rate = probe = stacked.y
    observed = _Torques(robot, recordings, settings)
    for _ in range(_ITERATIONS):
        if abs(lag - rate_at) > _SAME_RATE * row:
            moved, rates = observed.with_rate_at(lag)
            rate = _stack(rows, rates) * weights
            probe = _probe(stacked.x, rate, reference, weights)
            sigma, rate_at = _deviation(rows, probe, weights, whitening) / abs(float(probe @ rate)), lag
        else:
            moved = observed.at(lag)
        torque = _stack(rows, moved)
        step = float(probe @ (torque * weights) / (probe @ rate))
        lag += step
        if abs(step) < _STILL * sigma or abs(lag - given) > _FARTHEST:
            break
    converged = abs(step) < _STILL * sigma and abs(lag - given) <= _FARTHEST
    if converged and abs(lag - given) > _OTHER_ERRORS * row:
        smaller = _error_deviations(replace(stacked, y=torque)) / deviations
        errors = replace(whitening, sigma=whitening.sigma * smaller)
        sigma = _deviation(rows, probe, weights, errors) / abs(float(probe @ rate))
    return LagEstimate(lag, sigma, given, sample_time, converged)


class _Torques:
    """The torques of recordings at any lag, rows × joints; of one alone what they are made of is kept."""

    def __init__(self, robot: Robot, recordings: tuple[Recording, ...], settings: Identification) -> None:
        self._one_by_one: list[Callable[[], ObservedTorque]] = [
            partial(ObservedTorque.of, robot, one, own_settings(one, settings)) for one in recordings
        ]
        if len(recordings) == 1:
            only = self._one_by_one[0]()
            self._one_by_one = [lambda: only]

    def at(self, lag: float) -> FloatArray:
        return np.concatenate([make().at(lag) for make in self._one_by_one])

    def with_rate_at(self, lag: float) -> tuple[FloatArray, FloatArray]:
        torques, rates = zip(*(make().with_rate_at(lag) for make in self._one_by_one), strict=True)
        return np.concatenate(torques), np.concatenate(rates)


def _error_deviations(stacked: Stacked) -> FloatArray:
    """(n,) deviations of the residuals of least squares over all joints."""
    beta = np.linalg.lstsq(*triangle_beside(stacked.x, stacked.y), rcond=None)[0]
    parts = stacked.split(stacked.y - stacked.x @ beta)
    return np.array([np.sqrt(np.mean(part**2)) for part in parts])


def _stack(rows: Rows, values: FloatArray) -> FloatArray:
    return stack_columns(values[:, :, np.newaxis], rows.used)[:, 0]


def _along_reference(
    base: BaseParameters,
    recordings: tuple[Recording, ...],
    rows: Rows,
    stacked: Stacked,
    settings: Identification,
) -> tuple[FloatArray, FloatArray] | None:
    """Columns (r, b) and dτ/dt (r,) of the rows along what references say; None without references."""
    if any(recording.reference is None for recording in recordings):
        return None
    beta = np.linalg.lstsq(*triangle_beside(stacked.x, stacked.y), rcond=None)[0]
    columns, rates = [], []
    for recording in recordings:
        assert recording.reference is not None
        moved = replace(recording, position=_first_stage(recording, recording.reference, settings))
        part = observed_columns(base, moved, settings)
        columns.append(part)
        rates.append(np.gradient(part @ beta, recording.sample_time * settings.decimation, axis=0))
    return stack_columns(np.concatenate(columns), rows.used), _stack(rows, np.concatenate(rates))


def _first_stage(recording: Recording, reference: FloatArray, settings: Identification) -> FloatArray:
    """Positions, samples × joints, as a linear function of the reference and its derivatives, joint by joint.

    The reference itself is ahead of the motion by what the loop follows late; instruments so far ahead take
    whatever the model lacks for a part of the lag.
    """
    step, samples = recording.sample_time, reference.shape[0]
    rates = [low_pass(reference, settings.cutoff_hz, step, settings.filter_order)]
    for _ in range(_DERIVATIVES):
        rates.append(differentiate(rates[-1], step, settings.derivative_accuracy))
    found = reference.copy()
    for joint in range(reference.shape[1]):
        columns = np.column_stack([np.ones(samples), *(rate[:, joint] for rate in rates)])
        columns /= np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        late = reference[:, joint] - recording.position[:, joint]
        found[:, joint] -= columns @ np.linalg.lstsq(columns, late, rcond=None)[0]
    return found


def _probe(
    x: FloatArray, rate: FloatArray, reference: tuple[FloatArray, FloatArray] | None, weights: FloatArray
) -> FloatArray:
    """(r,) what picks dτ/dt out of a torque and nothing of the model's own columns, all weighted.

    Without a reference it is the part of dτ/dt that the columns do not hold (Frisch, Waugh and Lovell), else
    the part of dτ/dt along the reference that is orthogonal to them.
    """
    if reference is None:
        beta = np.linalg.lstsq(*triangle_beside(x, rate, weights), rcond=None)[0]
        return np.asarray(rate - weights * (x @ beta))
    z, along = reference[0] * weights[:, np.newaxis], reference[1] * weights
    x = x * weights[:, np.newaxis]
    return np.asarray(along - z @ np.linalg.lstsq(x.T @ z, x.T @ along, rcond=None)[0])


def _deviation(rows: Rows, probe: FloatArray, weights: FloatArray, whitening: Whitening) -> float:
    """√(dᵀΓd) with d the probe, and Γ of autoregressive errors."""
    direction = np.zeros((*rows.used.shape[::-1], 1))
    direction[rows.used.T, 0] = probe * weights
    ones = np.ones(rows.joints)
    score = weighted_score_covariance(direction.transpose(1, 0, 2), ones, whitening, rows.segment)
    return float(np.sqrt(score[0, 0]))
