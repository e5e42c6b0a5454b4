"""Coupled axes as a family: a drive that also moves with its neighbour, whether described so or not."""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel, Shape
from ident.effects.placed import ANY, Family, Law, Parameters, Parts, along, angle_unit, torque_unit
from ident.effects.scales import dry_friction, rotor_inertia, viscous_friction
from ident.effects.simulated import FrictionTorque, SimulatedParts
from ident.effects.state import State
from ident.effects.usual import friction_sign
from robots.arrays import FloatArray
from robots.description import Robot

_RATIOS = (-1.0, -0.5, 0.5, 1.0)


def _places(robot: Robot) -> tuple[Place, ...]:
    """Neighbouring joints: the drive of the second also moves with the first."""
    return tuple(Place("joint_pair", (joint, joint + 1)) for joint in range(robot.n - 1))


def _row(robot: Robot, place: Place, ratio: float) -> FloatArray:
    """(n,) how the second joint's drive would move: with its own joint, and so much with the first."""
    row = np.zeros(robot.n)
    row[place.joints[1]], row[place.joints[0]] = 1.0, ratio
    return row


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """A shaft that turns by the row: inertia, viscous and Coulomb friction of its own speed.

    Where the description couples the two, the model's Ia and Fv of both joints hold the shaft's share of
    each already, and the columns hold the products between them. Otherwise the shaft is one more body.
    """
    row, sign = _row(robot, place, shape[0]), friction_sign(robot)
    between = np.outer(row, row)
    if _described(robot, place):
        between -= np.diag(row**2)

    def law(state: State) -> FloatArray:
        return np.concatenate(
            [
                (state.acceleration @ between)[:, :, np.newaxis],
                (state.velocity @ between)[:, :, np.newaxis],
                along(row, sign(state.velocity @ row)),
            ],
            axis=2,
        )

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(
            inertia=values[0] * between,
            damping=values[1] * between,
            friction=(FrictionTorque(row, values[2] * row, sign),),
        )

    second = Place("drive", (place.joints[1],))
    torque, angle = torque_unit(robot, second), angle_unit(robot, second)
    symbols = ("Iam", "Fvm", "Fcm")
    units = ("kg·m²" if angle == "rad" else "kg", f"{torque}·s/{angle}", torque)
    scale = (
        0.3 * rotor_inertia(robot, second),
        0.5 * viscous_friction(robot, second),
        0.5 * dry_friction(robot, second),
    )
    return Parameters(symbols, units, (ANY, ANY, ANY), scale), law, parts


def _described(robot: Robot, place: Place) -> float:
    """Turns of the second joint's drive per turn of the first joint, as described; 0 where not coupled."""
    first, second = place.joints
    return float(robot.transmission_matrix[second, first])


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    described = _described(robot, place)
    ratios = (described,) if described else _RATIOS
    return (Shape("ratio", "1", ratios, -1.0, 1.0, fixed=True),)


WRIST_COUPLING = Family(
    "wrist_coupling",
    "inertia and friction of a drive that moves with more than one joint",
    "joint_pair",
    _places,
    _make,
    _shapes,
    settled_by="move one of the two axes while the other rests: the coupling shows there",
    equation=(
        "a shaft that turns with ratio times the first joint plus the second, with inertia Iam, viscous"
        " friction Fvm and Coulomb friction Fcm. Where the description couples the two already, their own"
        " `Ia` and `Fv` hold the shaft's share"
    ),
    row=140,
)
