"""The interval that is printed beside an estimate: chance, and what timing and reversals do to it.

A standard deviation is of errors that have nothing to do with the motion. Two in any record have:

- *Timing.* Where the lag of the control signal is off by δ, the torque is off by δ·dτ/dt, which reads as
  inertia and friction. No description states a lag better than half a step of a drive's current loop.
- *Reversals.* There the model's friction jumps and the arm's does not, filters spread the difference, and a
  jump has a direction. The contrast of the estimate with that of the rows away from reversals (Hausman 1978)
  tells how much of it there is: without any, the squares of the contrasts have the size of their variances.

Both are added to the variance of the errors; the estimate stays as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.decimation import decimate_index, decimation_reach
from ident.estimators import LinearFit
from ident.filters import near
from ident.identification.fits import Prepared
from ident.ordered import distinct
from ident.preparation.observed_torque import ObservedTorque
from ident.recording import Recording
from ident.signals import low_pass, motion, own_rows, own_settings
from ident.statistics.lag_window import variances, windowed_autocovariance
from ident.statistics.triangle import weighted_product
from robots.arrays import BoolArray, FloatArray
from robots.description import Identification

QUANTILE = 1.959963984540054
"""Of the normal distribution, for intervals that cover 95 %."""

_UNSTATED_LAG = 25e-6
"""s; half a step of a current loop of 20 kHz: a lag that is given is known no better."""

_SETTLED = 0.01
"""Of a step; what a filter leaves of it is then below what is seen."""

_ROWS_PER_PARAMETER = 5
"""Rows away from reversals, for each parameter, that an estimate is made of."""

_BLIND = 1e-6
"""Singular values of the columns of unit norm below which rows away from reversals do not tell them apart."""


@dataclass(frozen=True)
class Deviations:
    """What a parameter's interval is made of, each (b,), in its unit.

    Attributes:
        chance: of errors that remember, whatever σ was asked for.
        timing: of a lag that is not quite the given one.
        reversals: of rows near reversals, none where the others do not show the parameters.
    """

    chance: FloatArray
    timing: FloatArray
    reversals: FloatArray

    @property
    def half_width(self) -> FloatArray:
        """(b,) half of the interval that covers 95 %."""
        return np.asarray(QUANTILE * np.sqrt(self.chance**2 + self.timing**2 + self.reversals**2))


def deviations(
    prepared: Prepared, recordings: tuple[Recording, ...], fit: LinearFit, instruments: FloatArray | None
) -> Deviations:
    """What the intervals of a linear estimate are made of.

    Args:
        prepared: its rows and their settings.
        recordings: that these are of.
        fit: β̂ and the weights of the joints.
        instruments: samples × joints × b; None for least squares.
    """
    rows = prepared.rows
    z = rows.regressor if instruments is None else instruments
    residual = rows.torque - rows.predicted(fit.beta)
    gamma = windowed_autocovariance(residual, z, rows.segment, rows.used)
    weight = rows.used / fit.sigma
    whole = _Map(z, rows.regressor, weight, weight)
    timing = whole.of(_rate(prepared, recordings) * weight) ** 2 * _lag_square(prepared)
    away = away_from_reversals(prepared, recordings)
    part = _Map(z, rows.regressor, weight * away, weight)
    chance, expected, reversals = np.zeros((3, fit.beta.size))
    # Recording by recording: of hours the weights fill the memory.
    for own in (rows.segment == name for name in distinct(rows.segment)):
        weights = whole.influence(own) * weight[own, :, np.newaxis]
        chance += variances(weights, gamma, rows.segment[own])
        if part.is_determined:
            weights -= part.influence(own) * weight[own, :, np.newaxis]
            expected += variances(weights, gamma, rows.segment[own])
    if part.is_determined:
        contrast = (whole.of(residual * weight) - part.of(residual * weight)) ** 2
        seen = expected > 0.0
        beyond = float(np.mean(contrast[seen] / expected[seen])) - 1.0 if seen.any() else 0.0
        reversals = max(beyond, 0.0) * np.minimum(expected, chance)
    return Deviations(np.sqrt(chance), np.sqrt(timing), np.sqrt(reversals))


def half_widths(
    prepared: Prepared,
    recordings: tuple[Recording, ...],
    fit: LinearFit,
    instruments: FloatArray | None,
    more: FloatArray | None,
    alone: LinearFit | None,
) -> FloatArray:
    """(b,) half of the interval that covers 95 %.

    Args:
        prepared, recordings, fit, instruments: as of :func:`deviations`.
        more: (b, b) covariance that is no matter of the rows.
        alone: the estimate without what was known before of some parameters, which narrows the interval as
            it does σ.
    """
    half = deviations(prepared, recordings, fit, instruments).half_width
    if more is not None:
        half = np.hypot(half, QUANTILE * np.sqrt(np.diag(more)))
    if alone is not None and alone is not fit:
        half = half * np.sqrt(np.diag(fit.covariance) / np.diag(alone.covariance))
    return np.asarray(half)


class _Map:
    """The linear map from weighted torques to an estimate, (ZᵀX)⁻¹Zᵀ; rows that it leaves out weigh 0 in Z.

    Z and X are samples × joints × b, their weights samples × joints.
    """

    def __init__(self, z: FloatArray, x: FloatArray, z_weight: FloatArray, x_weight: FloatArray) -> None:
        self._z, self._weight = z, z_weight
        both, joints = z_weight * x_weight, range(x.shape[1])
        self._cross = sum(
            (weighted_product(z[:, j], x[:, j], both[:, j]) for j in joints), np.zeros((x.shape[2],) * 2)
        )
        used = sum(int(np.count_nonzero((z_weight[:, j] != 0.0) & z[:, j].any(axis=1))) for j in joints)
        scale = np.sqrt(np.abs(np.diag(self._cross)))
        scale[scale == 0.0] = 1.0
        values = np.linalg.svd(self._cross / np.outer(scale, scale), compute_uv=False)
        enough = used >= _ROWS_PER_PARAMETER * x.shape[2]
        self.is_determined = bool(enough and values[-1] > _BLIND * values[0])

    def influence(self, own: BoolArray) -> FloatArray:
        """Samples × joints × b of some samples: what each weighted row adds to the parameters."""
        inverse, columns = np.linalg.inv(self._cross), self._z.transpose(2, 1, 0)
        found = np.empty((*columns.shape[:2], np.count_nonzero(own)))
        for joint in range(found.shape[1]):
            z = columns[:, joint, own] * self._weight[own, joint]
            seen = z.any(axis=1)
            found[:, joint] = inverse[:, seen] @ z[seen]
        return found.transpose(2, 1, 0)

    def of(self, torque: FloatArray) -> FloatArray:
        """The estimate (b,) of weighted torques, samples × joints."""
        shares = np.einsum("sja,sj->a", self._z, torque * self._weight)
        return np.asarray(np.linalg.solve(self._cross, shares))


def _rate(prepared: Prepared, recordings: tuple[Recording, ...]) -> FloatArray:
    """dτ/dt of the rows, samples × joints."""
    robot = prepared.base.model.robot
    settings = robot.identification
    lag = settings.control_signal_lag
    rates = [ObservedTorque.of(robot, one, own_settings(one, settings)).rate_at(lag) for one in recordings]
    return np.concatenate(rates)


def _lag_square(prepared: Prepared) -> float:
    """Mean square error of the lag, s²: what the data say of it, with what could be stated of it before.

    A lag of zero says that nobody knows: anything within half a sample to either side is as good.
    """
    lag, settings = prepared.lag, prepared.base.model.robot.identification
    if settings.alignment == "estimate":
        return lag.sigma**2
    before = _UNSTATED_LAG if settings.control_signal_lag > 0.0 else 0.5 * lag.sample_time
    if not lag.converged or not np.isfinite(lag.sigma):
        return before**2
    share = before**2 / (before**2 + lag.sigma**2)
    return float((share * (lag.lag - settings.control_signal_lag)) ** 2 + share * lag.sigma**2)


def away_from_reversals(prepared: Prepared, recordings: tuple[Recording, ...]) -> BoolArray:
    """samples × joints: used rows so far from any reversal of the joint, or of a drive that moves with it,
    that neither low-pass nor decimation has spread it there.
    """
    robot = prepared.base.model.robot
    settings = robot.identification
    transmission = robot.transmission_matrix
    parts = []
    for recording in recordings:
        own = own_settings(recording, settings)
        velocity = motion(recording.time, recording.position, own).velocity
        turns = _turns(velocity) | (_turns(velocity @ transmission.T) @ (transmission != 0.0))
        reach = _settled(settings, recording.sample_time)
        reach += decimation_reach(settings.decimation, "fir")
        away = ~near(turns, reach)[decimate_index(velocity.shape[0], settings.decimation)]
        parts.append(own_rows(away, recording, own))
    return np.asarray(np.concatenate(parts) & prepared.rows.used)


def _turns(velocity: FloatArray) -> BoolArray:
    """samples × joints: the sign is another than one sample before."""
    sign = np.sign(velocity)
    return np.asarray(np.diff(sign, axis=0, prepend=sign[:1]) != 0.0)


def _settled(settings: Identification, sample_time: float) -> int:
    """Samples after which the low-pass of the positions has followed a step."""
    longest = round(2.0 / (settings.cutoff_hz * sample_time)) + 1
    step = np.zeros((4 * longest + 6 * settings.filter_order, 1))
    middle = step.shape[0] // 2
    step[middle:] = 1.0
    followed = low_pass(step, settings.cutoff_hz, sample_time, settings.filter_order)
    late = np.flatnonzero(np.abs(followed - step)[middle:, 0] > _SETTLED)
    return int(late[-1]) + 1 if late.size else 0
