"""The links' own dynamics: ten standard parameters each, columns from pin."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pinocchio

from ident.effects.chain import chain_frames
from ident.effects.family import Place, StandardParameter
from ident.effects.state import State
from robots import rigid_body_model, unit_of
from robots.arrays import FloatArray
from robots.description import Robot
from robots.standard import LINK_SYMBOLS

_FEW = 2000
"""Samples that pin is done with before the compiler is loaded."""


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
        return self.columns_from(0, state)

    def columns_from(self, first: int, state: State) -> FloatArray:
        """The same of the links from one on, counted from 0: samples × joints × 10·(links − first)."""
        samples, joints = state.position.shape
        position, velocity, acceleration = (
            np.ascontiguousarray(one) for one in (state.position, state.velocity, state.acceleration)
        )
        if self._frames is None or samples < _FEW:
            return self._by_pin(position, velocity, acceleration)[:, :, 10 * first :]
        # Imported here: the compiler takes a second to load.
        from ident.effects.link_columns import link_columns

        columns = np.zeros((samples, joints, 10 * (joints - first)))
        gravity = np.array(self.model.gravity.linear, dtype=np.float64)
        link_columns(self._frames, gravity, position, velocity, acceleration, first, columns)
        return columns

    @cached_property
    def _frames(self) -> FloatArray | None:
        return chain_frames(self.model)

    def _by_pin(self, position: FloatArray, velocity: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Of a branched chain, or of a few samples."""
        samples, joints = position.shape
        columns = np.empty((samples, joints, 10 * joints))
        data, regressor = self.model.createData(), pinocchio.computeJointTorqueRegressor
        for k in range(samples):
            columns[k] = regressor(self.model, data, position[k], velocity[k], acceleration[k])
        return columns
