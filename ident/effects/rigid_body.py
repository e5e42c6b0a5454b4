"""The links' own dynamics: ten standard parameters each, columns from pin."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pinocchio

from ident.effects.family import Place, StandardParameter, State
from robots import rigid_body_model, unit_of
from robots.arrays import FloatArray
from robots.description import Robot
from robots.standard import LINK_SYMBOLS


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
    def parameters(self) -> tuple[StandardParameter, ...]:
        return tuple(
            StandardParameter(symbol, Place("joint", (joint,)), self.name, unit_of(symbol, axis.kind))
            for joint, axis in enumerate(self.robot.joint)
            for symbol in LINK_SYMBOLS
        )

    def columns(self, state: State) -> FloatArray:
        """samples × joints × 10·links, in the order of ``parameters``."""
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
