"""What the accepted trajectory tells of a change of parameters: its torque, and how drives show in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.parameters.base import BaseParameters
from ident.preparation.observation import Rows
from robots.arrays import FloatArray


@dataclass(frozen=True)
class Geometry:
    """Second moments of the observation matrix on the accepted trajectory.

    Attributes:
        base: the base parameters.
        moments: (n, n, b, b): X_iᵀ X_j / N of the joints' rows.
        sigma: (n,) deviation of each joint's torque residual, N·m (or N): the weights of eq. 7.
        beta: (b,) the baseline.
    """

    base: BaseParameters
    moments: FloatArray
    sigma: FloatArray
    beta: FloatArray

    @property
    def joints(self) -> int:
        return int(self.moments.shape[0])

    def torque_rms(self, change: FloatArray) -> FloatArray:
        """rms torque per joint, (n,), that a change (b,) of the parameters makes on the trajectory."""
        own = np.einsum("a,jjab,b->j", change, self.moments, change, optimize=True)
        return np.asarray(np.sqrt(np.maximum(own, 0.0)))

    def gain_direction(self, drive: int) -> FloatArray:
        """Change (b,) of the LS estimate when the torque of a drive (from 0) reads larger by all of it.

        With y = Xβ and drive torques T⁻ᵀy, the drive's part of joint i's torque is T_di (T⁻ᵀy)_d; least
        squares with the weights 1/σ_i² turns that into parameters.
        """
        transmission = self.base.model.robot.transmission_matrix
        inverse = np.linalg.inv(transmission)
        weights = 1.0 / self.sigma**2
        information = np.einsum("j,jjab->ab", weights, self.moments)
        mixed = np.einsum(
            "i,j,ijab,b->a",
            weights * transmission[drive],
            inverse[:, drive],
            self.moments,
            self.beta,
            optimize=True,
        )
        return np.asarray(np.linalg.solve(information, mixed))


def geometry_of(base: BaseParameters, rows: Rows, sigma: FloatArray, beta: FloatArray) -> Geometry:
    """Geometry of the rows that an identification was made from.

    Args:
        base: the base parameters, one column of the rows each.
        rows: of eq. 6.
        sigma: (n,) deviation of each joint's residual.
        beta: (b,) the baseline.
    """
    regressor = np.where(rows.used[:, :, np.newaxis], rows.regressor, 0.0)
    moments = np.einsum("sia,sjb->ijab", regressor, regressor, optimize=True) / len(rows.time)
    return Geometry(base, moments, sigma, beta)
