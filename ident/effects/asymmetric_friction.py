"""Friction that differs with the direction of motion."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import Literal

import numpy as np

from ident.effects.family import StandardParameter, State
from ident.effects.friction_sign import FrictionSign
from ident.effects.per_joint import joint_parameters
from ident.effects.speed_term import SpeedTerm, speed_columns
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True)
class AsymmetricFriction:
    """Fvp q̇ + Fcp sign(q̇) forwards and Fvn q̇ + Fcn sign(q̇) backwards, on each joint.

    It stands in the place of viscous and Coulomb friction. A current offset cannot be told apart from
    the difference of Fcp and Fcn, so the base parameters regroup it with them.
    """

    robot: Robot
    sign: FrictionSign
    name = "asymmetric_friction"
    sentence = "viscous and dry friction of different size in either direction"

    @property
    def parameters(self) -> tuple[StandardParameter, ...]:
        of_each = (joint_parameters(self.robot, self.name, symbol) for symbol in ("Fvp", "Fcp", "Fvn", "Fcn"))
        return tuple(chain.from_iterable(of_each))

    def speed_terms(self) -> tuple[SpeedTerm, ...]:
        """In the order of ``parameters``."""
        rows = [tuple(row) for row in np.eye(self.robot.n).tolist()]
        shapes: tuple[tuple[FrictionSign | None, Literal[-1, 1]], ...]
        shapes = ((None, 1), (self.sign, 1), (None, -1), (self.sign, -1))
        terms: list[SpeedTerm] = []
        for law, direction in shapes:
            terms += [SpeedTerm(len(terms) + j, row, row, law, direction) for j, row in enumerate(rows)]
        return tuple(terms)

    def columns(self, state: State) -> FloatArray:
        """samples × joints × 4·joints."""
        return speed_columns(self.speed_terms(), state, 4 * self.robot.n)
