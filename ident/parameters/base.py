"""Base parameters: the fewest from which the model can be computed (Mayeda 1990; Gautier 1991).

The regrouping is structural: columns of the standard regressor at random states are orthogonalised in
their own order, so the first of any dependent set stays and the later ones are expressed in it. The
order is fixed and the states come from a fixed seed, so a model always gives the same set.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ident.effects import Effect, RigidBody, State
from ident.effects.chain import chain_frames
from ident.effects.family import StandardParameter
from ident.effects.found import Found
from ident.effects.torque_of import torque_of
from ident.parameters.chain import chain_torque
from ident.parameters.regressor import RegressorModel
from robots.arrays import BoolArray, FloatArray, IntArray
from robots.description import Robot

_RANK_TOLERANCE = 1e-6
"""A column of unit norm whose part orthogonal to those before is below this depends on them.

Covariances are made of XᵀX, where such a column leaves the square of it: four digits above rounding.
"""

_SMALLEST_RELATION = 1e-7
"""Regrouping factors below this (relative to the columns' scale) are rounding, not structure."""


@dataclass(frozen=True)
class BaseParameters:
    """The base set of a model and its relation to the standard parameters.

    Attributes:
        model: the model it belongs to.
        independent: (b,) indices of the columns that stay.
        relation: (b, p): base vector = relation · standard vector.
    """

    model: RegressorModel
    independent: IntArray
    relation: FloatArray

    @property
    def names(self) -> tuple[str, ...]:
        """Names (b,): the leading standard parameter, with an R where others are regrouped with it."""
        regrouped = np.count_nonzero(self.relation, axis=1) > 1
        return tuple(
            parameter.name + ("R" if more else "")
            for parameter, more in zip(self.leading, regrouped, strict=True)
        )

    @property
    def leading(self) -> tuple[StandardParameter, ...]:
        """The standard parameter (b,) that each is the first of."""
        standard = self.model.parameters
        return tuple(standard[column] for column in self.independent)

    @property
    def units(self) -> tuple[str, ...]:
        return tuple(parameter.unit for parameter in self.leading)

    @property
    def expressions(self) -> tuple[str, ...]:
        """The regrouping relations in print, e.g. ``ZZ1 + Ia1 + YY2 + 0.07 MZ3``."""
        names = self.model.names
        return tuple(_expression(row, names) for row in self.relation)

    def regroup(self, standard: FloatArray | dict[str, float]) -> FloatArray:
        """Base vector (b,) of a standard vector (p,) or of named standard values."""
        if isinstance(standard, dict):
            standard = self.model.standard_parameters(standard)
        return np.asarray(self.relation @ standard)

    def standard_from(self, base: FloatArray, prior: FloatArray) -> FloatArray:
        """The standard vector (p,) that has this base vector and is nearest to a prior (p,), e.g. CAD."""
        shift = np.linalg.lstsq(self.relation, base - self.relation @ prior, rcond=None)[0]
        return np.asarray(prior + shift)

    def columns(self, state: State) -> FloatArray:
        """The base regressor IDM(q, q̇, q̈) of eq. 2: samples × joints × b."""
        columns = np.empty((*state.position.shape, self.independent.size))
        for effect, places, own in self.columns_of_effects:
            columns[:, :, places] = effect.columns(state)[:, :, own]
        return columns

    @cached_property
    def columns_of_effects(self) -> tuple[tuple[Effect, IntArray, IntArray], ...]:
        """Each effect that is in the base regressor, which of its columns are its own, and which it is of."""
        found = []
        for effect, part in self.model.columns_of_effects:
            places = np.flatnonzero((self.independent >= part.start) & (self.independent < part.stop))
            if places.size:
                found.append((effect, places, self.independent[places] - part.start))
        return tuple(found)

    def torque(self, state: State, values: FloatArray) -> FloatArray:
        """Joint torque of base parameters (b,), samples × joints, N·m (or N): no regressor of the links."""
        standard = np.zeros(len(self.model.names))
        standard[self.independent] = values
        torque = np.zeros_like(state.position)
        for effect, own in self.model.columns_of_effects:
            if not standard[own].any():
                continue
            chain = chain_frames(effect.model) if isinstance(effect, RigidBody) else None
            if chain is None or not isinstance(effect, RigidBody):
                torque += torque_of(effect, state, standard[own])
            else:
                gravity = np.array(effect.model.gravity.linear, dtype=np.float64)
                links = standard[own].reshape(-1, 10)
                torque += chain_torque(
                    chain, links, gravity, state.position, state.velocity, state.acceleration
                )
        return torque

    def with_effects(self, effects: Sequence[Effect], kept: BoolArray) -> BaseParameters:
        """The same of the model with effects added, whose parameters are base parameters of their own.

        Args:
            effects: what is added.
            kept: over all their parameters, which the model has; the others stay zero.
        """
        model = RegressorModel(self.model.robot, (*self.model.effects, *effects))
        b, p = self.relation.shape
        more = np.flatnonzero(kept)
        relation = np.zeros((b + more.size, len(model.names)))
        relation[:b, :p] = self.relation
        relation[b + np.arange(more.size), p + more] = 1.0
        return BaseParameters(model, np.concatenate([self.independent, p + more]), relation)


def base_parameters(model: RegressorModel, seed: int = 0, states: int = 200) -> BaseParameters:
    """Find the base set of a model from random states within the arm's limits.

    Parameters of effects that were found are base parameters of their own, after all others: most have a
    history, which random states do not show, and what lies in the span of others a prior can tell from them.

    Args:
        model: the standard model, effects that were found last.
        seed: of the random states; any gives the same set.
        states: how many.
    """
    found = tuple(effect for effect in model.effects if isinstance(effect, Found))
    if found:
        usual = RegressorModel(model.robot, model.effects[: -len(found)])
        kept = np.array([own for effect in found for own in effect.kept])
        return base_parameters(usual, seed, states).with_effects(found, kept)
    regressor = model.columns(random_states(model.robot, seed, states))
    rows = regressor.reshape(-1, regressor.shape[2])
    scale = np.linalg.norm(rows, axis=0)
    present = np.flatnonzero(scale > _RANK_TOLERANCE * scale.max())
    unit = rows[:, present] / scale[present]
    independent = present[_independent_columns(unit)]
    relation = _relation(rows, scale, independent, present)
    return BaseParameters(model, independent, relation)


def random_states(robot: Robot, seed: int, states: int) -> State:
    """Random q, q̇, q̈ within the arm's limits, states × joints."""
    generator = np.random.default_rng(seed)
    shape = (states, robot.n)
    return State(
        generator.uniform(robot.lower, robot.upper, shape),
        generator.uniform(-1, 1, shape) * robot.velocity_limits,
        generator.uniform(-1, 1, shape) * robot.acceleration_limits,
    )


def _independent_columns(unit: FloatArray) -> IntArray:
    """Indices of the columns that do not depend on those before them."""
    kept: list[int] = []
    basis = np.zeros((unit.shape[0], 0))
    for column in range(unit.shape[1]):
        rest = unit[:, column] - basis @ (basis.T @ unit[:, column])
        rest -= basis @ (basis.T @ rest)
        size = float(np.linalg.norm(rest))
        if size > _RANK_TOLERANCE:
            kept.append(column)
            basis = np.column_stack([basis, rest / size])
    return np.array(kept, dtype=np.int64)


def _relation(rows: FloatArray, scale: FloatArray, independent: IntArray, present: IntArray) -> FloatArray:
    """(b, p) with the identity on the independent columns and the regrouping factors on the others."""
    relation = np.zeros((independent.size, rows.shape[1]))
    relation[np.arange(independent.size), independent] = 1.0
    others = np.zeros(rows.shape[1], dtype=np.bool_)
    others[present] = True
    others[independent] = False
    dependent = np.flatnonzero(others)
    q, r = np.linalg.qr(rows[:, independent] / scale[independent])
    factors = np.linalg.solve(r, q.T @ (rows[:, dependent] / scale[dependent]))
    factors[np.abs(factors) < _SMALLEST_RELATION] = 0.0
    relation[:, dependent] = np.round(factors * (scale[dependent] / scale[independent, np.newaxis]), 12)
    return relation


def _expression(factors: FloatArray, names: tuple[str, ...]) -> str:
    terms: list[str] = []
    for column in np.argsort(factors == 0.0, kind="stable"):
        factor = float(factors[column])
        if factor == 0.0:
            break
        size = "" if np.isclose(abs(factor), 1.0, rtol=1e-9) else f"{abs(factor):.6g} "
        joint = " + " if factor > 0 else " − "
        terms.append((joint if terms else ("−" if factor < 0 else "")) + size + names[column])
    return "".join(terms)
