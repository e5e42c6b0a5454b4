"""Rotor inertia."""

from __future__ import annotations

from dataclasses import dataclass

from ident.effects.family import StandardParameter, State
from ident.effects.per_joint import diagonal_columns, joint_parameters
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True)
class RotorInertia:
    """Ia q̈ on each joint: the inertia of rotor and gear seen at the joint."""

    robot: Robot

    name = "rotor_inertia"
    sentence = "inertia of the rotor and gear"

    @property
    def parameters(self) -> tuple[StandardParameter, ...]:
        return joint_parameters(self.robot, self.name, "Ia")

    def columns(self, state: State) -> FloatArray:
        """samples × joints × joints."""
        return diagonal_columns(state.acceleration)
