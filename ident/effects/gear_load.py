"""Torque through a drive's gear, which friction of the load follows: for columns and for the simulation.

Friction follows its load at once, or late: a film of lubricant has a memory of some milliseconds (Hess and
Soom, J. Tribol. 112, 1990: 3 to 9 ms). Every friction of the load has a form of either kind.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ident.effects.family import Place, PresentModel, Shape
from ident.effects.giving_way import torque_through_gears
from ident.effects.placed import OFFSET_AT_LINK, Family, drive_row, drive_torque
from ident.effects.simulated import FrictionTorque
from ident.effects.state import State
from ident.effects.usual import friction_sign
from ident.filters import recursion
from robots.arrays import FloatArray
from robots.description import Robot

MEMORY = 0.005
"""s, of what is measured about the middle."""

LOAD_MEMORY = Shape("load_memory", "s", (0.003, 0.009), 0.001, 0.02, logarithmic=True)
"""Time constant with which friction follows its load."""


@dataclass(frozen=True, eq=False)
class GearLoad:
    """Torque of the links at a drive's output, and of the model's offset where that acts behind the gear.

    Attributes:
        robot, place: the arm, and the drive.
        present: the model, asked for torques.
        offset_at_link: whether its offset is a load (1) or an error of measurement (0).
        memory: time constant with which friction follows the load, s.
    """

    robot: Robot
    place: Place
    present: PresentModel
    offset_at_link: float
    memory: float = 0.0

    def torque(self, state: State) -> FloatArray:
        """(samples,) N·m (or N), as friction follows it; at once where no time is known."""
        links = torque_through_gears(self.present, state)
        joints = links + self.offset_at_link * self.present.offset_torque()
        return followed(drive_torque(self.robot, joints, self.place.joints[0]), state.time, self.memory)

    def friction(
        self, size: float, side: Literal["both", "driving", "driven", "square"] = "both", share: float = 0.0
    ) -> FrictionTorque:
        """Friction of this load, against the drive's speed; ``side`` and ``share`` as of the simulation."""
        row = drive_row(self.robot, self.place)
        inverse = np.linalg.inv(self.robot.transmission_matrix)
        through = np.asarray(inverse[:, self.place.joints[0]], dtype=np.float64)
        return FrictionTorque(
            row,
            size * row,
            friction_sign(self.robot),
            load_row=through,
            load_offset=float(self.offset_at_link * self.present.offset_torque() @ through),
            load_memory=self.memory,
            load_side=side,
            load_share=share,
        )


def at_once(robot: Robot, place: Place) -> tuple[Shape, ...]:
    """Shapes of friction that follows its load at once."""
    return (OFFSET_AT_LINK,)


def late_form(family: Family) -> Family:
    """The same friction behind a memory of its load."""

    def shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
        return (*at_once(robot, place), LOAD_MEMORY)

    sentence = f"{family.sentence}, and follows it late"
    return replace(family, sentence=sentence, shapes_of=shapes, history=True)


def followed(load: FloatArray, time: FloatArray | None, memory: float) -> FloatArray:
    """A first-order lag of a load (samples,), which goes on straight between samples: (samples,).

    It begins settled, and follows at once where no time is known. From sample to sample, with x = step/memory
    and kept = exp(−x), T dy/dt = u − y on a ramp is y⁺ = kept·y + (1 − kept)·u + (1 − (1 − kept)/x)·(u⁺ − u).

    Args:
        load: N·m (or N).
        time: (samples,) s, evenly spaced.
        memory: T, s.
    """
    if time is None or time.shape[0] < 2 or memory <= 0.0:
        return load
    x = float(time[1] - time[0]) / memory
    taken = -float(np.expm1(-x))
    ramp = 1.0 - taken / x
    driven = np.concatenate([load[:1], (taken - ramp) * load[:-1] + ramp * load[1:]])
    return recursion(np.array([1.0, taken - 1.0]), driven)
