"""Coupled axes: a drive whose gear output moves with more than one joint, as on many wrists.

With drive output = T · joint position, drive k adds Tₖᵀ(Tₖ q̈) of inertia and Tₖᵀ(Tₖ q̇) of viscous
friction. The diagonal parts of those are already in the joints' own Ia and Fv, so the columns here
hold what is left: the products between joints, and the whole Coulomb term of the drive's own speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.effects.family import Place, StandardParameter
from ident.effects.speed_term import FrictionSign, SpeedTerm, speed_columns
from ident.effects.state import State
from robots import unit_of
from robots.arrays import FloatArray
from robots.description import Robot


def coupled_drives(robot: Robot) -> tuple[int, ...]:
    """Indices (from 0) of the drives whose output depends on more than one joint."""
    matrix = robot.transmission_matrix
    return tuple(k for k in range(robot.n) if np.count_nonzero(matrix[k]) > 1)


@dataclass(frozen=True)
class WristCoupling:
    """Iam, Fvm, Fcm of each coupled drive."""

    robot: Robot
    sign: FrictionSign
    name = "wrist_coupling"
    sentence = "inertia and friction of a drive that moves with more than one joint"

    @property
    def parameters(self) -> tuple[StandardParameter, ...]:
        return tuple(
            StandardParameter(
                symbol, Place("drive", (k,)), self.name, unit_of(symbol, self.robot.joint[k].kind)
            )
            for k in coupled_drives(self.robot)
            for symbol in ("Iam", "Fvm", "Fcm")
        )

    def speed_terms(self) -> tuple[SpeedTerm, ...]:
        """The Coulomb friction of each coupled drive."""
        rows = self.robot.transmission
        return tuple(
            SpeedTerm(3 * k + 2, rows[drive], rows[drive], self.sign)
            for k, drive in enumerate(coupled_drives(self.robot))
        )

    def columns(self, state: State) -> FloatArray:
        """samples × joints × (3 per coupled drive)."""
        matrix = self.robot.transmission_matrix
        columns = speed_columns(self.speed_terms(), state, len(self.parameters))
        for k, drive in enumerate(coupled_drives(self.robot)):
            between = _between(matrix[drive])
            columns[:, :, 3 * k] = state.acceleration @ between
            columns[:, :, 3 * k + 1] = state.velocity @ between
        return columns

    def torque(self, state: State, values: FloatArray) -> FloatArray:
        """Joint torque for values (3 per coupled drive,) of the parameters, samples × joints."""
        matrix, total = self.robot.transmission_matrix, np.zeros_like(state.velocity)
        for drive, (inertia, viscous, dry) in zip(
            coupled_drives(self.robot), np.reshape(values, (-1, 3)), strict=True
        ):
            row = matrix[drive]
            moved = inertia * state.acceleration + viscous * state.velocity
            total += moved @ _between(row) + np.outer(self.sign(state.velocity @ row), dry * row)
        return total


def _between(row: FloatArray) -> FloatArray:
    """(n, n) products between joints of a drive's row (n,), those of a joint with itself left out."""
    product = np.outer(row, row)
    return np.asarray(product - np.diag(np.diag(product)))
