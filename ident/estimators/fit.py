"""What every linear estimator takes and gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.observation import Rows
from robots.arrays import FloatArray


@dataclass(frozen=True)
class Stacked:
    """Rows stacked joint by joint as in eq. 6.

    Attributes:
        y: (r,) torques, N·m (or N).
        x: (r, b) observation matrix.
        joints: n; rows j·n_e … (j+1)·n_e belong to joint j.
    """

    y: FloatArray
    x: FloatArray
    joints: int

    def per_joint(self, values: FloatArray) -> FloatArray:
        """(r,) → joints × samples."""
        return values.reshape(self.joints, -1)


@dataclass(frozen=True)
class LinearFit:
    """β̂ with its covariance.

    Attributes:
        beta: (b,).
        covariance: (b, b).
        sigma: (n,) standard deviation of the error per joint, N·m (or N): Ω^½.
        condition: condition number of the whitened observation matrix.
        covariance_kind: what was assumed of the errors.
        iterations: how many solutions were computed until β̂ stood still.
        converged: whether it did.
    """

    beta: FloatArray
    covariance: FloatArray
    sigma: FloatArray
    condition: float
    covariance_kind: str = "Ω per joint, errors independent in time (eq. 7)"
    iterations: int = 1
    converged: bool = True


def stack(rows: Rows) -> Stacked:
    """Samples × joints to one column, joint by joint."""
    return Stacked(rows.torque.T.reshape(-1), stack_columns(rows.regressor), rows.joints)


def stack_columns(regressor: FloatArray) -> FloatArray:
    """samples × joints × b to (r, b), joint by joint."""
    return np.ascontiguousarray(regressor.transpose(1, 0, 2)).reshape(-1, regressor.shape[2])
