"""Closed-loop simulation: the source of the instruments (METHOD 3)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ident.closed_loop.control_law import ControlLaw
from ident.closed_loop.direct_dynamics import DirectDynamics
from ident.errors import IdentificationError
from ident.recording import Recording
from ident.regressor import RegressorModel
from robots.arrays import FloatArray
from robots.description import Robot

_RUNAWAY = 3.0
"""A joint beyond this many times its velocity limit says that the simulated loop is unstable."""


@dataclass(frozen=True)
class SimulatedRun:
    """What the simulated arm did at the recording's instants; samples × joints, rad (or m), no noise."""

    time: FloatArray
    position: FloatArray
    velocity: FloatArray
    control_signal: FloatArray


def simulate(
    model: RegressorModel, standard: FloatArray, recording: Recording, substeps: int = 2
) -> SimulatedRun:
    """Run the direct model under the recording's references, control law and initial state.

    Args:
        model: the effects.
        standard: (p,) their parameters.
        recording: gives references, sampling and the initial state.
        substeps: integration steps per controller sample.

    Raises:
        IdentificationError: no reference was recorded, the sampling is not a multiple of the
            controller's, the mass matrix is not positive definite, or the loop is unstable.
    """
    robot = model.robot
    if recording.reference is None:
        raise IdentificationError(f"{recording.name}: no position reference was recorded")
    per_sample = _controller_samples(robot, recording)
    dynamics = DirectDynamics(model, standard)
    transmission = robot.transmission_matrix
    start = recording.position[0]
    law = ControlLaw(robot.controller, transmission @ start, recording.control_signal[0])
    h = robot.controller.sample_time / substeps
    position, velocity = start.copy(), np.zeros(robot.n)
    samples = recording.time.shape[0]
    run = SimulatedRun(recording.time, *(np.empty((samples, robot.n)) for _ in range(3)))
    limit = _RUNAWAY * robot.velocity_limits
    for k, set_points in enumerate(
        _set_points(robot, recording.reference, recording.sample_time, per_sample)
    ):
        run.position[k], run.velocity[k] = position, velocity
        for i, (reference, rate) in enumerate(set_points):
            signal = law.step(transmission @ reference, transmission @ rate, transmission @ position)
            if i == 0:
                run.control_signal[k] = signal
            torque = robot.joint_torque(signal)
            for _ in range(substeps):
                velocity = dynamics.step(position, velocity, torque, h)
                position = position + h * velocity
        _check_stable(velocity, limit, float(recording.time[k]))
    return run


def _controller_samples(robot: Robot, recording: Recording) -> int:
    ratio = recording.sample_time / robot.controller.sample_time
    per_sample = round(ratio)
    if per_sample < 1 or abs(ratio - per_sample) > 0.01 * per_sample:
        raise IdentificationError(
            f"{recording.name}: sampled every {recording.sample_time:g} s, the controller every"
            f" {robot.controller.sample_time:g} s; allowed: a whole multiple"
        )
    return per_sample


def _set_points(
    robot: Robot, reference: FloatArray, period: float, per_sample: int
) -> Iterator[list[tuple[FloatArray, FloatArray]]]:
    """Per recorded sample: the (set-point, its velocity) of each controller sample until the next.

    ``hold``: the target of this sample. ``linear``: the way from the previous target to this one, which
    takes a whole period. ``spline``: the uniform quadratic B-spline over the last three targets, whose
    velocity is continuous.
    """
    shares = [i / per_sample for i in range(per_sample)]
    before = previous = reference[0]
    for target in reference:
        last, rate = (previous - before) / period, (target - previous) / period
        if robot.controller.interpolation == "hold":
            yield [(target, rate)] * per_sample
        elif robot.controller.interpolation == "linear":
            yield [(previous + s * (target - previous), rate) for s in shares]
        else:
            middle = 0.5 * (before + previous)
            speeds = [last + s * (rate - last) for s in shares]
            yield [
                (middle + 0.5 * s * period * (last + speed), speed)
                for s, speed in zip(shares, speeds, strict=True)
            ]
        before, previous = previous, target


def _check_stable(velocity: FloatArray, limit: FloatArray, time: float) -> None:
    fast = ~(np.abs(velocity) <= limit)
    if fast.any():
        joint = int(np.argmax(fast)) + 1
        raise IdentificationError(
            f"the simulated loop is unstable: joint {joint} runs away at {time:.3f} s;"
            " controller and model do not belong together"
        )
