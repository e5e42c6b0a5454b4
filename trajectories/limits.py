"""The limits that a motion is held to."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from robots.arrays import FloatArray
from robots.description import Robot
from trajectories.errors import TrajectoryError

ROUNDING = 1e-6
"""Share of a limit that arithmetic may be off by without breaking it."""


@dataclass(frozen=True)
class Margins:
    """What is kept free of each limit of the robot: the following error and the model's errors need room.

    Attributes:
        position: share of the travel kept free at each end.
        velocity, acceleration, jerk, torque: share of the limit that may be used.
        speed_factor: < 1 slows everything down as if time were stretched by 1/factor.
    """

    position: float = 0.02
    velocity: float = 0.9
    acceleration: float = 1.0
    jerk: float = 1.0
    torque: float = 0.9
    speed_factor: float = 1.0

    def __post_init__(self) -> None:
        for name in ("velocity", "acceleration", "jerk", "torque", "speed_factor"):
            value = getattr(self, name)
            if not 0.0 < value <= 1.0:
                raise TrajectoryError(f"{name} margin is {value}; allowed: above 0, up to 1", constraint=name)
        if not 0.0 <= self.position < 0.5:
            raise TrajectoryError(
                f"position margin is {self.position}; allowed: from 0, below 0.5", constraint="position"
            )


@dataclass(frozen=True)
class Limits:
    """Limits of one arm, arrays (n,), SI; ``torque`` is at the joints, ``drive_torque`` at drive outputs."""

    names: tuple[str, ...]
    lower: FloatArray
    upper: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    torque: FloatArray
    drive_torque: FloatArray

    @classmethod
    def of(cls, robot: Robot, margins: Margins | None = None) -> Limits:
        """The robot's limits less the margins; home stays allowed even inside the position margin."""
        margins = margins or Margins()
        room = margins.position * (robot.upper - robot.lower)
        home = np.array(robot.home)
        speed = margins.speed_factor
        _require_positive(robot)
        saturation = np.array(robot.controller.saturation) * robot.gains
        return cls(
            names=tuple(joint.name for joint in robot.joint),
            lower=np.minimum(robot.lower + room, home),
            upper=np.maximum(robot.upper - room, home),
            velocity=robot.velocity_limits * margins.velocity * speed,
            acceleration=robot.acceleration_limits * margins.acceleration * speed**2,
            jerk=robot.jerk_limits * margins.jerk * speed**3,
            torque=robot.torque_limits * margins.torque,
            drive_torque=saturation * margins.torque,
        )

    @property
    def n(self) -> int:
        return len(self.names)

    def widened(self, posture: FloatArray) -> Limits:
        """The same limits, with the positions widened to reach a posture (n,)."""
        return replace(self, lower=np.minimum(self.lower, posture), upper=np.maximum(self.upper, posture))

    def at_speed(self, factor: float) -> Limits:
        """The same limits as if time were stretched by 1/factor."""
        return replace(
            self,
            velocity=self.velocity * factor,
            acceleration=self.acceleration * factor**2,
            jerk=self.jerk * factor**3,
        )

    def with_torque_share(self, share: float) -> Limits:
        """The same limits with a share of the torques."""
        return replace(self, torque=self.torque * share, drive_torque=self.drive_torque * share)


def _require_positive(robot: Robot) -> None:
    for joint in robot.joint:
        for name in ("velocity", "acceleration", "jerk", "torque"):
            value = getattr(joint, name)
            if not 0.0 < value < float("inf"):
                raise TrajectoryError(
                    f"{name} limit is {value:g}; allowed: above 0", constraint=name, joint=joint.name
                )


def require_posture(posture: FloatArray, limits: Limits, what: str) -> None:
    """Raise where a posture (n,) is not a finite vector inside the position limits.

    Raises:
        TrajectoryError: names the posture, the joint, the value and what is allowed.
    """
    if np.shape(posture) != (limits.n,):
        raise TrajectoryError(
            f"{what} has {np.size(posture)} values; allowed: {limits.n}, one per joint", constraint="position"
        )
    for name, value, low, high in zip(limits.names, posture, limits.lower, limits.upper, strict=True):
        room = ROUNDING * (high - low)
        if not low - room <= value <= high + room:
            raise TrajectoryError(
                f"{what} position is {value:.6g}; allowed: {low:.6g} to {high:.6g}",
                constraint="position",
                joint=name,
            )
