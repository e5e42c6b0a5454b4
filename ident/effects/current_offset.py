"""Current offset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.effects.family import StandardParameter, State
from ident.effects.per_joint import diagonal_columns, joint_parameters
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True)
class CurrentOffset:
    """A constant torque on each joint: the offset of the current measurement."""

    robot: Robot

    name = "current_offset"
    sentence = "constant offset of the measured torque"

    @property
    def parameters(self) -> tuple[StandardParameter, ...]:
        return joint_parameters(self.robot, self.name, "off")

    def columns(self, state: State) -> FloatArray:
        """samples × joints × joints."""
        return diagonal_columns(np.ones_like(state.velocity))
