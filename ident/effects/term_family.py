"""A term as an effect: its columns, and what it is in the closed-loop simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Literal

import numpy as np

from ident.effects.family import Place, PresentModel
from ident.effects.placed import ANY, POSITIVE, Family, Law, Parameters, Parts, along, joint_row, over_time
from ident.effects.simulated import (
    Bristle,
    DriveChange,
    FrictionTorque,
    PositionTorque,
    SimulatedParts,
    SpeedLaw,
    Table,
)
from ident.effects.speed_term import FrictionSign
from ident.effects.state import State
from ident.effects.term_factors import Drawn, Factor, Quantity, itself
from ident.effects.terms import Term, dictionary
from ident.errors import IdentificationError
from robots.arrays import FloatArray
from robots.description import Robot

TERM = "term: "
"""Begins the name of an effect that is a term; its formula follows."""

_MARGIN = 0.5
"""rad (or m) beyond the limits that a table reaches."""

_FASTEST = 3.0
"""End of a table over a neighbour's speed, as a multiple of its limit."""

_LOAD: dict[tuple[bool, ...], Literal["both", "square", "signed", "signed square"]] = {
    (True,): "both",
    (False,): "signed",
    (False, False): "square",
    (False, True): "signed square",
}
"""How a torque follows a load, by whether each factor is an absolute value."""


def is_term(name: str) -> bool:
    """Whether an effect of this name is a term."""
    return name.startswith(TERM)


def term_family(robot: Robot, formula: str) -> Family:
    """The family that one formula of the dictionary is, at every joint that can have it.

    Raises:
        IdentificationError: no joint of this arm can.
    """
    terms = {j: term for j in range(robot.n) for term in dictionary(robot, j) if term.formula == formula}
    if not terms:
        raise IdentificationError(
            f"term {formula}: no formula of {robot.name}'s dictionary; allowed: one that armhil diagnose gave"
        )
    places = tuple(Place("joint", (joint,)) for joint in terms)
    looks_like = next(iter(terms.values())).looks_like
    return Family(TERM + formula, looks_like, "joint", lambda robot: places, _make(formula), several=True)


def family_of(term: Term) -> Family:
    """A term of one joint as the family that it alone is."""
    place = Place("joint", (term.joint,))
    name, make = TERM + term.formula, _make(term.formula, term)
    return Family(name, term.looks_like, "joint", lambda robot: (place,), make, several=True)


def term_of(robot: Robot, formula: str, joint: int) -> Term:
    """The term of a formula at a joint (from 0).

    Raises:
        IdentificationError: that joint has none.
    """
    for term in dictionary(robot, joint):
        if term.formula == formula:
            return term
    raise IdentificationError(f"term {formula} at joint {joint + 1}: not in its dictionary; allowed: others")


def _make(
    formula: str, known: Term | None = None
) -> Callable[[Robot, Place, tuple[float, ...], PresentModel], tuple[Parameters, Law, Parts]]:
    def make(
        robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
    ) -> tuple[Parameters, Law, Parts]:
        row, joint = joint_row(robot, place), place.joints[0]
        term = term_of(robot, formula, joint) if known is None else known

        def law(state: State) -> FloatArray:
            return along(row, term.value(state, present))

        def parts(values: FloatArray) -> SimulatedParts:
            return simulated_term(robot, term, float(values[0]), present.offset_torque())

        # A drive whose constant grows with its torque is none.
        bounds = POSITIVE if any(one.quantity == "torque" for one in term.factors) else ANY
        return Parameters((f"{term.formula}@",), (term.unit,), (bounds,), (term.scale,)), law, parts

    return make


def simulated_term(robot: Robot, term: Term, value: float, offset: FloatArray) -> SimulatedParts:
    """What a term is in the closed loop with a value of its factor, in a model with an offset (n,)."""
    row = np.eye(robot.n)[term.joint]
    for factor in term.factors:
        if isinstance(factor.function, Drawn):
            bristle = Bristle(factor.function.length, "exponential")
            return SimulatedParts(friction=(FrictionTorque(row, value * row, bristle),))
        if factor.quantity == "torque":
            droop = value * float(robot.gains[term.joint]) ** 2
            return SimulatedParts(drives=(DriveChange(term.joint, droop=droop, droop_power=2.0),))
    own = _of(term.factors, "speed", term.joint)
    others = [one for one in term.factors if one.quantity == "speed" and one.joint != term.joint]
    loads = _of(term.factors, "load")
    if not term.factors:
        return SimulatedParts(constant=value * row)
    for factor in _of(term.factors, "acceleration"):
        return SimulatedParts(inertia=value * np.outer(row, np.eye(robot.n)[factor.joint]))
    if len(term.factors) == 1 and [one.function for one in (*own, *others)] == [itself]:
        return SimulatedParts(damping=value * np.outer(row, np.eye(robot.n)[term.factors[0].joint]))
    curve, course = _curve(robot, term), _course(term)
    if not (own or others or loads):
        flat = curve or Table.at(-1.0, 1.0, np.ones(4))
        return SimulatedParts(position=(PositionTorque(row, value * row, flat, course),))
    torque = FrictionTorque(
        row,
        value * row,
        _law(own),
        speed_factor=_beside_sign(own),
        position_row=None if curve is None else row,
        curve=curve,
        course=course,
        load_row=np.eye(robot.n)[loads[0].joint] if loads else None,
        load_offset=float(offset[loads[0].joint]) if loads else 0.0,
        load_side=_LOAD[tuple(one.function is np.abs for one in loads)] if loads else "both",
        other_row=np.eye(robot.n)[others[0].joint] if others else None,
        other_factor=_other(robot, others),
    )
    return SimulatedParts(friction=(torque,))


def _of(factors: Iterable[Factor], quantity: Quantity, joint: int | None = None) -> list[Factor]:
    return [one for one in factors if one.quantity == quantity and joint in (None, one.joint)]


def _law(own: Sequence[Factor]) -> SpeedLaw:
    """Over the joint's own speed; a constant where that is no factor."""
    if [one.function for one in own] == [itself]:
        return None
    if own and isinstance(own[0].function, FrictionSign):
        return own[0].function
    return _product(own)


def _beside_sign(own: Sequence[Factor]) -> Callable[[FloatArray], FloatArray] | None:
    """What a sign goes with; it stands first."""
    if len(own) > 1 and isinstance(own[0].function, FrictionSign):
        return _product(own[1:])
    return None


def _product(factors: Sequence[Factor]) -> Callable[[FloatArray], FloatArray]:
    def product(values: FloatArray) -> FloatArray:
        return np.asarray(np.prod([np.ones_like(values), *(one.function(values) for one in factors)], axis=0))

    return product


def _curve(robot: Robot, term: Term) -> Table | None:
    factors = _of(term.factors, "position")
    if not factors:
        return None
    lower, upper = robot.joint[term.joint].position
    return Table.of(_product(factors), lower - _MARGIN, upper + _MARGIN)


def _course(term: Term) -> Table | None:
    factors = _of(term.factors, "time")
    if not factors:
        return None
    if all(one.function is itself for one in factors):
        return Table.of(_product(factors), 0.0, 1.0)  # a straight line goes on
    return over_time(_product(factors))


def _other(robot: Robot, others: Sequence[Factor]) -> Table | None:
    if not others:
        return None
    fastest = _FASTEST * robot.joint[others[0].joint].velocity
    return Table.of(_product(others), -fastest, fastest)
