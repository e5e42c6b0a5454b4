"""Coupled axes: a drive whose gear output moves with more than one joint, as on many wrists.

With drive output = T · joint position, drive k adds Tₖᵀ(Tₖ q̈) of inertia and Tₖᵀ(Tₖ q̇) of viscous
friction. The diagonal parts of those are already in the joints' own Ia and Fv, so the columns here
hold what is left: the products between joints, and the whole Coulomb term of the drive's own speed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.effects.effect import State
from ident.effects.friction_sign import FrictionSign
from ident.effects.per_joint import joint_units
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
    def parameter_names(self) -> tuple[str, ...]:
        drives = coupled_drives(self.robot)
        return tuple(f"{symbol}{k + 1}" for k in drives for symbol in ("Iam", "Fvm", "Fcm"))

    @property
    def units(self) -> tuple[str, ...]:
        inertia = joint_units(self.robot, "kg·m²", "kg")
        viscous = joint_units(self.robot, "N·m·s/rad", "N·s/m")
        coulomb = joint_units(self.robot, "N·m", "N")
        drives = coupled_drives(self.robot)
        return tuple(unit for k in drives for unit in (inertia[k], viscous[k], coulomb[k]))

    def columns(self, state: State) -> FloatArray:
        """samples × joints × (3 per coupled drive)."""
        matrix = self.robot.transmission_matrix
        parts = []
        for drive in coupled_drives(self.robot):
            row = matrix[drive]
            product = np.outer(row, row)
            between = product - np.diag(np.diag(product))
            speed = state.velocity @ row
            parts += [
                state.acceleration @ between,
                state.velocity @ between,
                self.sign(speed)[:, np.newaxis] * row,
            ]
        if not parts:
            return np.zeros((*state.velocity.shape, 0))
        return np.stack(parts, axis=2)
