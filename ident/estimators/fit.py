"""What every linear estimator takes and gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.errors import IdentificationError
from ident.preparation.observation import Rows
from robots.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class Stacked:
    """Rows stacked joint by joint as in eq. 6.

    Attributes:
        y: (r,) torques, N·m (or N).
        x: (r, b) observation matrix.
        joint: (r,) index of the joint a row belongs to, ascending from 0.
    """

    y: FloatArray
    x: FloatArray
    joint: IntArray

    @property
    def joints(self) -> int:
        return int(self.joint[-1]) + 1

    def split(self, values: FloatArray) -> list[FloatArray]:
        """(r, …) → one array per joint."""
        return np.split(values, np.flatnonzero(np.diff(self.joint)) + 1)

    def spread(self, per_joint: FloatArray) -> FloatArray:
        """(n,) → (r,): each joint's value on its rows."""
        return np.asarray(per_joint[self.joint])


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
    """Samples × joints to one column, joint by joint, without the rows that are left out.

    Raises:
        IdentificationError: a joint has no rows.
    """
    joint = np.repeat(np.arange(rows.joints), rows.used.sum(axis=0))
    for index in range(rows.joints):
        if not rows.used[:, index].any():
            raise IdentificationError(f"joint {index + 1} never moves fast enough to identify its friction")
    return Stacked(rows.torque.T[rows.used.T], stack_columns(rows.regressor, rows.used), joint)


def stack_columns(regressor: FloatArray, used: BoolArray) -> FloatArray:
    """samples × joints × b to (r, b), joint by joint; where all rows are used it is the same memory."""
    by_columns = regressor.transpose(2, 1, 0)
    if used.all():
        return by_columns.reshape(len(by_columns), -1).T
    ends = np.cumsum([0, *used.sum(axis=0)])
    found = np.zeros((len(by_columns), ends[-1]))
    for joint, column in np.argwhere(regressor.any(axis=0)):
        found[column, ends[joint] : ends[joint + 1]] = by_columns[column, joint, used[:, joint]]
    return found.T
