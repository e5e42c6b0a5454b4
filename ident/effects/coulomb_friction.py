"""Coulomb friction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.effects.family import StandardParameter, State
from ident.effects.friction_sign import FrictionSign
from ident.effects.per_joint import joint_parameters
from ident.effects.speed_term import SpeedTerm, speed_columns
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True)
class CoulombFriction:
    """Fc sign(q̇) on each joint, with the sign's smooth form where the arm's settings ask for it."""

    robot: Robot
    sign: FrictionSign
    name = "coulomb_friction"
    sentence = "dry friction of constant size against the motion"

    @property
    def parameters(self) -> tuple[StandardParameter, ...]:
        return joint_parameters(self.robot, self.name, "Fc")

    def speed_terms(self) -> tuple[SpeedTerm, ...]:
        """One per joint."""
        rows = np.eye(self.robot.n).tolist()
        return tuple(SpeedTerm(joint, tuple(row), tuple(row), self.sign) for joint, row in enumerate(rows))

    def columns(self, state: State) -> FloatArray:
        """samples × joints × joints."""
        return speed_columns(self.speed_terms(), state, self.robot.n)
