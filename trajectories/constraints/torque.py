"""Motor torque along a motion by inverse dynamics, with bounds that hold between samples.

Torque = RNEA (links) + Tᵀ(Ia ∘ T q̈ + Fv ∘ T q̇ + Fc ∘ sign(T q̇)), with T the transmission and Ia, Fv, Fc
the drives' prior figures. The motion is cut into intervals of at most ``step`` seconds, at its jerk
jumps too; over each one the torque is bounded by its value and slope in the middle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio

from robots import rigid_body_model
from robots.arrays import FloatArray
from robots.description import Robot
from trajectories.constraints.use import Use, largest_use, require_within
from trajectories.limits import Limits
from trajectories.motions.motion import Motion, MotionState

FINE = 0.001
COARSE = 0.01
_AT_ONCE = 50_000
"""Intervals that are looked at together: about 100 MB for six axes."""


@dataclass(frozen=True)
class TorqueCheck:
    """Inverse dynamics of one arm with its prior drive figures; arrays (n,), T (n × n)."""

    model: pinocchio.Model
    transmission: FloatArray
    inertia: FloatArray
    viscous: FloatArray
    coulomb: FloatArray
    limits: Limits

    @classmethod
    def of(cls, robot: Robot, limits: Limits) -> TorqueCheck:
        """With the links of the URDF and the drives' a-priori figures."""
        dynamics = [drive.dynamics for drive in robot.drive]
        return cls(
            model=rigid_body_model(robot),
            transmission=robot.transmission_matrix,
            inertia=np.array([d.inertia for d in dynamics]),
            viscous=np.array([d.viscous for d in dynamics]),
            coulomb=np.array([d.coulomb for d in dynamics]),
            limits=limits,
        )

    def use(self, motion: Motion, step: float = FINE) -> tuple[Use, Use]:
        """Use of the joints' torque limits and of the drives' saturation.

        Args:
            motion: any motion of this arm.
            step: longest interval, s. The bounds are exact to first order in it: at 1 ms what is left
                is of the order of 1e-4 of the torque.
        """
        edges = np.union1d(motion.breaks(), np.arange(0.0, motion.duration, step))
        edges = edges[np.append(np.diff(edges) > 1e-9, True)]
        blocks = [
            self._use(motion, edges[first : first + _AT_ONCE + 1])
            for first in range(0, max(1, len(edges) - 1), _AT_ONCE)
        ]
        joint, drive = (largest_use(uses) for uses in zip(*blocks, strict=True))
        return joint, drive

    def within(self, motion: Motion, step: float = COARSE) -> bool:
        """Whether both stay within their limits, on a grid without the jerk's jumps: for the search."""
        edges = np.linspace(0.0, motion.duration, 1 + int(np.ceil(motion.duration / step)))
        return all(bool((use.share <= 1.0).all()) for use in self._use(motion, edges))

    def allows(self, motion: Motion) -> bool:
        """As :meth:`within`."""
        return self.within(motion)

    def excess(self, motion: Motion) -> float:
        """The largest share of a limit above 1, from a coarse look; 0 where none is broken."""
        edges = np.linspace(0.0, motion.duration, 1 + int(np.ceil(motion.duration / (5 * COARSE))))
        return max(0.0, max(float(use.share.max()) for use in self._use(motion, edges)) - 1.0)

    def require(self, motion: Motion) -> None:
        """Raise where a limit is broken.

        Raises:
            TrajectoryError: names the limit, joint, value and time.
        """
        require_within(self.use(motion), self.limits.names)

    def torque(self, state: MotionState) -> FloatArray:
        """Expected torque at the joints at each state, samples × joints, N·m (or N)."""
        data = self.model.createData()
        links = np.array(
            [
                pinocchio.rnea(self.model, data, q, v, a)
                for q, v, a in zip(state.position, state.velocity, state.acceleration, strict=True)
            ]
        )
        speed, acceleration = (x @ self.transmission.T for x in (state.velocity, state.acceleration))
        drives = self.inertia * acceleration + self.viscous * speed + self.coulomb * np.sign(speed)
        return np.asarray(links + drives @ self.transmission)

    def _use(self, motion: Motion, edges: FloatArray) -> tuple[Use, Use]:
        """Torque in the middle of each interval, plus slope times half its length, plus dry friction."""
        half = np.diff(edges)[:, np.newaxis] / 2
        middle = edges[:-1] + half[:, 0]
        state = motion.at(middle)
        links, links_slope = self._links(state)
        drives, drives_slope, sign_low, sign_high = self._drives(state, half)
        matrix, inverse = self.transmission, np.linalg.inv(self.transmission)
        joint, joint_swing = links + drives @ matrix, np.abs(links_slope + drives_slope @ matrix) * half
        drive, drive_swing = links @ inverse + drives, np.abs(links_slope @ inverse + drives_slope) * half
        # Each drive's dry friction reaches every joint that it moves with.
        dry = np.stack([(sign * self.coulomb)[:, :, np.newaxis] * matrix for sign in (sign_low, sign_high)])
        joint_low = joint - joint_swing + dry.min(axis=0).sum(axis=1)
        joint_high = joint + joint_swing + dry.max(axis=0).sum(axis=1)
        drive_low = drive - drive_swing + sign_low * self.coulomb
        drive_high = drive + drive_swing + sign_high * self.coulomb
        return (
            _largest("torque", joint_low, joint_high, middle, self.limits.torque),
            _largest("drive torque", drive_low, drive_high, middle, self.limits.drive_torque),
        )

    def _links(self, state: MotionState) -> tuple[FloatArray, FloatArray]:
        """Torque of the links and its time derivative, samples × joints."""
        data = self.model.createData()
        value = np.empty_like(state.position)
        slope = np.empty_like(state.position)
        for k in range(len(value)):
            q, v, a = state.position[k], state.velocity[k], state.acceleration[k]
            by_q, by_v, by_a = pinocchio.computeRNEADerivatives(self.model, data, q, v, a)
            value[k] = data.tau
            slope[k] = by_q @ v + by_v @ a + by_a @ state.jerk[k]
        return value, slope

    def _drives(
        self, state: MotionState, half: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Smooth torque of the drives, its derivative, and the signs of their speed within an interval."""
        speed, acceleration, jerk = (
            x @ self.transmission.T for x in (state.velocity, state.acceleration, state.jerk)
        )
        value = self.inertia * acceleration + self.viscous * speed
        slope = self.inertia * jerk + self.viscous * acceleration
        reach = np.abs(acceleration) * half + np.abs(jerk) * half**2 / 2
        return value, slope, np.where(speed > reach, 1.0, -1.0), np.where(speed < -reach, -1.0, 1.0)


def _largest(name: str, low: FloatArray, high: FloatArray, time: FloatArray, limit: FloatArray) -> Use:
    largest = np.maximum(np.abs(low), np.abs(high))
    which = largest.argmax(axis=0)
    value = largest.max(axis=0)
    return Use(name, value / limit, time[which], value, limit)
