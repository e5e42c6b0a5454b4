"""Where effects can sit, and what is known of the arm there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivers.simulated.drawing.gap import Ruler
from robots import Robot

Axes = tuple[int, ...]
"""Joints or drives from 1; empty for the whole arm."""


@dataclass(frozen=True)
class Place:
    """Where an effect is about to be put, and what is known of the arm there."""

    axes: Axes
    robot: Robot
    ruler: Ruler

    @property
    def index(self) -> int:
        """Of its first axis, from 0."""
        return self.axes[0] - 1

    def figure(self, prefix: str) -> float:
        """The arm's true ``Ia``, ``Fv``, ``Fc`` of the drive."""
        return self.ruler.truth.parameters[f"{prefix}{self.axes[0]}"]

    @property
    def slides(self) -> bool:
        """Whether the joint is prismatic."""
        return self.robot.joint[self.index].kind == "prismatic"

    def travel(self) -> tuple[float, float]:
        """Lowest and highest joint position of the motion."""
        path = self.ruler.quiet.position[:, self.index]
        return float(path.min()), float(path.max())

    def order(self, waves: float) -> float:
        """Of so many waves per turn, or over the whole travel of what slides, per rad or m."""
        low, high = self.travel()
        return waves * (2.0 * np.pi / (high - low) if self.slides else 1.0)

    def signal(self) -> float:
        """Largest control signal of the motion."""
        return float(np.abs(self.ruler.quiet.control_signal[:, self.index]).max())

    def torque(self) -> float:
        """Torque limit of the joint, N·m."""
        return float(self.robot.torque_limits[self.index])


def each_axis(robot: Robot) -> tuple[Axes, ...]:
    """Each joint or drive."""
    return tuple((axis,) for axis in range(1, robot.n + 1))


def each_revolute(robot: Robot) -> tuple[Axes, ...]:
    """Each joint that turns."""
    return tuple((j,) for j, joint in enumerate(robot.joint, start=1) if joint.kind == "revolute")


def each_rotor(robot: Robot) -> tuple[Axes, ...]:
    """Each drive whose rotor has an inertia of its own: only between two masses can a gear give way."""
    return tuple((i,) for i, drive in enumerate(robot.drive, start=1) if drive.dynamics.inertia > 0)


def whole_arm(robot: Robot) -> tuple[Axes, ...]:
    """One place: the arm."""
    return ((),)


def uncoupled_neighbours(robot: Robot) -> tuple[Axes, ...]:
    """Pairs of neighbouring joints of one kind whose drives are not described as coupled."""
    matrix = robot.transmission_matrix
    return tuple(
        (j, j + 1)
        for j in range(1, robot.n)
        if robot.joint[j - 1].kind == robot.joint[j].kind and not matrix[j, j - 1] and not matrix[j - 1, j]
    )


def pairs(robot: Robot) -> tuple[Axes, ...]:
    """Ordered pairs of different drives."""
    return tuple((a, b) for a in range(1, robot.n + 1) for b in range(1, robot.n + 1) if a != b)


def delay_places(robot: Robot) -> tuple[Axes, ...]:
    """The bus as a whole as often as each of the drives together."""
    single = each_axis(robot)
    return single + ((),) * len(single) if robot.n > 1 else single
