"""Current offset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.effects.effect import State
from ident.effects.per_joint import diagonal_columns, joint_units
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True)
class CurrentOffset:
    """A constant torque on each joint: the offset of the current measurement."""

    robot: Robot

    name = "current_offset"
    sentence = "constant offset of the measured torque"

    @property
    def parameter_names(self) -> tuple[str, ...]:
        return tuple(f"off{joint + 1}" for joint in range(self.robot.n))

    @property
    def units(self) -> tuple[str, ...]:
        return joint_units(self.robot, "N·m", "N")

    def columns(self, state: State) -> FloatArray:
        """samples × joints × joints."""
        return diagonal_columns(np.ones_like(state.velocity))
