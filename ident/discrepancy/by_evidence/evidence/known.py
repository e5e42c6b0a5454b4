"""What every model has: β with its prior, the channels' lag, the drives' gains, memories of loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from ident.discrepancy.align import lag_is_known
from ident.discrepancy.by_evidence.evidence.load_memory import memory_columns
from ident.discrepancy.by_evidence.evidence.prepared import Prepared
from ident.discrepancy.by_evidence.evidence.rows import Known
from ident.discrepancy.prior import Prior
from ident.parameters.base import BaseParameters
from ident.parameters.present import Present
from ident.statistics.symmetric import eigen_of
from robots.arrays import FloatArray
from robots.description import Robot

LAG = 5e-5
"""s, deviation of the lag between the channels of the whole arm, where the description gives it."""

LAG_OF_JOINT = 3e-5
"""s, of each joint beyond that."""

_SECOND = 1e-7
"""s², deviation of the factor of the torque's second derivative: what a hold and a filter leave of a lag."""


@dataclass(frozen=True)
class Beta:
    """How β (b,) is made of the known factors: values + spread · factors[:b]."""

    values: FloatArray
    spread: FloatArray

    @property
    def count(self) -> int:
        return int(self.values.size)

    def mean(self, known: FloatArray) -> FloatArray:
        """β of factors (k,)."""
        return np.asarray(self.values + self.spread @ known[: self.count])

    def covariance(self, whole: FloatArray) -> FloatArray:
        """Of β, from that of all factors."""
        b = self.count
        return np.asarray(self.spread @ whole[:b, :b] @ self.spread.T)


def beta_of(prior: Prior | None, start: FloatArray) -> tuple[Beta, FloatArray]:
    """β and the precision (b,) of its factors: those of a prior have unit variance, the others are flat.

    Flat ones are counted from ``start`` (b,), a first fit, so that what is left of the torque is small and
    its sum of squares keeps its digits.
    """
    b = start.size
    if prior is None:
        return Beta(start, np.eye(b)), np.zeros(b)
    held = np.isfinite(np.diag(prior.covariance))
    spread = np.eye(b)
    part = prior.covariance[np.ix_(held, held)]
    values, vectors = eigen_of(part)
    spread[np.ix_(held, held)] = vectors * np.sqrt(np.maximum(values, 0.0))
    return Beta(np.where(held, prior.values, start), spread), held.astype(np.float64)


def known_columns(
    prepared: Prepared, base: BaseParameters, prior: Prior | None, start: FloatArray, present: Present
) -> tuple[Known, Beta]:
    """Columns of β, and of what shifts the channels, the latter at the motion of the other periods.

    What a first fit or the prior expects is taken off at each sample's own motion. What is fitted is the
    correction to that, and noise that moves the arm stands in the rows: a column of the sample's own motion
    would be taken for it, against an effect with the same column of the other periods' motion. (An inertia
    that is less and a rotor's that is more leave the noise of an acceleration: 12 nats on clean arms with
    process torque that remembers 20 ms, of parameters that were known within 0.3 %.) So columns are those of
    the other periods (instruments): what is missing in them is the correction times noise, which is small of
    second order.

    Args:
        prepared: the recordings.
        base: the parameters β.
        prior: of β; None after a refit.
        start: β (b,) of a first fit.
        present: a model that is near enough for the rate of the torque.
    """
    beta, precision = beta_of(prior, start)
    regressor = np.concatenate([base.columns(part.own) for part in prepared.parts])
    others = np.concatenate([base.columns(part.at_rows) for part in prepared.parts])
    columns = [
        others @ beta.spread,
        _lags(prepared, present),
        memory_columns(prepared, base, present),
    ]
    if prior is not None and prior.source == "description":
        columns.append(_gains(prepared, present))
    whole = np.concatenate(columns, axis=2)
    rest = whole.shape[2] - beta.count
    target = prepared.torque - regressor @ beta.values
    return Known(whole, np.concatenate([precision, np.ones(rest)]), target), beta


def _lags(prepared: Prepared, present: Present) -> FloatArray:
    """Those of :func:`lag_columns` at the motion of the other periods."""
    arm = arm_lag(prepared.robot, prepared.parts[0].sample_time)
    parts = []
    for part in prepared.parts:
        assert part.other.time is not None
        course = CubicSpline(part.other.time, present.torque(part.other))
        parts.append(lag_columns(course, np.asarray(part.other.time)[:: part.finer], arm))
    return np.concatenate(parts)


def arm_lag(robot: Robot, sample_time: float) -> float:
    """s, deviation of the lag between the channels of an arm: a sample where nobody has said what it is."""
    return LAG if lag_is_known(robot) else max(LAG, sample_time)


def lag_columns(course: CubicSpline, time: FloatArray, arm: float) -> FloatArray:
    """Rows × n × (1 + 2n): rate of a torque of the whole arm and of each joint, and its own rate.

    Args:
        course: of the torque, N·m (or N).
        time: (rows,) s.
        arm: s, deviation of the whole arm's lag.
    """
    rate, second = (course(time, order) for order in (1, 2))
    rows, n = rate.shape
    columns = np.zeros((rows, n, 1 + 2 * n))
    columns[:, :, 0] = arm * rate
    joints = np.arange(n)
    columns[:, joints, 1 + joints] = LAG_OF_JOINT * rate
    columns[:, joints, 1 + n + joints] = _SECOND * second
    return columns


def _gains(prepared: Prepared, present: Present) -> FloatArray:
    """Rows × joints × drives: what the drives' gains, as described, may be off by."""
    robot = prepared.robot
    uncertain = np.array([drive.gain_relative_uncertainty for drive in robot.drive])
    inverse = np.linalg.inv(robot.transmission_matrix)
    parts = []
    for part in prepared.parts:
        drives = present.torque(part.other)[:: part.finer] @ inverse * uncertain
        parts.append(drives[:, np.newaxis, :] * robot.transmission_matrix.T[np.newaxis])
    return np.concatenate(parts)
