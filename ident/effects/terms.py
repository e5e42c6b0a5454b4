"""The dictionary of terms: products of signs, speeds, positions, load, neighbours, time; with their units."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ident.effects.family import Place, PresentModel
from ident.effects.scales import dry_friction
from ident.effects.state import State
from ident.effects.term_factors import (
    Factor,
    acceleration,
    amount,
    beyond,
    cubed_torque,
    direction,
    drawn,
    fading,
    falling,
    load,
    motor_waves,
    position,
    root,
    speed,
    time,
    waves,
)
from robots.arrays import FloatArray
from robots.description import Robot

NOTES = {
    "own model": "a parameter of the model that has changed: friction, inertia or offset of the drive",
    "speed": "drag of air or lubricant, an eddy-current brake, a hose",
    "falling with speed": "a film of lubricant that builds up, a seal that lets go",
    "position": "a spring or counterbalance that is not linear, a dress pack",
    "from an angle on": "a cable or hose that goes taut, a bumper, a stop that is touched",
    "way": "a dress pack or hose that bends with losses, friction that builds up over a way",
    "position and speed": "lubricant that is thicker at one end of the travel, a damper with a lever",
    "position and time": "a spring or counterbalance that slackens, a dress pack that warms up",
    "position and sign": "a seal or brake that rubs more at one end of the travel",
    "load": "a bearing or gear under load, a torque constant that droops",
    "load and speed": "losses of a gear with load and speed, a worm or wave gear",
    "time": "warming up, a drift of the torque sensor or the drive's offset",
    "fading": "a gear that runs warm, a cold start, creep that settles",
    "angle": "an unbalance, a magnet or cogging with the turn of the joint",
    "angle and sign": "a bent shaft, an eccentric bearing, a brake disc that is not flat",
    "angle and speed": "an eccentric rotor in a brake's field, a bearing out of round",
    "motor's angle": "cogging of the motor, currents that are not quite sines, a gear that runs out of true",
    "neighbour": "crosstalk between drives, a cable over both joints, a coupling of the gears",
}
"""Per family of the dictionary, what in nature looks like it."""

_HIGH = {0.5: "^½", 1.0: "", 2.0: "²", 3.0: "³"}


@dataclass(frozen=True)
class Term:
    """One entry of the dictionary.

    Attributes:
        joint: whose torque it adds to, from 0.
        formula: without its factor.
        factors: what it is the product of.
        kind: its family in the dictionary, for what in nature looks like it.
        unit: of its factor.
        scale: deviation of its factor before any data are seen.
    """

    joint: int
    formula: str
    factors: tuple[Factor, ...]
    kind: str
    unit: str
    scale: float

    @property
    def variables(self) -> frozenset[str]:
        """What it is made of: q, v, a, load with the joint's number, t."""
        return frozenset(name for one in self.factors for name in one.variables)

    @property
    def looks_like(self) -> str:
        """What in nature does."""
        return NOTES[self.kind]

    def value(self, state: State, present: PresentModel) -> FloatArray:
        """The formula, (samples,)."""
        ones = np.ones(state.velocity.shape[0])
        return np.asarray(np.prod([ones, *(one.value(state, present) for one in self.factors)], axis=0))


def dictionary(robot: Robot, joint: int) -> tuple[Term, ...]:
    """All terms of one joint (from 0)."""
    return tuple(
        _term(robot, joint, kind, factors)
        for kind, products in _of_kinds(robot, joint)
        for factors in products
    )


def _of_kinds(robot: Robot, j: int) -> Iterator[tuple[str, Sequence[tuple[Factor, ...]]]]:
    v, s, q, weight, t = speed(robot, j), direction(robot, j), position(robot, j), load(robot, j), time(j)
    wave = waves(robot, j)
    folded = [amount(one) for one in wave]
    yield "own model", [(v,), (s,), (acceleration(robot, j),), ()]
    yield "speed", [(s, root(v)), (v, amount(v)), (v, v, v)]
    yield "falling with speed", [(s, one) for one in falling(robot, j)]
    yield "position", [(q,), (q, q), (q, q, q)]
    yield "from an angle on", [(one,) for one in beyond(robot, j)]
    yield "way", [(one,) for one in drawn(robot, j)]
    yield (
        "position and speed",
        [(v, q), (v, q, q), (v, amount(q)), (v, amount(v), q), (v, amount(v), amount(q))],
    )
    yield "position and time", [(q, one) for one in (t, *fading(j))]
    yield "position and sign", [(s, q), (s, q, q), (s, amount(q))]
    drive = [(cubed_torque(robot, j),)] if _alone(robot, j) else []
    yield "load", [*drive, (weight,), (weight, amount(weight)), (s, amount(weight)), (s, weight, weight)]
    products = [(v, amount(weight)), (v, weight), (amount(v), weight), (v, weight, weight)]
    yield "load and speed", products
    yield "time", [(t,), (s, t), (v, t), (weight, t)]
    yield "fading", [product for one in fading(j) for product in ((s, one), (v, one), (one,))]
    yield "angle", [(one,) for one in (*wave, *folded)]
    yield "angle and sign", [(s, one) for one in (*wave, *folded)]
    yield "angle and speed", [(v, one) for one in (*wave, *folded)]
    if robot.has_drives and np.array_equal(robot.transmission_matrix[j], np.eye(robot.n)[j]):
        yield "motor's angle", [(one,) for one in motor_waves(robot, j)]
    for k in range(robot.n):
        if k != j:
            other = speed(robot, k)
            alone = (direction(robot, k), acceleration(robot, k), load(robot, k))
            yield "neighbour", [(other,), *((one,) for one in alone)]
            yield "neighbour", [(v, amount(other)), (v, other), (s, amount(other)), (other, amount(other))]


def _alone(robot: Robot, j: int) -> bool:
    """Whether drive j moves joint j, and that only."""
    unit, geared = np.eye(robot.n)[j], robot.transmission_matrix
    return np.array_equal(geared[j], unit) and np.array_equal(geared[:, j], unit)


def _term(robot: Robot, joint: int, kind: str, factors: Sequence[Factor]) -> Term:
    return Term(
        joint=joint,
        formula="·".join(_powers([one.words for one in factors])) or "1",
        factors=tuple(factors),
        kind=kind,
        unit=_unit(robot, joint, [sum(one.unit[k] for one in factors) for k in range(3)]),
        scale=dry_friction(robot, Place("drive", (joint,))) / float(np.prod([one.size for one in factors])),
    )


def _unit(robot: Robot, joint: int, below: Sequence[float]) -> str:
    """Torque over the unit of the formula."""
    own = robot.joint[joint]
    parts = ((own.torque_unit, 1 - below[0]), ("s", -below[2]), (own.unit, -below[1]))
    above = [_power(word, power) for word, power in parts if power > 0]
    under = [_power(word, -power) for word, power in parts if power < 0]
    top, bottom = "·".join(above) or "1", "·".join(under)
    if "·" in bottom and not (len(under) == 1 and bottom.startswith("(")):
        bottom = f"({bottom})"
    return f"{top}/{bottom}" if bottom else top


def _power(unit: str, power: float) -> str:
    """Of a unit, which may be a product."""
    return f"({unit}){_HIGH[power]}" if "·" in unit and power != 1.0 else unit + _HIGH[power]


def _powers(words: Sequence[str]) -> list[str]:
    """Equal words as a power."""
    return [word + _HIGH[words.count(word)] for word in dict.fromkeys(words)]
