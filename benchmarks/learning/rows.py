"""What a learner sees of a recording: windows of motion, torque and residual after an accepted model.

Everything is per drive and in figures without a unit, so that what is learned on one arm can be asked on
another one, with any number of drives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident import Recording, RegressorModel, base_parameters
from ident.effects import State
from ident.estimators import stack, weighted_least_squares
from ident.parameters.base import BaseParameters
from ident.preparation.observation import observe
from ident.preparation.observed_torque import observed_torque
from ident.signals import motion
from robots import Robot
from robots.arrays import BoolArray, FloatArray

RATE = 50.0
"""Rows a second."""
LENGTH = 300
"""Rows of a window: 6 s."""
CHANNELS = (
    "position",
    "speed",
    "acceleration",
    "torque",
    "load",
    "residual",
    "at standstill",
    "fast residual",
)
RESIDUAL = 5
"""The first channel of residuals: where the drive moves, near its standstills, and within rows."""
CONTEXT = (
    "torque limit",
    "Coulomb friction",
    "viscous friction",
    "rotor",
    "speed limit",
    "standstill",
    "fast",
)
_SLOW, _NEAR = 0.01, 2
"""Share of the speed limit, and rows on either side, that are near a standstill: friction is no law there."""
_ACCELERATION = 20.0
"""rad/s² (or m/s²) that accelerations are shares of."""
_CLIPPED = 1000.0
"""Noise floors: a residual beyond that says no more."""


@dataclass(frozen=True)
class Accepted:
    """An arm with the model that was accepted on a clean recording of it.

    Attributes:
        robot: as described.
        base, values: base parameters and their estimate, (b,).
        floor: 3 × n rms of what the model leaves per drive on the clean recording, N·m: of rows where it
            moves, near standstills, and within rows.
    """

    robot: Robot
    base: BaseParameters
    values: FloatArray
    floor: FloatArray

    @classmethod
    def on(cls, robot: Robot, clean: Recording, base: BaseParameters | None = None) -> Accepted:
        """By weighted least squares.

        Args:
            robot: the description.
            clean: a recording of the arm without any further effect.
            base: of that robot, where it is known already.
        """
        base = base_parameters(RegressorModel.of(robot)) if base is None else base
        rows = observe(base, (clean,), robot.identification)
        values = weighted_least_squares(stack(rows), base.names).beta
        left = cls(robot, base, values, np.ones((3, robot.n))).channels(clean)[..., RESIDUAL:]
        # A drive that never stands has no rows there: as loud as where it moves.
        power = np.sum(np.square(left), axis=0).T / np.maximum((left != 0).sum(axis=0).T, 1)
        power[1] = np.where(power[1] > 0, power[1], power[0])
        return cls(robot, base, values, np.sqrt(power))

    @property
    def context(self) -> FloatArray:
        """What is known of each drive beforehand, n × ``CONTEXT``: logarithms of noise floors."""
        drives = [drive.dynamics for drive in self.robot.drive]
        speed = self.robot.velocity_limits
        torques = (
            self.robot.torque_limits,
            np.array([one.coulomb for one in drives]),
            np.array([one.viscous for one in drives]) * speed,
            np.array([one.inertia for one in drives]) * _ACCELERATION,
        )
        of_floor = [np.log(np.maximum(torque / self.floor[0], 1e-3)) for torque in torques]
        return np.column_stack([*of_floor, np.log(speed), *np.log(self.floor[1:] / self.floor[0])])

    def channels(self, recording: Recording) -> FloatArray:
        """Rows × n × ``CHANNELS``, residuals in noise floors.

        A row is the mean of a fiftieth of a second; what is faster is one figure, its deviation.
        """
        settings = self.robot.identification.model_copy(update={"decimation": 1})
        moved = motion(recording.time, recording.position, settings)
        torque = observed_torque(self.robot, recording, settings, as_rows=True)
        left = torque - self.base.torque(
            State(moved.position, moved.velocity, moved.acceleration), self.values
        )
        matrix = self.robot.transmission_matrix
        to_drive = np.linalg.inv(matrix)
        position, speed, height = (
            one @ matrix.T for one in (moved.position, moved.velocity, moved.acceleration)
        )
        torque, left = torque @ to_drive, left @ to_drive
        load = torque - self._own_torque(speed, height)
        limits = self.robot.torque_limits
        samples = max(1, round(1.0 / (RATE * recording.sample_time)))
        rows = len(left) // samples

        def parts(values: FloatArray) -> FloatArray:
            return values[: rows * samples].reshape(rows, samples, -1)

        share = parts(speed).mean(axis=1) / self.robot.velocity_limits
        still = _widened(np.abs(share) < _SLOW)
        mean = parts(left).mean(axis=1)
        found = [
            parts(position).mean(axis=1),
            share,
            parts(height).mean(axis=1) / _ACCELERATION,
            parts(torque).mean(axis=1) / limits,
            parts(load).mean(axis=1) / limits,
            np.where(still, 0.0, mean / self.floor[0]),
            np.where(still, mean / self.floor[1], 0.0),
            np.where(still, 0.0, parts(left).std(axis=1) / self.floor[2]),
        ]
        return np.clip(np.stack(found, axis=2), -_CLIPPED, _CLIPPED)

    def windows(self, recording: Recording) -> FloatArray:
        """Windows × ``LENGTH`` × n × ``CHANNELS``, one after the other from the beginning."""
        rows = self.channels(recording)
        count = len(rows) // LENGTH
        shape = (count, LENGTH, *rows.shape[1:])
        return np.asarray(rows[: count * LENGTH].reshape(shape), dtype=np.float32)

    def _own_torque(self, speed: FloatArray, height: FloatArray) -> FloatArray:
        """Described friction and rotor of each drive, N·m: the rest of its torque goes through the gear."""
        torque = np.zeros_like(speed)
        for number, drive in enumerate(self.robot.drive):
            one, v = drive.dynamics, speed[:, number]
            torque[:, number] = (
                one.inertia * height[:, number] + one.viscous * v + one.coulomb * np.tanh(v / 0.005)
            )
        return torque


def _widened(flags: BoolArray) -> BoolArray:
    """Rows × n flags that hold for the rows beside them, too."""
    found = flags.copy()
    for shift in range(1, _NEAR + 1):
        found[shift:] |= flags[:-shift]
        found[:-shift] |= flags[shift:]
    return found
