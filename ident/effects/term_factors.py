"""Factors of a term: a quantity of one joint, and a function of it, with unit and natural size.

A term's size before any data are seen is that of its joint's dry friction, reached where what it is made of
is at a natural size: half the speed limit, half the travel, a third of the torque limit. Nothing follows from
data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ident.effects.family import PresentModel, State
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot

WAVES = (1, 2, 3, 4, 6, 8)
"""Periods per turn of what is periodic in the angle of a joint."""

_SPEED, _TRAVEL, _LOAD, _ACCELERATION = 0.5, 0.5, 0.3, 0.3
"""Of the limits: where a moving joint usually is."""

_MINUTE = 60.0
"""s, a natural time for what changes without a cause that is known."""

_LOW = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")

Quantity = Literal["position", "speed", "acceleration", "load", "time"]
Function = Callable[[FloatArray], FloatArray]


def itself(values: FloatArray) -> FloatArray:
    """A quantity as it is."""
    return values


@dataclass(frozen=True)
class Factor:
    """Part of a product.

    Attributes:
        words: as in the formula.
        unit: exponents of torque, angle and time.
        size: natural size.
        quantity, joint: what it is made of; joints count from 0.
        function: of that, samples in, samples out.
    """

    words: str
    unit: tuple[int, int, int]
    size: float
    quantity: Quantity
    joint: int
    function: Function = itself

    @property
    def variable(self) -> str:
        """The quantity's name, with the joint's number."""
        symbol = {"position": "q", "speed": "v", "acceleration": "a", "load": "load", "time": "t"}
        return symbol[self.quantity] + ("" if self.quantity == "time" else str(self.joint + 1))

    def value(self, state: State, present: PresentModel) -> FloatArray:
        """(samples,)."""
        return self.function(self._quantity(state, present))

    def _quantity(self, state: State, present: PresentModel) -> FloatArray:
        if self.quantity == "time":
            assert state.time is not None
            return state.time
        if self.quantity == "load":
            return (present.link_torque(state) + present.offset_torque())[:, self.joint]
        motion = {"position": state.position, "speed": state.velocity, "acceleration": state.acceleration}
        return motion[self.quantity][:, self.joint]


def speed(robot: Robot, k: int) -> Factor:
    """Of joint k."""
    return Factor(_name("q̇", k), (0, 1, -1), _SPEED * robot.joint[k].velocity, "speed", k)


def acceleration(robot: Robot, k: int) -> Factor:
    """Of joint k."""
    return Factor(_name("q̈", k), (0, 1, -2), _ACCELERATION * robot.joint[k].acceleration, "acceleration", k)


def direction(robot: Robot, k: int) -> Factor:
    """Sign of the speed of joint k, in the arm's own form."""
    return Factor(f"sign {_name('q̇', k)}", (0, 0, 0), 1.0, "speed", k, friction_sign(robot))


def position(robot: Robot, k: int) -> Factor:
    """Of joint k."""
    lower, upper = robot.joint[k].position
    return Factor(_name("q", k), (0, 1, 0), _TRAVEL * 0.5 * (upper - lower), "position", k)


def load(robot: Robot, k: int) -> Factor:
    """Torque of the links on joint k, with the model's offset there."""
    return Factor(_name("load", k), (1, 0, 0), _LOAD * robot.joint[k].torque, "load", k)


def time(k: int) -> Factor:
    """Since the arm was switched on or the first recording began; of a term of joint k."""
    return Factor("t", (0, 0, 1), _MINUTE, "time", k)


def waves(robot: Robot, k: int) -> list[Factor]:
    """Of the turn of a joint; of the travel of one that slides, where the wave length is no angle's."""
    own, found = robot.joint[k], []
    turn = 1.0 if own.kind == "revolute" else 2.0 * np.pi / (own.position[1] - own.position[0])
    for order in WAVES:
        rate = float(order * turn)
        words = f"{'' if rate == 1.0 else f'{rate:.3g}'}{_name('q', k)}"
        for name, wave in (("cos", np.cos), ("sin", np.sin)):
            found.append(Factor(f"{name} {words}", (0, 0, 0), 1.0, "position", k, _periodic(wave, rate)))
    return found


def amount(of: Factor) -> Factor:
    """Its absolute value."""
    plain = of.function is itself
    function: Function = np.abs if plain else lambda values: np.abs(of.function(values))
    return Factor(f"|{of.words}|", of.unit, of.size, of.quantity, of.joint, function)


def _periodic(wave: Function, rate: float) -> Function:
    return lambda values: wave(rate * values)


def _name(symbol: str, joint: int) -> str:
    return symbol + str(joint + 1).translate(_LOW)
