"""The direct dynamic model (eq. 3) of any model made of effects, in plain Python.

It serves models with effects that the compiled closed loop does not know, and says what is wrong with a
mass matrix. Links are pin's; friction is taken implicitly so that it can stick.
"""

from __future__ import annotations

import numpy as np
import pinocchio

from ident.closed_loop.friction_rows import shares_at_new_velocity
from ident.closed_loop.torque_parts import ModelStructure, TorqueParts
from ident.effects import State
from ident.errors import IdentificationError, MassMatrixError
from robots.arrays import FloatArray

_NEWTON_STEPS = 50
_BISECTIONS = 50
_NEWTON_TOLERANCE = 1e-10
"""Residual of the implicit step, as a share of the largest push."""


class DirectDynamics:
    """M(q) q̈ = τ − N(q, q̇), integrated with friction taken implicitly so that it can stick.

    Raises:
        IdentificationError: a link's identified mass is zero, so that pin cannot hold it.
    """

    def __init__(self, structure: ModelStructure, parts: TorqueParts, position: FloatArray, h: float) -> None:
        """A model's structure with one parameter vector's parts; posture (n,) at the start; step, s."""
        self._parts = parts
        self._pin = _loaded_links(structure.rigid_body, parts.links)
        self._pin.gravity.linear = parts.gravity
        self._data = self._pin.createData()
        self._step_of_difference = 1e-6 * float(structure.robot.velocity_limits.min())
        rows = parts.friction
        self._inverse_width, self._linear, self._direction = rows.heads[:, :3].T
        self._speed_rows = rows.speed
        mass = self.mass_matrix(position)
        shares = shares_at_new_velocity(rows.heads, rows.speed, rows.torque, rows.strength, mass, h)
        self._at_new = (shares * rows.strength)[:, np.newaxis] * rows.torque
        self._at_old = ((1.0 - shares) * rows.strength)[:, np.newaxis] * rows.torque
        self._h = h

    def mass_matrix(self, position: FloatArray) -> FloatArray:
        """M(q) with the drives' inertia, n × n.

        Raises:
            MassMatrixError: not positive definite; says at which posture and for which joint.
        """
        upper: FloatArray = pinocchio.crba(self._pin, self._data, position)
        mass = np.asarray(np.triu(upper) + np.triu(upper, 1).T + self._parts.inertia)
        check_mass_matrix(mass, position)
        return mass

    def step(
        self, position: FloatArray, velocity: FloatArray, last: FloatArray, torque: FloatArray
    ) -> FloatArray:
        """Joint velocity (n,) after a step under joint torque (n,).

        Args:
            position: (n,) in the middle of the step.
            velocity: (n,) before it.
            last: (n,) velocity a step earlier, from which follows that in the middle.
            torque: (n,) held over the step.
        """
        h = self._h
        mass = self.mass_matrix(position)
        middle = velocity + 0.5 * (velocity - last)
        gravity = pinocchio.nonLinearEffects(self._pin, self._data, position, middle)
        old = self._laws(velocity)[0] @ self._at_old
        push = h * (torque - gravity - old - self._parts.constant - self._parts.damping @ velocity)
        implicit = mass + 0.5 * h * self._parts.damping
        return self._solve_with_friction(position, velocity, push, implicit, h)

    def _solve_with_friction(
        self, position: FloatArray, velocity: FloatArray, push: FloatArray, implicit: FloatArray, h: float
    ) -> FloatArray:
        """Newton on (M + hD/2) (v⁺ − v) + h f(v⁺) = push, as ``ident.kernels.friction.implicit_step``."""
        enough = _NEWTON_TOLERANCE * float(np.abs(push).max())
        guess = velocity
        friction, slope = self._friction(position, guess)
        rest = h * friction - push
        size = float(np.abs(rest).max())
        for _ in range(_NEWTON_STEPS):
            if size <= enough:
                break
            change = np.linalg.solve(implicit + h * slope, rest)
            uphill = float(change @ rest)
            share, below, above = 1.0, 0.0, 1.0
            for _ in range(_BISECTIONS):
                trial = guess - share * change
                friction, slope = self._friction(position, trial)
                rest_trial = implicit @ (trial - velocity) + h * friction - push
                size_trial = float(np.abs(rest_trial).max())
                along = float(change @ rest_trial)
                if size_trial <= 0.5 * size or abs(along) <= 0.1 * uphill or (share == 1.0 and along > 0.0):
                    break
                below, above = (share, above) if along > 0.0 else (below, share)
                share = 0.5 * (below + above)
            guess, rest, size = trial, rest_trial, size_trial
        return guess

    def _laws(self, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Each speed term's law and its slope over the speed, (K,)."""
        x = (self._speed_rows @ velocity) * self._inverse_width
        acts = self._direction * x >= 0
        law = np.where(self._linear, x, np.tanh(x)) * acts
        return law, np.where(self._linear, 1.0, 1.0 - law**2) * acts * self._inverse_width

    def _friction(self, position: FloatArray, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Torque (n,) of speed terms and of all that is not linear, and its slope over velocity (n, n)."""
        law, steepness = self._laws(velocity)
        torque = law @ self._at_new
        slope = (self._at_new.T * steepness) @ self._speed_rows
        if not self._parts.others:
            return torque, slope
        n = velocity.shape[0]
        speeds = np.empty((n + 1, n))
        speeds[:] = velocity
        speeds[1:].flat[:: n + 1] += self._step_of_difference
        state = State(np.broadcast_to(position, speeds.shape), speeds, np.zeros_like(speeds))
        others = np.zeros_like(speeds)
        for effect, values in self._parts.others:
            others += effect.columns(state) @ values
        return torque + others[0], slope + (others[1:] - others[0]).T / self._step_of_difference


def _loaded_links(model: pinocchio.Model, links: FloatArray) -> pinocchio.Model:
    """A pin model whose links carry standard parameters (n, 10)."""
    loaded = model.copy()
    for link, ten in enumerate(links, start=1):
        if ten[0] == 0.0:
            raise IdentificationError(f"link {link} has no mass; the simulation needs a prior for it")
        loaded.inertias[link] = pinocchio.Inertia.FromDynamicParameters(ten)
    return loaded


def check_mass_matrix(mass: FloatArray, position: FloatArray) -> None:
    """Refuse a mass matrix (n, n) that no arm can have.

    Raises:
        MassMatrixError: not positive definite; says at which posture and for which joint.
    """
    values, directions = np.linalg.eigh(mass)
    if values[0] > 0.0:
        return
    joint = int(np.argmax(np.abs(directions[:, 0]))) + 1
    posture = ", ".join(f"{q:.3f}" for q in position)
    raise MassMatrixError(
        f"the identified mass matrix is not positive definite at q = ({posture}): eigenvalue {values[0]:.4g}"
        f" along joint {joint}; no arm has that. Either an effect is missing, or the motion shows that link"
        " too little; --method consistent tells which: it simulates the nearest arm that can exist"
    )
