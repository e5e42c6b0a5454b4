"""Torque that depends on one speed through a friction law: the shape that most friction has.

From the same terms come the columns of the regressor and, times the parameters, the friction of the
closed-loop simulation, which is solved implicitly and in compiled code.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

import numpy as np

from ident.effects.state import State
from robots.arrays import FloatArray


@dataclass(frozen=True)
class FrictionSign:
    """``sign(q̇)`` or ``tanh(q̇/width)``; the same form in the regressor and in the simulation.

    Attributes:
        kind: which.
        width: speed in rad/s (or m/s) at which the smooth form saturates; unused by ``sign``.
    """

    kind: Literal["sign", "tanh"]
    width: float

    def __call__(self, velocity: FloatArray) -> FloatArray:
        """Values in [−1, 1] in the shape of ``velocity`` (rad/s or m/s)."""
        if self.kind == "sign":
            return np.sign(velocity)
        return np.tanh(velocity / self.width)


@dataclass(frozen=True)
class SpeedTerm:
    """Joint torque = parameter · torque_row · law(speed_row · q̇).

    Attributes:
        parameter: which of the effect's parameters, from 0.
        speed_row: (n,) the speed as a combination of joint speeds.
        torque_row: (n,) how the torque falls on the joints.
        law: its course over speed; None for the speed itself.
        direction: 1 or -1 where it acts in that direction of motion only.
    """

    parameter: int
    speed_row: tuple[float, ...]
    torque_row: tuple[float, ...]
    law: FrictionSign | None
    direction: Literal[-1, 0, 1] = 0

    def value(self, speed: FloatArray) -> FloatArray:
        """The law at speeds of any shape."""
        values = speed if self.law is None else self.law(speed)
        return np.where(self.direction * speed > 0, values, 0.0) if self.direction else values


@runtime_checkable
class HasSpeedTerms(Protocol):
    """An effect that is made of speed terms, wholly or in part."""

    def speed_terms(self) -> tuple[SpeedTerm, ...]: ...


def speed_columns(terms: Sequence[SpeedTerm], state: State, parameters: int) -> FloatArray:
    """The columns of the terms, samples × joints × parameters."""
    columns = np.zeros((*state.velocity.shape, parameters))
    for term in terms:
        value = term.value(state.velocity @ np.array(term.speed_row))
        for joint, share in enumerate(term.torque_row):
            if share:
                columns[:, joint, term.parameter] += share * value
    return columns
