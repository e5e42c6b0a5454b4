"""What leads a simulation of one recording, what a run gives, and when it is no run of a stable loop."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ident.closed_loop.control_law import fed_forward
from ident.closed_loop.integral_rule import as_it_integrates
from ident.errors import IdentificationError, SimulationDivergedError
from ident.preparation.set_points import set_point_accelerations, set_points
from ident.recording import Recording
from robots.arrays import FloatArray
from robots.description import Robot

RUNAWAY = 3.0
"""A joint beyond this many times its velocity limit says that the simulated loop is unstable."""


_LONGEST_STEP = 0.00025
"""s; of the integration, where nothing else is asked for."""


@dataclass(frozen=True)
class SimulatedRun:
    """What the simulated arm did at the recording's instants; samples × joints, rad (or m), no noise."""

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    control_signal: FloatArray


@dataclass(frozen=True)
class Leading:
    """What leads every simulation of one recording.

    Attributes:
        robot: the arm.
        recording: whose initial state and sampling count.
        points, speeds: (controller samples, n) set-points at the drive outputs and their velocities.
        added: (controller samples, n) control signal beside the controller's, or (0, n) where there is none:
            fed forward, injected, and what forces from outside come to, which the drives do not show.
        outside: (samples, n) of these the forces from outside at the samples, or (0, n).
        velocity: (n,) of the joints at the start.
        per_sample: controller samples per recorded sample.
        substeps: integration steps per controller sample.
    """

    robot: Robot
    recording: Recording
    points: FloatArray
    speeds: FloatArray
    added: FloatArray
    outside: FloatArray
    velocity: FloatArray
    per_sample: int
    substeps: int

    @property
    def signal(self) -> FloatArray:
        """(n,) control signal that the arm feels at the start."""
        first = self.recording.control_signal[0]
        return np.asarray(first + self.outside[0]) if self.outside.size else first

    def as_drives_show(self, run: SimulatedRun) -> SimulatedRun:
        """A run with the control signals of the drives alone."""
        if not self.outside.size:
            return run
        return replace(run, control_signal=run.control_signal - self.outside)


def leading_of(robot: Robot, recording: Recording, substeps: int | None) -> Leading:
    if recording.reference is None:
        raise IdentificationError(f"{recording.name}: no position reference was recorded")
    if not robot.controller.is_given:
        raise IdentificationError("robot.toml describes no controller, so the loop cannot be simulated")
    per_sample = _controller_samples(robot, recording)
    robot = as_it_integrates(robot, recording)
    # Not the product of a library that spreads it over threads: small, and the same bits everywhere.
    targets = np.einsum("sj,dj->sd", recording.reference, robot.transmission_matrix)
    velocity = start_velocity(recording, robot.velocity_limits)
    moving = bool(velocity.any())
    points, speeds = set_points(robot, targets, recording.sample_time, per_sample, moving)
    if substeps is None:
        substeps = max(1, int(np.ceil(robot.controller.sample_time / _LONGEST_STEP * (1 - 1e-9))))
    accelerations = set_point_accelerations(targets, recording.sample_time, per_sample, moving)
    added = fed_forward(robot.controller, speeds, accelerations)
    outside, fine = np.empty((0, robot.n)), None
    if recording.outside is not None:
        forces = robot.control_signal(recording.outside)
        outside = _within(forces, per_sample, 0.0)[::per_sample]
        # Forces act without the delay of the controller's output.
        fine = _within(forces, per_sample, robot.controller.delay_samples)
    # A drive holds what it was sent.
    sent = None if recording.added is None else np.repeat(recording.added, per_sample, axis=0)
    for beside in (fine, sent):
        if beside is not None:
            added = added + beside if added.size else beside
    return Leading(robot, recording, points, speeds, added, outside, velocity, per_sample, substeps)


def _within(values: FloatArray, per_sample: int, later: float) -> FloatArray:
    """Means over controller samples of a course that is known at recorded samples: (controller samples, n).

    Args:
        values: (samples, n).
        per_sample: controller samples per recorded sample.
        later: controller samples by which the mean is taken later.
    """
    known = np.arange(values.shape[0])
    at = (np.arange(values.shape[0] * per_sample) + 0.5 + later) / per_sample
    return np.stack([np.interp(at, known, column) for column in values.T], axis=1)


def _controller_samples(robot: Robot, recording: Recording) -> int:
    ratio = recording.sample_time / robot.controller.sample_time
    per_sample = round(ratio)
    if per_sample < 1 or abs(ratio - per_sample) > 0.01 * per_sample:
        raise IdentificationError(
            f"{recording.name}: sampled every {recording.sample_time:g} s, the controller every"
            f" {robot.controller.sample_time:g} s; allowed: a whole multiple"
        )
    return per_sample


def check_stable(velocity: FloatArray, limit: FloatArray, time: float) -> None:
    """Refuse a run whose joint speeds (n,) are beyond all limits, or no numbers.

    Raises:
        SimulationDivergedError: names the joint and the time.
    """
    fast = ~(np.abs(velocity) <= limit)
    if fast.any():
        joint = int(np.argmax(fast)) + 1
        raise SimulationDivergedError(
            f"the simulated loop is unstable: joint {joint} runs away at {time:.3f} s;"
            " controller and model do not belong together"
        )


_WINDOW = 0.016
"""s, at least, from which the velocity is taken: short against any motion, long against noise."""


_FEWEST = 9
"""Samples, at least."""


_STANDING = 0.01
"""Share of the velocity limits; an arm of which no joint is faster starts at rest."""


def start_velocity(recording: Recording, limits: FloatArray) -> FloatArray:
    """Joint velocities (n,) at the first sample: of the cubic through the first ones, or zero at rest.

    A recording starts in motion where it is a piece after a gap, or was begun while the arm moved.

    Args:
        recording: whose measured positions count.
        limits: (n,) velocity limits.
    """
    samples = max(_FEWEST, int(np.ceil(_WINDOW / recording.sample_time)) + 1)
    if recording.time.shape[0] < samples:
        return np.zeros(recording.joints)
    time = recording.time[:samples] - recording.time[0]
    powers = (time[:, np.newaxis] / time[-1]) ** np.arange(4)
    fitted = np.linalg.lstsq(powers, recording.position[:samples], rcond=None)[0]
    velocity = np.asarray(fitted[1] / time[-1])
    return velocity if (np.abs(velocity) > _STANDING * limits).any() else np.zeros(recording.joints)
