"""Rotor inertia."""

from __future__ import annotations

from dataclasses import dataclass

from ident.effects.effect import State
from ident.effects.per_joint import diagonal_columns, joint_units
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True)
class RotorInertia:
    """Ia q̈ on each joint: the inertia of rotor and gear seen at the joint."""

    robot: Robot

    name = "rotor_inertia"
    sentence = "inertia of the rotor and gear"

    @property
    def parameter_names(self) -> tuple[str, ...]:
        return tuple(f"Ia{joint + 1}" for joint in range(self.robot.n))

    @property
    def units(self) -> tuple[str, ...]:
        return joint_units(self.robot, "kg·m²", "kg")

    def columns(self, state: State) -> FloatArray:
        """samples × joints × joints."""
        return diagonal_columns(state.acceleration)
