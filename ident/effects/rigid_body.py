"""The links' own dynamics: ten standard parameters each, columns from pin."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pinocchio

from ident.effects.effect import State
from robots import link_parameter_names, rigid_body_model, unit_of
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True)
class RigidBody:
    """Inertia, centrifugal, Coriolis and gravity torques of the moving links."""

    robot: Robot
    model: pinocchio.Model = field(init=False, repr=False, compare=False)
    name = "rigid_body"
    sentence = "inertia, centrifugal, Coriolis and gravity torques of the links"

    def __post_init__(self) -> None:
        object.__setattr__(self, "model", rigid_body_model(self.robot))

    @property
    def parameter_names(self) -> tuple[str, ...]:
        return link_parameter_names(self.robot.n)

    @property
    def units(self) -> tuple[str, ...]:
        return tuple(unit_of(name, self.robot) for name in self.parameter_names)

    def columns(self, state: State) -> FloatArray:
        """samples × joints × 10·links, in the order of ``parameter_names``."""
        samples, joints = state.position.shape
        columns = np.empty((samples, joints, 10 * joints))
        data = self.model.createData()
        position = np.ascontiguousarray(state.position)
        velocity = np.ascontiguousarray(state.velocity)
        acceleration = np.ascontiguousarray(state.acceleration)
        regressor = pinocchio.computeJointTorqueRegressor
        for k in range(samples):
            columns[k] = regressor(self.model, data, position[k], velocity[k], acceleration[k])
        return columns
