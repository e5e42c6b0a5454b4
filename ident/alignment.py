"""The time between a reading of the control signal and its torque, found in the data.

Where the lag is off by δ, the torque of the rows is off by δ·dτ/dt. So the residual is regressed on dτ/dt
beside the regressor's own columns, the lag corrected by the coefficient, and that repeated until it is zero.
Noise in dτ/dt slows the steps down and does not move the point where they end: a stationary noise is not
correlated with its own derivative.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.covariance import weighted_score_covariance
from ident.estimators import Stacked
from ident.estimators.fit import stack_columns
from ident.observation import ObservedTorque, Rows
from ident.recording import Recording
from ident.restricted import regression_whitening
from ident.whitening import Whitening
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

_OTHER_ERRORS = 0.15
"""Rows from which on a wrong lag is a good part of the errors, so that their size is found anew."""

_SIGNIFICANT = 4.0
"""Deviations between setting and estimate that are worth a word."""

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
    robot: Robot,
    recordings: tuple[Recording, ...],
    rows: Rows,
    stacked: Stacked,
    whitening: Whitening,
    settings: Identification,
) -> LagEstimate:
    """Find the lag, starting from that of the settings.

    Args:
        robot: gains and transmission.
        recordings: control signals.
        rows: of these recordings.
        stacked: the same, stacked joint by joint.
        whitening: of the errors; weighs the joints, and makes the deviation honest.
        settings: filter, decimation and the given lag.
    """
    weights = stacked.spread(1.0 / _error_deviations(stacked))
    basis = np.linalg.qr(stacked.x * weights[:, np.newaxis])[0]
    given, sample_time = settings.control_signal_lag, recordings[0].sample_time
    row = sample_time * settings.decimation
    lag, step, sigma, rate_at = given, np.inf, np.inf, np.inf
    torque, rate = stacked.y, stacked.y
    observed = [ObservedTorque.of(robot, recording, settings) for recording in recordings]
    for _ in range(_ITERATIONS):
        if abs(lag - rate_at) > _SAME_RATE * row:
            rates = np.concatenate([torques.rate_at(lag) for torques in observed])
            rate = _stack(rows, rates) * weights
            rate -= basis @ (basis.T @ rate)
            sigma, rate_at = _deviation(rows, rate, weights, whitening), lag
        torque = np.concatenate([torques.at(lag) for torques in observed])
        step = float(rate @ (_stack(rows, torque) * weights) / (rate @ rate))
        lag += step
        if abs(step) < _STILL * sigma or abs(lag - given) > _FARTHEST:
            break
    converged = abs(step) < _STILL * sigma and abs(lag - given) <= _FARTHEST
    if converged and abs(lag - given) > _OTHER_ERRORS * row:
        errors = regression_whitening(torque, rows.regressor, rows.segment, rows.used)
        sigma = _deviation(rows, rate, weights, errors)
    return LagEstimate(lag, sigma, given, sample_time, converged)


def _error_deviations(stacked: Stacked) -> FloatArray:
    """(n,) deviations of the residuals of least squares over all joints."""
    beta = np.linalg.lstsq(stacked.x, stacked.y, rcond=None)[0]
    parts = stacked.split(stacked.y - stacked.x @ beta)
    return np.array([np.sqrt(np.mean(part**2)) for part in parts])


def _stack(rows: Rows, values: FloatArray) -> FloatArray:
    return stack_columns(values[:, :, np.newaxis], rows.used)[:, 0]


def _deviation(rows: Rows, rate: FloatArray, weights: FloatArray, whitening: Whitening) -> float:
    """√(dᵀΓd)/dᵀd with d what dτ/dt adds to the columns, and Γ of autoregressive errors."""
    direction = np.zeros((*rows.used.shape[::-1], 1))
    direction[rows.used.T, 0] = rate * weights
    ones = np.ones(rows.joints)
    score = weighted_score_covariance(direction.transpose(1, 0, 2), ones, whitening, rows.segment)
    return float(np.sqrt(score[0, 0]) / (rate @ rate))
