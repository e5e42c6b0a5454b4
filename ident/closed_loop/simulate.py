"""Closed-loop simulation: the source of the instruments (method.md 3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.closed_loop.control_law import ControlLaw, fed_forward
from ident.closed_loop.direct_dynamics import DirectDynamics
from ident.closed_loop.integral_rule import as_it_integrates
from ident.closed_loop.torque_parts import ModelStructure, TorqueParts
from ident.effects.chain import chain_frames
from ident.errors import IdentificationError, SimulationDivergedError
from ident.parameters.regressor import RegressorModel
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
        added: (controller samples, n) control signal fed forward, or (0, n) where the controller does not.
        velocity: (n,) of the joints at the start.
        per_sample: controller samples per recorded sample.
        substeps: integration steps per controller sample.
    """

    robot: Robot
    recording: Recording
    points: FloatArray
    speeds: FloatArray
    added: FloatArray
    velocity: FloatArray
    per_sample: int
    substeps: int


def simulate(
    model: RegressorModel, standard: FloatArray, recording: Recording, substeps: int | None = None
) -> SimulatedRun:
    """Run the direct model under the recording's references, control law and initial state.

    Args:
        model: the effects.
        standard: (p,) their parameters.
        recording: gives references, sampling and the initial state.
        substeps: integration steps per controller sample; by default as many as keep a step within 0.25 ms.

    Raises:
        IdentificationError: no reference was recorded, the sampling is not a multiple of the
            controller's, or an effect cannot be simulated.
        MassMatrixError: the mass matrix is not positive definite.
        SimulationDivergedError: the loop is unstable.
    """
    return simulate_many(model, np.asarray(standard)[np.newaxis], recording, substeps, threads=1)[0]


def simulate_many(
    model: RegressorModel,
    standards: FloatArray,
    recording: Recording,
    substeps: int | None = None,
    threads: int | None = None,
) -> tuple[SimulatedRun, ...]:
    """The same for many parameter vectors; the results do not depend on the number of threads.

    Args:
        model: the effects.
        standards: (replicates, p) their parameters.
        recording: gives references, sampling and the initial state.
        substeps: as in :func:`simulate`.
        threads: by default one per processor.

    Raises:
        IdentificationError: as :func:`simulate`, for the first vector that cannot be simulated.
    """
    leading = leading_of(model.robot, recording, substeps)
    structure = ModelStructure(model)
    parts = [structure.parts(standard) for standard in standards]
    frames = chain_frames(structure.rigid_body)
    if frames is None or any(part.others for part in parts):
        _only_usual(parts)
        return tuple(run_in_python(structure, part, leading) for part in parts)
    # Imported here: the compiler takes a second to load, and most commands do not simulate.
    from ident.closed_loop.compiled import run_compiled

    run = partial(run_compiled, frames, leading)
    return tuple(at_once(run, parts, threads))


def _only_usual(parts: Sequence[TorqueParts]) -> None:
    """Refuse what only the compiled loop can, beside what it cannot.

    Raises:
        IdentificationError: names the effect.
    """
    for part in parts:
        if not part.usual:
            why = part.others[0][0].name if part.others else "a branched chain of links"
            raise IdentificationError(
                f"{why} has no compiled simulation; allowed beside it: effects without simulated parts of"
                " their own"
            )


def leading_of(robot: Robot, recording: Recording, substeps: int | None) -> Leading:
    if recording.reference is None:
        raise IdentificationError(f"{recording.name}: no position reference was recorded")
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
    return Leading(robot, recording, points, speeds, added, velocity, per_sample, substeps)


def _controller_samples(robot: Robot, recording: Recording) -> int:
    ratio = recording.sample_time / robot.controller.sample_time
    per_sample = round(ratio)
    if per_sample < 1 or abs(ratio - per_sample) > 0.01 * per_sample:
        raise IdentificationError(
            f"{recording.name}: sampled every {recording.sample_time:g} s, the controller every"
            f" {robot.controller.sample_time:g} s; allowed: a whole multiple"
        )
    return per_sample


def run_in_python(structure: ModelStructure, parts: TorqueParts, leading: Leading) -> SimulatedRun:
    """One run of any model, evaluated effect by effect: slow, but it takes what the compiled code does not.

    Raises:
        IdentificationError: as :func:`simulate`.
    """
    robot, recording = leading.robot, leading.recording
    h = robot.controller.sample_time / leading.substeps
    dynamics = DirectDynamics(structure, parts, recording.position[0], h)
    transmission = robot.transmission_matrix
    position, velocity = recording.position[0].copy(), leading.velocity.copy()
    law = ControlLaw(
        robot.controller, transmission @ position, recording.control_signal[0], transmission @ velocity
    )
    # As in ``ident.kernels.loop``: velocities between steps, positions in the middle of each.
    position += 0.5 * h * velocity
    last = velocity
    samples = recording.time.shape[0]
    run = SimulatedRun(recording.time, *(np.empty((samples, robot.n)) for _ in range(3)))
    for step in range(samples * leading.per_sample):
        sample, part = divmod(step, leading.per_sample)
        added = leading.added[step] if leading.added.size else None
        seen = position - 0.5 * h * velocity
        signal = law.step(leading.points[step], leading.speeds[step], transmission @ seen, added)
        if part == 0:
            run.position[sample], run.velocity[sample] = seen, velocity
            run.control_signal[sample] = signal
        torque = robot.joint_torque(signal)
        for _ in range(leading.substeps):
            last, velocity = velocity, dynamics.step(position, velocity, last, torque)
            position = position + h * velocity
        if part == leading.per_sample - 1:
            check_stable(velocity, RUNAWAY * robot.velocity_limits, float(recording.time[sample]))
    return run


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
