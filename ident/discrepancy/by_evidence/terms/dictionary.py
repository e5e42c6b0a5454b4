"""The dictionary of terms: products of signs, speeds, positions, load, neighbours and time, with their units.

A term's size before any data are seen is that of its joint's dry friction, reached where what it is made of
is at a natural size: half the speed limit, half the travel, a third of the torque limit. Nothing follows from
data.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ident.effects.family import Place, PresentModel, State
from ident.effects.scales import dry_friction
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot

_WAVES = (1, 2, 3, 4, 6, 8)
"""Periods per turn of what is periodic in the angle of a joint."""

_SPEED, _TRAVEL, _LOAD, _ACCELERATION = 0.5, 0.5, 0.3, 0.3
"""Of the limits: where a moving joint usually is."""

_MINUTE = 60.0
"""s, a natural time for what changes without a cause that is known."""

_LOW = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
_HIGH = {1: "", 2: "²", 3: "³"}

Value = Callable[[State, PresentModel], FloatArray]


@dataclass(frozen=True)
class Term:
    """One entry of the dictionary.

    Attributes:
        joint: whose torque it adds to, from 0.
        formula: without its factor.
        variables: what it is made of: q, v, a, load with the joint's number, t.
        kind: its family in the dictionary, for what in nature looks like it.
        unit: of its factor.
        scale: deviation of its factor before any data are seen.
        value: the formula, (samples,).
    """

    joint: int
    formula: str
    variables: frozenset[str]
    kind: str
    unit: str
    scale: float
    value: Value


@dataclass(frozen=True)
class _Factor:
    """Part of a product: words, exponents of torque, angle and time, natural size, variable, value."""

    words: str
    unit: tuple[int, int, int]
    size: float
    variable: str
    value: Value


def dictionary(robot: Robot, joint: int) -> tuple[Term, ...]:
    """All terms of one joint (from 0)."""
    return tuple(
        _term(robot, joint, kind, factors)
        for kind, products in _of_kinds(robot, joint)
        for factors in products
    )


def _of_kinds(robot: Robot, j: int) -> Iterator[tuple[str, Sequence[tuple[_Factor, ...]]]]:
    v, s, q, load, t = _speed(robot, j), _sign(robot, j), _position(robot, j), _load(robot, j), _time()
    waves = _waves(robot, j)
    folded = [_amount(wave) for wave in waves]
    yield "own model", [(v,), (s,), (_acceleration(robot, j),), ()]
    yield "speed", [(v, _amount(v)), (v, v, v)]
    yield "position", [(q,), (q, q), (q, q, q)]
    yield "position and speed", [(v, q), (v, q, q), (v, _amount(q))]
    yield "position and sign", [(s, q), (s, q, q), (s, _amount(q))]
    yield "load", [(load, _amount(load)), (s, _amount(load)), (s, load, load)]
    yield "load and speed", [(v, _amount(load)), (v, load), (_amount(v), load), (v, load, load)]
    yield "time", [(t,), (s, t), (v, t), (load, t)]
    yield "angle", [(wave,) for wave in (*waves, *folded)]
    yield "angle and sign", [(s, wave) for wave in (*waves, *folded)]
    yield "angle and speed", [(v, wave) for wave in (*waves, *folded)]
    for k in range(robot.n):
        if k != j:
            other = _speed(robot, k)
            yield "neighbour", [(other,), (_sign(robot, k),), (_acceleration(robot, k),), (_load(robot, k),)]
            yield "neighbour", [(v, _amount(other)), (v, other), (s, _amount(other)), (other, _amount(other))]


def _term(robot: Robot, joint: int, kind: str, factors: Sequence[_Factor]) -> Term:
    place = Place("drive", (joint,))

    def value(state: State, present: PresentModel) -> FloatArray:
        ones = np.ones(state.velocity.shape[0])
        return np.asarray(np.prod([ones, *(one.value(state, present) for one in factors)], axis=0))

    return Term(
        joint=joint,
        formula="·".join(_powers([one.words for one in factors])) or "1",
        variables=frozenset(one.variable for one in factors),
        kind=kind,
        unit=_unit(robot, joint, [sum(one.unit[k] for one in factors) for k in range(3)]),
        scale=dry_friction(robot, place) / float(np.prod([one.size for one in factors])),
        value=value,
    )


def _unit(robot: Robot, joint: int, below: Sequence[int]) -> str:
    """Torque over the unit of the formula."""
    own = robot.joint[joint]
    parts = ((own.torque_unit, 1 - below[0]), ("s", -below[2]), (own.unit, -below[1]))
    above = [word + _HIGH[power] for word, power in parts if power > 0]
    under = [word + _HIGH[-power] for word, power in parts if power < 0]
    top, bottom = "·".join(above) or "1", "·".join(under)
    if "·" in bottom:
        bottom = f"({bottom})"
    return f"{top}/{bottom}" if bottom else top


def _powers(words: Sequence[str]) -> list[str]:
    """Equal words as a power."""
    return [word + _HIGH[words.count(word)] for word in dict.fromkeys(words)]


def _name(symbol: str, joint: int) -> str:
    return symbol + str(joint + 1).translate(_LOW)


def _speed(robot: Robot, k: int) -> _Factor:
    size = _SPEED * robot.joint[k].velocity
    return _Factor(_name("q̇", k), (0, 1, -1), size, f"v{k + 1}", lambda state, _: state.velocity[:, k])


def _acceleration(robot: Robot, k: int) -> _Factor:
    size = _ACCELERATION * robot.joint[k].acceleration
    return _Factor(_name("q̈", k), (0, 1, -2), size, f"a{k + 1}", lambda state, _: state.acceleration[:, k])


def _sign(robot: Robot, k: int) -> _Factor:
    sign = friction_sign(robot)
    words = f"sign {_name('q̇', k)}"
    return _Factor(words, (0, 0, 0), 1.0, f"v{k + 1}", lambda state, _: sign(state.velocity[:, k]))


def _position(robot: Robot, k: int) -> _Factor:
    lower, upper = robot.joint[k].position
    size = _TRAVEL * 0.5 * (upper - lower)
    return _Factor(_name("q", k), (0, 1, 0), size, f"q{k + 1}", lambda state, _: state.position[:, k])


def _load(robot: Robot, k: int) -> _Factor:
    size = _LOAD * robot.joint[k].torque
    return _Factor(
        _name("load", k), (1, 0, 0), size, f"load{k + 1}", lambda state, m: m.link_torque(state)[:, k]
    )


def _time() -> _Factor:
    def value(state: State, present: PresentModel) -> FloatArray:
        assert state.time is not None
        return state.time

    return _Factor("t", (0, 0, 1), _MINUTE, "t", value)


def _waves(robot: Robot, k: int) -> list[_Factor]:
    """Of the turn of a joint; of the travel of one that slides, where the wave length is no angle's."""
    own, found = robot.joint[k], []
    turn = 1.0 if own.kind == "revolute" else 2.0 * np.pi / (own.position[1] - own.position[0])
    for order in _WAVES:
        rate = order * turn
        words = f"{'' if rate == 1.0 else f'{rate:.3g}'}{_name('q', k)}"
        for name, wave in (("cos", np.cos), ("sin", np.sin)):
            found.append(
                _Factor(f"{name} {words}", (0, 0, 0), 1.0, f"q{k + 1}", _periodic(wave, float(rate), k))
            )
    return found


def _periodic(wave: Callable[[FloatArray], FloatArray], rate: float, k: int) -> Value:
    return lambda state, present: wave(rate * state.position[:, k])


def _amount(of: _Factor) -> _Factor:
    """Its absolute value."""
    return _Factor(
        f"|{of.words}|",
        of.unit,
        of.size,
        of.variable,
        lambda state, present: np.abs(of.value(state, present)),
    )
