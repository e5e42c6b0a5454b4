"""The usual terms of each joint's drive: rotor inertia, friction, offset of the current measurement."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import Literal

import numpy as np

from ident.effects.family import Place, StandardParameter
from ident.effects.speed_term import FrictionSign, SpeedTerm, speed_columns
from ident.effects.state import State
from robots import unit_of
from robots.arrays import FloatArray
from robots.description import Robot


def diagonal_columns(values: FloatArray) -> FloatArray:
    """samples × joints → samples × joints × joints, with joint j's value on joint j's column."""
    columns = np.zeros((*values.shape, values.shape[1]))
    joints = np.arange(values.shape[1])
    columns[:, joints, joints] = values
    return columns


def joint_parameters(robot: Robot, effect: str, symbol: str) -> tuple[StandardParameter, ...]:
    """A parameter of each joint, with a unit by the joint's kind.

    Args:
        robot: the arm.
        effect: that they belong to.
        symbol: of a drive's parameter, e.g. ``Fc``, or ``Fcp`` for a form of it.
    """
    return tuple(
        StandardParameter(symbol, Place("joint", (k,)), effect, unit_of(symbol, joint.kind))
        for k, joint in enumerate(robot.joint)
    )


@dataclass(frozen=True)
class RotorInertia:
    """Ia q̈ on each joint: the inertia of rotor and gear seen at the joint."""

    robot: Robot

    name = "rotor_inertia"
    sentence = "inertia of the rotor and gear"

    @property
    def parameters(self) -> tuple[StandardParameter, ...]:
        return joint_parameters(self.robot, self.name, "Ia")

    def columns(self, state: State) -> FloatArray:
        """samples × joints × joints."""
        return diagonal_columns(state.acceleration)

    def torque(self, state: State, values: FloatArray) -> FloatArray:
        """Joint torque for values (n,) of the parameters, samples × joints."""
        return state.acceleration * values


@dataclass(frozen=True)
class ViscousFriction:
    """Fv q̇ on each joint."""

    robot: Robot

    name = "viscous_friction"
    sentence = "friction that grows in proportion to speed"

    @property
    def parameters(self) -> tuple[StandardParameter, ...]:
        return joint_parameters(self.robot, self.name, "Fv")

    def columns(self, state: State) -> FloatArray:
        """samples × joints × joints."""
        return diagonal_columns(state.velocity)

    def torque(self, state: State, values: FloatArray) -> FloatArray:
        """Joint torque for values (n,) of the parameters, samples × joints."""
        return state.velocity * values


@dataclass(frozen=True)
class CoulombFriction:
    """Fc sign(q̇) on each joint, with the sign's smooth form where the arm's settings ask for it."""

    robot: Robot
    sign: FrictionSign
    name = "coulomb_friction"
    sentence = "dry friction of constant size against the motion"

    @property
    def parameters(self) -> tuple[StandardParameter, ...]:
        return joint_parameters(self.robot, self.name, "Fc")

    def speed_terms(self) -> tuple[SpeedTerm, ...]:
        """One per joint."""
        rows = np.eye(self.robot.n).tolist()
        return tuple(SpeedTerm(joint, tuple(row), tuple(row), self.sign) for joint, row in enumerate(rows))

    def columns(self, state: State) -> FloatArray:
        """samples × joints × joints."""
        return speed_columns(self.speed_terms(), state, self.robot.n)

    def torque(self, state: State, values: FloatArray) -> FloatArray:
        """Joint torque for values (n,) of the parameters, samples × joints."""
        return self.sign(state.velocity) * values


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


@dataclass(frozen=True)
class CurrentOffset:
    """A constant torque on each joint, or on those that the arm's settings name: the current's offset.

    The columns of the others are zero, so they have no base parameter.
    """

    robot: Robot

    name = "current_offset"
    sentence = "constant offset of the measured torque"

    @property
    def parameters(self) -> tuple[StandardParameter, ...]:
        return joint_parameters(self.robot, self.name, "off")

    def columns(self, state: State) -> FloatArray:
        """samples × joints × joints."""
        return diagonal_columns(np.ones_like(state.velocity) * self.robot.identification.offset)

    def torque(self, state: State, values: FloatArray) -> FloatArray:
        """Joint torque for values (n,) of the parameters, samples × joints."""
        offset = np.multiply(self.robot.identification.offset, values)
        return np.tile(offset, (state.velocity.shape[0], 1))
