"""The direct dynamic model (eq. 3) of any model made of effects.

The effects' own columns are probed once to see how each enters: through q̈ (it adds to the mass
matrix), linearly through q̇ (damping), as a constant, or in any other way (evaluated at every step). So
simulation and regressor rest on one definition, and the step stays cheap.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio

from ident.base import random_states
from ident.effects import (
    AsymmetricFriction,
    CoulombFriction,
    Effect,
    FrictionSign,
    RigidBody,
    State,
    WristCoupling,
)
from ident.errors import IdentificationError
from ident.regressor import RegressorModel
from robots.arrays import FloatArray
from robots.description import Robot

_SHARP = 1e-6
"""Width of the smooth sign that stands for an exact one, as a share of the arm's velocity limits."""

_NEWTON_STEPS = 12
_NEWTON_TOLERANCE = 1e-9


class DirectDynamics:
    """M(q) q̈ = τ − N(q, q̇), integrated with friction taken implicitly so that it can stick.

    Raises:
        IdentificationError: a link's identified mass is zero, so that pin cannot hold it.
    """

    def __init__(self, model: RegressorModel, standard: FloatArray) -> None:
        """A model with a standard parameter vector (p,)."""
        self.robot = model.robot
        self._parameters = _by_effect(model, standard)
        self._pin = _loaded_links(model, self._parameters)
        self._data = self._pin.createData()
        n = self.robot.n
        self.drive_inertia = np.zeros((n, n))
        self._damping = np.zeros((n, n))
        self._constant = np.zeros(n)
        self._others: list[tuple[Effect, FloatArray]] = []
        for effect, values in self._parameters:
            if not isinstance(effect, RigidBody):
                self._add(_sharpened(effect), values)
        self._step_of_difference = 1e-6 * float(self.robot.velocity_limits.min())

    def _add(self, effect: Effect, values: FloatArray) -> None:
        inertial, damping, constant, other = _probe(effect, self.robot)
        self.drive_inertia += inertial @ values
        self._damping += damping @ values
        self._constant += constant @ values
        if other.any():
            self._others.append((effect, np.where(other, values, 0.0)))

    def mass_matrix(self, position: FloatArray) -> FloatArray:
        """M(q) with the drives' inertia, n × n.

        Raises:
            IdentificationError: not positive definite; says at which posture and for which joint.
        """
        upper: FloatArray = pinocchio.crba(self._pin, self._data, position)
        mass = np.asarray(np.triu(upper) + np.triu(upper, 1).T + self.drive_inertia)
        try:
            np.linalg.cholesky(mass)
        except np.linalg.LinAlgError as error:
            raise IdentificationError(_explain_mass_matrix(mass, position)) from error
        return mass

    def step(self, position: FloatArray, velocity: FloatArray, torque: FloatArray, h: float) -> FloatArray:
        """Joint velocity (n,) after ``h`` seconds of joint torque (n,)."""
        mass = self.mass_matrix(position)
        gravity = pinocchio.nonLinearEffects(self._pin, self._data, position, velocity)
        momentum = mass @ velocity + h * (torque - gravity - self._constant)
        implicit = mass + h * self._damping
        if not self._others:
            return np.asarray(np.linalg.solve(implicit, momentum))
        return self._solve_with_friction(position, velocity, momentum, implicit, h)

    def _solve_with_friction(
        self, position: FloatArray, velocity: FloatArray, momentum: FloatArray, implicit: FloatArray, h: float
    ) -> FloatArray:
        """Newton on (M + hD) v + h f(v) = momentum; f is monotone, so halving steps always ends well."""
        friction, slope = self._friction(position, velocity)
        guess = velocity
        rest = implicit @ guess + h * friction - momentum
        size = float(np.abs(rest).max())
        for _ in range(_NEWTON_STEPS):
            if size < _NEWTON_TOLERANCE:
                break
            change = np.linalg.solve(implicit + h * slope, rest)
            share = 1.0
            for _ in range(8):
                trial = guess - share * change
                friction, slope = self._friction(position, trial)
                rest_trial = implicit @ trial + h * friction - momentum
                size_trial = float(np.abs(rest_trial).max())
                if size_trial < size:
                    break
                share *= 0.5
            guess, rest, size = trial, rest_trial, size_trial
        return guess

    def _friction(self, position: FloatArray, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Torque (n,) of the effects that are not linear, and its slope over velocity (n, n)."""
        n = velocity.shape[0]
        speeds = np.empty((n + 1, n))
        speeds[:] = velocity
        speeds[1:].flat[:: n + 1] += self._step_of_difference
        state = State(np.broadcast_to(position, speeds.shape), speeds, np.zeros_like(speeds))
        torque = np.zeros_like(speeds)
        for effect, values in self._others:
            torque += effect.columns(state) @ values
        return torque[0], (torque[1:] - torque[0]).T / self._step_of_difference


def _by_effect(model: RegressorModel, standard: FloatArray) -> list[tuple[Effect, FloatArray]]:
    parts, start = [], 0
    for effect in model.effects:
        end = start + len(effect.parameter_names)
        parts.append((effect, standard[start:end]))
        start = end
    return parts


def _loaded_links(model: RegressorModel, parameters: list[tuple[Effect, FloatArray]]) -> pinocchio.Model:
    """A pin model whose links carry the identified standard parameters."""
    for effect, values in parameters:
        if isinstance(effect, RigidBody):
            loaded = effect.model.copy()
            for link, ten in enumerate(values.reshape(-1, 10), start=1):
                if ten[0] == 0.0:
                    raise IdentificationError(f"link {link} has no mass; the simulation needs a prior for it")
                loaded.inertias[link] = pinocchio.Inertia.FromDynamicParameters(ten)
            return loaded
    raise IdentificationError("the model has no rigid bodies; the simulation needs them")


def _sharpened(effect: Effect) -> Effect:
    """An exact friction sign becomes a very steep smooth one, which a solver can pass through."""
    if (
        isinstance(effect, AsymmetricFriction | CoulombFriction | WristCoupling)
        and effect.sign.kind == "sign"
    ):
        width = _SHARP * float(effect.robot.velocity_limits.min())
        return replace(effect, sign=FrictionSign("tanh", width))
    return effect


def _probe(effect: Effect, robot: Robot) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """How columns enter: through q̈ (n, n, p), linearly through q̇ (n, n, p), constant (n, p), else (p,)."""
    n = robot.n
    zero = np.zeros((n, n))
    unit = np.eye(n)
    at_rest = effect.columns(State(zero, zero, zero))
    by_acceleration = effect.columns(State(zero, zero, unit)) - at_rest
    by_velocity = effect.columns(State(zero, unit, zero)) - at_rest
    probe = random_states(robot, seed=1, states=16)
    linear = (
        np.einsum("sa,ajp->sjp", probe.acceleration, by_acceleration)
        + np.einsum("sa,ajp->sjp", probe.velocity, by_velocity)
        + at_rest[0]
    )
    found = effect.columns(probe)
    scale = 1e-9 * (1.0 + np.abs(found).max(axis=(0, 1)))
    other = np.abs(found - linear).max(axis=(0, 1)) > scale
    keep = ~other
    return (
        by_acceleration.transpose(1, 0, 2) * keep,
        by_velocity.transpose(1, 0, 2) * keep,
        at_rest[0] * keep,
        other,
    )


def _explain_mass_matrix(mass: FloatArray, position: FloatArray) -> str:
    values, directions = np.linalg.eigh(mass)
    joint = int(np.argmax(np.abs(directions[:, 0]))) + 1
    posture = ", ".join(f"{q:.3f}" for q in position)
    return (
        f"the identified mass matrix is not positive definite at q = ({posture}): eigenvalue {values[0]:.4g}"
        f" along joint {joint}; the model of that joint's link is not physical, so it cannot be simulated"
    )
