"""How each effect enters the direct dynamic model (eq. 3), found from the columns of the regressor.

Links are the rigid-body dynamics; speed terms say their own shape. The columns of all else are probed
once: through q̈ (it adds to the mass matrix), linearly through q̇ (damping), as a constant, or in any other
way (evaluated at every step). So simulation and regressor rest on one definition of an effect.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
import pinocchio

from ident.base import random_states
from ident.effects import (
    Effect,
    FrictionSign,
    HasSpeedTerms,
    RigidBody,
    SpeedTerm,
    State,
    speed_columns,
)
from ident.errors import IdentificationError
from ident.regressor import RegressorModel
from robots.arrays import FloatArray
from robots.description import Robot

_SHARP = 1e-6
"""Width of the smooth sign that stands for an exact one, as a share of the arm's velocity limits."""


@dataclass(frozen=True)
class TorqueParts:
    """A model with its parameters, sorted by how the torque depends on the motion.

    Attributes:
        links: (n, 10) standard parameters of the links.
        inertia: (n, n) of the drives, times q̈.
        damping: (n, n), times q̇.
        constant: (n,).
        terms: (K, 3 + 2n) speed terms: 1/width (1 where the law is the speed itself), 1 for such a law,
            direction, speed row, torque row times parameter.
        others: effects that fit none of these, with their parameters.
    """

    links: FloatArray
    inertia: FloatArray
    damping: FloatArray
    constant: FloatArray
    terms: FloatArray
    others: tuple[tuple[Effect, FloatArray], ...]


@dataclass(frozen=True)
class _Structure:
    """An effect's columns: through q̈ and q̇ (n, n, p), constant (n, p), otherwise (p,); its speed terms."""

    inertial: FloatArray
    damping: FloatArray
    constant: FloatArray
    other: FloatArray
    terms: tuple[SpeedTerm, ...]


class ModelStructure:
    """The structure of a model, from which the parts of any parameter vector follow at once.

    Attributes:
        robot: the arm.
        rigid_body: pin's model of the links.

    Raises:
        IdentificationError: the model has no rigid bodies.
    """

    def __init__(self, model: RegressorModel) -> None:
        self.robot = model.robot
        self._effects = tuple(_sharpened(effect, model.robot) for effect in model.effects)
        links = [effect for effect in self._effects if isinstance(effect, RigidBody)]
        if not links:
            raise IdentificationError("the model has no rigid bodies; the simulation needs them")
        self.rigid_body: pinocchio.Model = links[0].model
        self._structures = tuple(
            None if isinstance(effect, RigidBody) else _structure(effect, model.robot)
            for effect in self._effects
        )

    def parts(self, standard: FloatArray) -> TorqueParts:
        """The parts of one standard parameter vector (p,)."""
        n = self.robot.n
        links = np.zeros((n, 10))
        inertia, damping, constant = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
        terms: list[FloatArray] = []
        others: list[tuple[Effect, FloatArray]] = []
        start = 0
        for effect, structure in zip(self._effects, self._structures, strict=True):
            end = start + len(effect.parameter_names)
            values = np.asarray(standard[start:end], dtype=np.float64)
            start = end
            if structure is None:
                links += values.reshape(n, 10)
                continue
            inertia += structure.inertial @ values
            damping += structure.damping @ values
            constant += structure.constant @ values
            terms += [_term_row(term, values[term.parameter]) for term in structure.terms]
            if structure.other.any():
                others.append((effect, values * structure.other))
        rows = np.array(terms).reshape(-1, 3 + 2 * n)
        return TorqueParts(links, inertia, damping, constant, rows, tuple(others))


def _term_row(term: SpeedTerm, value: float) -> FloatArray:
    law = (1.0, 1.0) if term.law is None else (1.0 / term.law.width, 0.0)
    torque = [value * share for share in term.torque_row]
    return np.array([*law, term.direction, *term.speed_row, *torque])


def _sharpened(effect: Effect, robot: Robot) -> Effect:
    """An exact friction sign becomes a very steep smooth one, which a solver can pass through."""
    changed: Any = effect
    if not is_dataclass(effect):
        return effect
    for field in fields(changed):
        law = getattr(effect, field.name)
        if isinstance(law, FrictionSign) and law.kind == "sign":
            width = _SHARP * float(robot.velocity_limits.min())
            changed = replace(changed, **{field.name: FrictionSign("tanh", width)})
    sharpened: Effect = changed
    return sharpened


def _structure(effect: Effect, robot: Robot) -> _Structure:
    n = robot.n
    terms = effect.speed_terms() if isinstance(effect, HasSpeedTerms) else ()
    parameters = len(effect.parameter_names)

    def columns(state: State) -> FloatArray:
        return effect.columns(state) - speed_columns(terms, state, parameters)

    zero, unit = np.zeros((n, n)), np.eye(n)
    at_rest = columns(State(zero, zero, zero))
    by_acceleration = columns(State(zero, zero, unit)) - at_rest
    by_velocity = columns(State(zero, unit, zero)) - at_rest
    probe = random_states(robot, seed=1, states=16)
    linear = (
        np.einsum("sa,ajp->sjp", probe.acceleration, by_acceleration)
        + np.einsum("sa,ajp->sjp", probe.velocity, by_velocity)
        + at_rest[0]
    )
    found = columns(probe)
    scale = 1e-9 * (1.0 + np.abs(found).max(axis=(0, 1)))
    other = np.abs(found - linear).max(axis=(0, 1)) > scale
    return _Structure(
        by_acceleration.transpose(1, 0, 2) * ~other,
        by_velocity.transpose(1, 0, 2) * ~other,
        at_rest[0] * ~other,
        other.astype(np.float64),
        tuple(term for term in terms if not other[term.parameter]),
    )
