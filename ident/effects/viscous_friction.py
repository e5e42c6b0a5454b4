"""Viscous friction."""

from __future__ import annotations

from dataclasses import dataclass

from ident.effects.family import StandardParameter, State
from ident.effects.per_joint import diagonal_columns, joint_parameters
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True)
class ViscousFriction:
    """Fv q̇ on each joint."""

    robot: Robot

    name = "viscous_friction"
    sentence = "friction that grows in proportion to speed"

    @property
    def parameters(self) -> tuple[StandardParameter, ...]:
        return joint_parameters(self.robot, self.name, "Fv")

    def columns(self, state: State) -> FloatArray:
        """samples × joints × joints."""
        return diagonal_columns(state.velocity)
