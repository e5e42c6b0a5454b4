"""Friction that differs with the direction of motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.effects.effect import State
from ident.effects.friction_sign import FrictionSign
from ident.effects.per_joint import diagonal_columns, joint_units
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True)
class AsymmetricFriction:
    """Fvp q̇ + Fcp sign(q̇) forwards and Fvn q̇ + Fcn sign(q̇) backwards, on each joint.

    It stands in the place of viscous and Coulomb friction. A current offset cannot be told apart from
    the difference of Fcp and Fcn, so the base parameters regroup it with them.
    """

    robot: Robot
    sign: FrictionSign
    name = "asymmetric_friction"
    sentence = "viscous and dry friction of different size in either direction"

    @property
    def parameter_names(self) -> tuple[str, ...]:
        return tuple(
            f"{symbol}{joint + 1}" for symbol in ("Fvp", "Fcp", "Fvn", "Fcn") for joint in range(self.robot.n)
        )

    @property
    def units(self) -> tuple[str, ...]:
        viscous = joint_units(self.robot, "N·m·s/rad", "N·s/m")
        coulomb = joint_units(self.robot, "N·m", "N")
        return (viscous + coulomb) * 2

    def columns(self, state: State) -> FloatArray:
        """samples × joints × 4·joints."""
        speed, sign = state.velocity, self.sign(state.velocity)
        forwards, backwards = speed > 0, speed < 0
        parts = [
            diagonal_columns(np.where(direction, values, 0.0))
            for direction in (forwards, backwards)
            for values in (speed, sign)
        ]
        return np.concatenate(parts, axis=2)
