"""What a covariance is computed from: weighted rows of a linear estimate, still in their order in time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.estimators.fit import Stacked
from ident.ordered import distinct
from robots.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class EstimatedRows:
    """Rows weighted by Ω^-½ and the residuals of an estimate that solves Zᵀ(y − Xβ̂) = 0.

    Least squares has Z = X; two-stage least squares has Z = X̂. Left-out rows are zero everywhere.

    Attributes:
        z: samples × joints × b, weighted.
        x: samples × joints × b, weighted.
        residual: samples × joints, y − Xβ̂ weighted (never y − X̂β̂).
        segment: (samples,) which recording a sample comes from.
        used: samples × joints, false where a row is left out.
        period: (samples,) label of the repetition of the motion, or None where it is not periodic.
    """

    z: FloatArray
    x: FloatArray
    residual: FloatArray
    segment: IntArray
    used: BoolArray
    period: IntArray | None = None

    @property
    def parameters(self) -> int:
        return int(self.x.shape[2])

    @property
    def joints(self) -> int:
        return int(self.residual.shape[1])

    @property
    def count(self) -> int:
        """r, the number of rows."""
        return int(self.used.sum())

    @property
    def scores(self) -> FloatArray:
        """z·ε of every row, samples × joints × b."""
        return np.asarray(self.z * self.residual[:, :, np.newaxis])

    def sandwich(self, score_covariance: FloatArray) -> FloatArray:
        """(ZᵀX)⁻¹ S (XᵀZ)⁻¹, (b, b), of the covariance S of Zᵀε."""
        flat = (self.count, self.parameters)
        cross = self.z[self.used].reshape(flat).T @ self.x[self.used].reshape(flat)
        half = np.linalg.solve(cross, score_covariance)
        covariance = np.linalg.solve(cross, half.T)
        return np.asarray((covariance + covariance.T) / 2)

    def series(self, values: FloatArray) -> list[FloatArray]:
        """samples × joints × … → one piece (samples of a recording, …) per joint and recording."""
        return [
            values[self.segment == index, joint]
            for joint in range(self.joints)
            for index in distinct(self.segment)
        ]


def estimated_rows(
    regressor: FloatArray,
    instruments: FloatArray,
    residual: FloatArray,
    sigma: FloatArray,
    segment: IntArray,
    used: BoolArray,
    period: IntArray | None = None,
) -> EstimatedRows:
    """Weigh the rows of samples × joints by σ_j and blank those that are left out.

    Args:
        regressor: samples × joints × b.
        instruments: samples × joints × b; the regressor itself for least squares.
        residual: samples × joints, N·m (or N).
        sigma: (n,) the deviations that make Ω.
        segment: (samples,) recordings.
        used: samples × joints.
        period: (samples,) repetitions of the motion.
    """
    weight = (used / sigma)[:, :, np.newaxis]
    return EstimatedRows(
        instruments * weight, regressor * weight, residual * weight[:, :, 0], segment, used, period
    )


def estimated_stack(
    stacked: Stacked,
    beta: FloatArray,
    sigma: FloatArray,
    instruments: FloatArray | None = None,
    segment: IntArray | None = None,
    period: IntArray | None = None,
) -> EstimatedRows:
    """The same from rows that are stacked joint by joint, with as many rows, all used, for each joint.

    Args:
        stacked: rows joint by joint.
        beta: (b,) the estimate.
        sigma: (n,) the deviations that make Ω.
        instruments: (r, b); the observation matrix itself where None.
        segment: (r/n,) recordings; a single one where None.
        period: (r/n,) repetitions of the motion.
    """
    samples = stacked.y.size // stacked.joints
    x = _unstack(stacked.x, samples)
    z = x if instruments is None else _unstack(instruments, samples)
    residual = _unstack((stacked.y - stacked.x @ beta)[:, np.newaxis], samples)[:, :, 0]
    recording = np.zeros(samples, dtype=np.int64) if segment is None else segment
    used = np.ones(residual.shape, dtype=np.bool_)
    return estimated_rows(x, z, residual, sigma, recording, used, period)


def _unstack(values: FloatArray, samples: int) -> FloatArray:
    return values.reshape(-1, samples, values.shape[1]).transpose(1, 0, 2)
