"""Closed-loop simulation: the source of the instruments (method.md 3)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.closed_loop.control_law import ControlLaw
from ident.closed_loop.direct_dynamics import DirectDynamics
from ident.closed_loop.leading import RUNAWAY, Leading, SimulatedRun, check_stable, leading_of
from ident.closed_loop.torque_parts import ModelStructure, TorqueParts
from ident.effects.chain import chain_frames
from ident.errors import IdentificationError
from ident.parameters.regressor import RegressorModel
from ident.recording import Recording
from robots.arrays import FloatArray


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
    parts = [structure.parts(standard).carrying(recording.load) for standard in standards]
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
    law = ControlLaw(robot.controller, transmission @ position, leading.signal, transmission @ velocity)
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
    return leading.as_drives_show(run)
