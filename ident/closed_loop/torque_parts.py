"""How each effect enters the direct dynamic model (eq. 3), found from the columns of the regressor.

Links are the rigid-body dynamics; speed terms say their own shape; some effects return their parts. The
columns of all else are probed once: through q̈ (it adds to the mass matrix), linearly through q̇ (damping), as
a constant, or in any other way (evaluated at every step). So simulation and regressor rest on one definition
of an effect.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
import pinocchio

from ident.closed_loop.friction_rows import FrictionRows, speed_term_rows
from ident.effects import (
    Effect,
    FrictionSign,
    HasSpeedTerms,
    RigidBody,
    SpeedTerm,
    State,
    speed_columns,
)
from ident.effects.simulated import HasSimulatedParts, SimulatedParts
from ident.errors import IdentificationError
from ident.parameters.base import random_states
from ident.parameters.regressor import RegressorModel
from robots.arrays import FloatArray
from robots.carried import Load
from robots.description import Robot

_SHARP = 1e-6
"""Width of the smooth sign that stands for an exact one, as a share of the arm's velocity limits."""


@dataclass(frozen=True)
class TorqueParts:
    """A model with its parameters, sorted by how the torque depends on the motion.

    Attributes:
        links: (n, 10) standard parameters of the links.
        gravity: (3,) m/s².
        inertia: (n, n) of the drives, times q̈.
        damping: (n, n), times q̇.
        constant: (n,).
        friction: the speed terms of the usual effects.
        extra: what only some models have.
        others: effects that fit none of these, with their parameters.
    """

    links: FloatArray
    gravity: FloatArray
    inertia: FloatArray
    damping: FloatArray
    constant: FloatArray
    friction: FrictionRows
    extra: SimulatedParts
    others: tuple[tuple[Effect, FloatArray], ...]

    def carrying(self, load: Load | None) -> TorqueParts:
        """The same while the arm carries a known body."""
        return self if load is None else replace(self, links=self.links + load.links(self.links.shape[0]))

    @property
    def usual(self) -> bool:
        """Whether drives move rigidly with the joints and friction is speed terms: nothing extra."""
        extra = self.extra
        others = (extra.position, extra.friction, extra.springs, extra.errors, extra.drives, extra.feet)
        return not any(others)


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
        effects = tuple(_sharpened(effect, model.robot) for effect in model.effects)
        self._effects = RegressorModel(model.robot, effects).columns_of_effects
        links = [effect for effect in effects if isinstance(effect, RigidBody)]
        if not links:
            raise IdentificationError("the model has no rigid bodies; the simulation needs them")
        self.rigid_body: pinocchio.Model = links[0].model
        self._structures = tuple(
            None if isinstance(effect, RigidBody | HasSimulatedParts) else _structure(effect, model.robot)
            for effect in effects
        )

    def parts(self, standard: FloatArray) -> TorqueParts:
        """The parts of one standard parameter vector (p,)."""
        n = self.robot.n
        links, gravity = np.zeros((n, 10)), np.array(self.rigid_body.gravity.linear, dtype=np.float64)
        inertia, damping, constant = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
        terms: list[tuple[SpeedTerm, float]] = []
        others: list[tuple[Effect, FloatArray]] = []
        extras: list[SimulatedParts] = []
        for (effect, own), structure in zip(self._effects, self._structures, strict=True):
            values = np.asarray(standard[own], dtype=np.float64)
            if isinstance(effect, RigidBody):
                links += values.reshape(n, 10)
            elif structure is None:
                extras.append(_simulated(effect, values))
            else:
                inertia += structure.inertial @ values
                damping += structure.damping @ values
                constant += structure.constant @ values
                terms += [(term, float(values[term.parameter])) for term in structure.terms]
                if structure.other.any():
                    others.append((effect, values * structure.other))
        for total, name in (
            (links, "links"),
            (gravity, "gravity"),
            (inertia, "inertia"),
            (damping, "damping"),
            (constant, "constant"),
        ):
            for parts in extras:
                if getattr(parts, name) is not None:
                    total += getattr(parts, name)
        rows = speed_term_rows(terms, n)
        return TorqueParts(links, gravity, inertia, damping, constant, rows, _together(extras), tuple(others))


def _simulated(effect: Effect, values: FloatArray) -> SimulatedParts:
    if not isinstance(effect, HasSimulatedParts):
        raise TypeError(effect.name)
    return effect.simulated(values)


def _together(parts: list[SimulatedParts]) -> SimulatedParts:
    """The parts that are not sums, one after the other."""
    return SimulatedParts(
        position=tuple(torque for one in parts for torque in one.position),
        friction=tuple(torque for one in parts for torque in one.friction),
        springs=tuple(spring for one in parts for spring in one.springs),
        errors=tuple(error for one in parts for error in one.errors),
        drives=tuple(change for one in parts for change in one.drives),
        feet=tuple(foot for one in parts for foot in one.feet),
    )


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
    parameters = len(effect.parameters)

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
