"""Factors of a term: a quantity of one joint, and a function of it, with unit and natural size.

A term's size before any data are seen is that of its joint's dry friction, reached where what it is made of
is at a natural size: half the speed limit, half the travel, a third of the torque limit. Nothing follows from
data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from ident.effects.family import Place, PresentModel
from ident.effects.hysteresis import deflection
from ident.effects.shown import as_filter_shows
from ident.effects.state import State
from ident.effects.torque_ripple import PERIODS, motor_angle
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot

WAVES = (1, 2, 3, 4, 6, 8)
"""Periods per turn of what is periodic in the angle of a joint."""

FALLS = (0.02, 0.06, 0.2)
"""Of the speed limit: over which friction falls that a film of lubricant takes away."""

FADES = (5.0, 20.0, 80.0)
"""s, in which what was there at the start fades away."""

CORNERS = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
"""Of the travel: where a spring may begin."""

_SPEED, _TRAVEL, _LOAD, _ACCELERATION = 0.5, 0.5, 0.3, 0.3
"""Of the limits: where a moving joint usually is."""

_MINUTE = 60.0
"""s, a natural time for what changes without a cause that is known."""

_LOW = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")

WAYS = (0.003, 0.006, 0.012, 0.025, 0.05, 0.1, 0.2, 0.4)
"""Of the travel: over which what bends or creeps comes round after a reversal."""

Quantity = Literal["position", "way", "speed", "acceleration", "load", "torque", "time"]
Function = Callable[[FloatArray], FloatArray]


def itself(values: FloatArray) -> FloatArray:
    """A quantity as it is."""
    return values


@dataclass(frozen=True)
class Drawn:
    """Deflection −1 to 1 of a bristle that is drawn along positions, over a length in rad (or m)."""

    length: float

    def __call__(self, values: FloatArray) -> FloatArray:
        """Of positions in the order of time."""
        return deflection(values, self.length)


@dataclass(frozen=True)
class Factor:
    """Part of a product.

    Attributes:
        words: as in the formula.
        unit: exponents of torque, angle and time.
        size: natural size.
        quantity, joint: what it is made of; joints count from 0.
        function: of that, samples in, samples out.
        left: share of it that the filter of the positions lets pass, of samples; None: all.
    """

    words: str
    unit: tuple[float, float, float]
    size: float
    quantity: Quantity
    joint: int
    function: Function = itself
    left: Callable[[State], FloatArray] | None = None

    @property
    def variables(self) -> tuple[str, ...]:
        """The quantity's name, with the joint's number; of a way, position and direction.

        The torque of a drive is what loads it.
        """
        if self.quantity == "time":
            return ("t",)
        symbols = {"position": "q", "way": "qv", "speed": "v", "acceleration": "a"}
        names = tuple(symbols.get(self.quantity, ())) or ("load",)
        return tuple(f"{name}{self.joint + 1}" for name in names)

    def value(self, state: State, present: PresentModel) -> FloatArray:
        """(samples,)."""
        values = self.function(self._quantity(state, present))
        return values if self.left is None else values * self.left(state)

    def _quantity(self, state: State, present: PresentModel) -> FloatArray:
        if self.quantity == "time":
            assert state.time is not None
            return state.time
        if self.quantity == "load":
            return (present.link_torque(state) + present.offset_torque())[:, self.joint]
        if self.quantity == "torque":
            return present.torque(state)[:, self.joint]
        if self.quantity == "speed":
            return state.velocity[:, self.joint]
        motion = state.acceleration if self.quantity == "acceleration" else state.position
        return motion[:, self.joint]


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


def cubed_torque(robot: Robot, k: int) -> Factor:
    """Third power of the torque of joint k, friction and inertia of its drive among it."""
    size = (_LOAD * robot.joint[k].torque) ** 3
    return Factor(f"{_name('τ', k)}³", (3, 0, 0), size, "torque", k, _cube)


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


def motor_waves(robot: Robot, k: int) -> list[Factor]:
    """Of the turn of the motor that moves joint k and no other."""
    found = []
    for periods in PERIODS:
        rate = periods * motor_angle(robot, Place("drive", (k,)))
        for name, wave in (("cos", np.cos), ("sin", np.sin)):
            words, left = f"{name} {rate:g}{_name('q', k)}", partial(_left, robot, k, rate)
            found.append(Factor(words, (0, 0, 0), 1.0, "position", k, _periodic(wave, rate), left))
    return found


def _left(robot: Robot, k: int, rate: float, state: State) -> FloatArray:
    frequency = rate * np.abs(state.velocity[:, k]) / (2.0 * np.pi)
    return as_filter_shows(robot, frequency, state.time)


def amount(of: Factor) -> Factor:
    """Its absolute value."""
    plain = of.function is itself
    function: Function = np.abs if plain else lambda values: np.abs(of.function(values))
    return Factor(f"|{of.words}|", of.unit, of.size, of.quantity, of.joint, function)


def root(of: Factor) -> Factor:
    """Of its absolute value."""
    half = (0.5 * of.unit[0], 0.5 * of.unit[1], 0.5 * of.unit[2])
    return Factor(f"√|{of.words}|", half, float(np.sqrt(of.size)), of.quantity, of.joint, _root)


def falling(robot: Robot, k: int) -> list[Factor]:
    """One at standstill, and less the faster joint k is."""
    return [_exponential(_name("q̇", k), share * robot.joint[k].velocity, "speed", k) for share in FALLS]


def fading(k: int) -> list[Factor]:
    """One at the start, and less later; of a term of joint k."""
    return [_exponential("t", settling, "time", k) for settling in FADES]


def beyond(robot: Robot, k: int) -> list[Factor]:
    """How far joint k is beyond a corner, on either side; zero before it."""
    lower, upper = robot.joint[k].position
    size, symbol, found = _TRAVEL * 0.5 * (upper - lower), _name("q", k), []
    for corner in (float(f"{lower + share * (upper - lower):.3g}") for share in CORNERS):
        at = f"{abs(corner):g}"
        above = symbol if corner == 0.0 else f"{symbol} {'−' if corner > 0.0 else '+'} {at}"
        below = f"−{symbol}" if corner == 0.0 else f"{'' if corner > 0.0 else '−'}{at} − {symbol}"
        for side, way in ((1.0, above), (-1.0, below)):
            found.append(Factor(f"max({way}, 0)", (0, 1, 0), size, "position", k, _ramp(corner, side)))
    return found


def drawn(robot: Robot, k: int) -> list[Factor]:
    """Where joint k comes from: one after a long way forwards, minus one after a long way back."""
    lower, upper = robot.joint[k].position
    lengths = [float(f"{share * (upper - lower):.2g}") for share in WAYS]
    symbol = _name("q", k)
    return [Factor(f"z({symbol}/{one:g})", (0, 0, 0), 1.0, "way", k, Drawn(one)) for one in lengths]


def _exponential(symbol: str, scale: float, quantity: Quantity, k: int) -> Factor:
    rounded = float(f"{scale:.3g}")
    symbol = symbol if quantity == "time" else f"|{symbol}|"
    words = f"exp(−{symbol}/{rounded:g})"
    return Factor(words, (0, 0, 0), 1.0, quantity, k, lambda values: np.exp(-np.abs(values) / rounded))


def _ramp(corner: float, side: float) -> Function:
    return lambda values: np.maximum(side * (values - corner), 0.0)


def _cube(values: FloatArray) -> FloatArray:
    return values**3


def _root(values: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.abs(values)))


def _periodic(wave: Function, rate: float) -> Function:
    return lambda values: wave(rate * values)


def _name(symbol: str, joint: int) -> str:
    return symbol + str(joint + 1).translate(_LOW)
