"""Viscous friction."""

from __future__ import annotations

from dataclasses import dataclass

from ident.effects.effect import State
from ident.effects.per_joint import diagonal_columns, joint_units
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True)
class ViscousFriction:
    """Fv q̇ on each joint."""

    robot: Robot

    name = "viscous_friction"
    sentence = "friction that grows in proportion to speed"

    @property
    def parameter_names(self) -> tuple[str, ...]:
        return tuple(f"Fv{joint + 1}" for joint in range(self.robot.n))

    @property
    def units(self) -> tuple[str, ...]:
        return joint_units(self.robot, "N·m·s/rad", "N·s/m")

    def columns(self, state: State) -> FloatArray:
        """samples × joints × joints."""
        return diagonal_columns(state.velocity)
