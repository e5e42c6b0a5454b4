"""The model under examination, as effects ask it for torques."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import pinocchio

from ident.closed_loop.chain import chain_frames
from ident.discrepancy.lately import Lately
from ident.effects import CurrentOffset, RigidBody, State
from ident.effects.calm_motion import calm_motion
from ident.regressor import RegressorModel
from robots.arrays import FloatArray

_LIGHT = 1e-6
"""kg; far below what any torque shows."""


@dataclass(frozen=True)
class Present:
    """A model with its standard parameters (p,)."""

    model: RegressorModel
    standard: FloatArray
    _torques: Lately[FloatArray] = field(default_factory=Lately, repr=False, compare=False)
    _link_torques: Lately[FloatArray] = field(default_factory=Lately, repr=False, compare=False)
    _masses: Lately[FloatArray] = field(default_factory=Lately, repr=False, compare=False)
    _calm: Lately[State] = field(default_factory=Lately, repr=False, compare=False)

    def torque(self, state: State) -> FloatArray:
        """Joint torque of the whole model, samples × joints, N·m (or N)."""
        if state.torque is None:
            return self._torque(state)
        return self._torques.of(state, lambda: self._torque(state))  # recorded: many effects ask for it

    def calm(self, state: State) -> State:
        """The motion through a filter with a lower cut-off."""
        return self._calm.of(state, lambda: calm_motion(self.model.robot, state))

    def link_torque(self, state: State) -> FloatArray:
        """Torque of the links alone, samples × joints."""
        if state.torque is None:
            return self._link_torque(state)
        return self._link_torques.of(state, lambda: self._link_torque(state))

    def _torque(self, state: State) -> FloatArray:
        total = self.link_torque(state)
        start = 0
        for effect in self.model.effects:
            end = start + len(effect.parameter_names)
            if not isinstance(effect, RigidBody):
                total = total + effect.columns(state) @ self.standard[start:end]
            start = end
        return total

    def _link_torque(self, state: State) -> FloatArray:
        chain = self._chain
        if chain is not None:
            return self._along(chain, state.position, state.velocity, state.acceleration)[0]
        model = self._links()
        data = model.createData()
        torque = np.zeros_like(state.position)
        for k in range(state.position.shape[0]):
            q, v, a = state.position[k], state.velocity[k], state.acceleration[k]
            torque[k] = pinocchio.rnea(model, data, q, v, a)
        return torque

    def link_mass_matrix(self, position: FloatArray) -> FloatArray:
        """Mass matrix of the links alone, samples × joints × joints."""
        return self._masses.of(position, lambda: self._mass_matrix(position))

    def _mass_matrix(self, position: FloatArray) -> FloatArray:
        chain = self._chain
        if chain is not None:
            still = np.zeros_like(position)
            return self._along(chain, position, still, still)[1]
        model = self._links()
        data = model.createData()
        samples, joints = position.shape
        mass = np.empty((samples, joints, joints))
        for k in range(samples):
            mass[k] = pinocchio.crba(model, data, position[k])
        upper = np.triu(mass)
        return np.asarray(upper + np.triu(mass, 1).transpose(0, 2, 1))

    def offset_torque(self) -> FloatArray:
        """Constant torque on each joint (n,) that the model has, from whatever it comes."""
        for effect in self.model.effects:
            if isinstance(effect, CurrentOffset):
                start = self.model.names.index(effect.parameter_names[0])
                return np.asarray(self.standard[start : start + len(effect.parameter_names)])
        return np.zeros(self.model.robot.n)

    def drive_friction(self, drive: int) -> tuple[float, float]:
        """Dry and viscous friction of a drive (from 0): the usual terms alone, none below zero.

        A drive that turns with several joints has dry friction over its own joint's speed and over its own.
        """
        named = dict(zip(self.model.names, self.standard, strict=True))
        number = drive + 1
        dry = named.get(f"Fc{number}", 0.0) + named.get(f"Fcm{number}", 0.0)
        return max(float(dry), 0.0), max(float(named.get(f"Fv{number}", 0.0)), 0.0)

    def gravity_torque(self, position: FloatArray, gravity: FloatArray) -> FloatArray:
        """Torque that holds the links against a gravity (3,), m/s² in the base: samples × joints."""
        model = self._links()
        model.gravity.linear = gravity
        data = model.createData()
        torque = np.zeros_like(position)
        for k in range(position.shape[0]):
            torque[k] = pinocchio.computeGeneralizedGravity(model, data, position[k])
        return torque

    @cached_property
    def _chain(self) -> FloatArray | None:
        """Constants of the joints for machine code; None where the links branch."""
        return chain_frames(self._rigid_body.model)

    @property
    def _gravity(self) -> FloatArray:
        return np.array(self._rigid_body.model.gravity.linear, dtype=np.float64)

    @property
    def _rigid_body(self) -> RigidBody:
        return next(effect for effect in self.model.effects if isinstance(effect, RigidBody))

    def _along(
        self, frames: FloatArray, position: FloatArray, velocity: FloatArray, acceleration: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        # Imported here: the compiler takes a second to load.
        from ident.discrepancy.link_torque import along_motion

        samples, n = position.shape
        torque, masses = np.empty((samples, n)), np.empty((samples, n, n))
        along_motion(
            tuple(range(n)),
            frames,
            self._link_parameters(),
            self._gravity,
            np.ascontiguousarray(position),
            np.ascontiguousarray(velocity),
            np.ascontiguousarray(acceleration),
            torque,
            masses,
        )
        return torque, masses

    def _link_parameters(self) -> FloatArray:
        links = self._rigid_body
        start = self.model.names.index(links.parameter_names[0])
        return np.ascontiguousarray(self.standard[start : start + len(links.parameter_names)].reshape(-1, 10))

    def _links(self) -> pinocchio.Model:
        links = self._rigid_body
        start = self.model.names.index(links.parameter_names[0])
        values = self.standard[start : start + len(links.parameter_names)].reshape(-1, 10)
        loaded = links.model.copy()
        for joint, ten in enumerate(values, start=1):
            loaded.inertias[joint] = _inertia(ten)
        return loaded


def _inertia(ten: FloatArray) -> pinocchio.Inertia:
    """Ten standard parameters as pin's inertia, which divides by the mass: a massless link gets a little."""
    return pinocchio.Inertia.FromDynamicParameters(ten if ten[0] else np.array([_LIGHT, *ten[1:]]))
