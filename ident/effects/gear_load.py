"""Torque through a drive's gear, which friction of the load follows: for columns and for the simulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.effects.family import Place, PresentModel, State
from ident.effects.placed import drive_torque
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True, eq=False)
class GearLoad:
    """Torque of the links at a drive's output, and of the model's offset where that acts behind the gear.

    Attributes:
        robot, place: the arm, and the drive.
        present: the model, asked for torques.
        offset_at_link: whether its offset is a load (1) or an error of measurement (0).
    """

    robot: Robot
    place: Place
    present: PresentModel
    offset_at_link: float

    def torque(self, state: State) -> FloatArray:
        """(samples,) N·m (or N)."""
        joints = self.present.link_torque(state) + self.offset_at_link * self.present.offset_torque()
        return drive_torque(self.robot, joints, self.place.joints[0])

    @property
    def row(self) -> FloatArray:
        """(n,) what of each joint's torque passes through the gear."""
        inverse = np.linalg.inv(self.robot.transmission_matrix)
        return np.asarray(inverse[:, self.place.joints[0]], dtype=np.float64)

    @property
    def offset(self) -> float:
        """The constant part of the load, N·m (or N)."""
        return float(self.offset_at_link * self.present.offset_torque() @ self.row)
