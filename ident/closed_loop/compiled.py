"""From the model and the recording to the arrays of the compiled closed loop, and back."""

from __future__ import annotations

import math

import numpy as np

from ident.closed_loop import kernel
from ident.closed_loop.direct_dynamics import check_mass_matrix
from ident.closed_loop.simulate import RUNAWAY, Leading, SimulatedRun, check_stable
from ident.closed_loop.torque_parts import TorqueParts
from ident.errors import IdentificationError
from robots.arrays import FloatArray, IntArray
from robots.description import Robot


def run_compiled(
    frames: FloatArray, gravity: FloatArray, leading: Leading, parts: TorqueParts
) -> SimulatedRun:
    """One run of a serial chain (``frames`` as of ``chain_frames``) whose friction is speed terms.

    Raises:
        IdentificationError: the mass matrix is not positive definite, or the loop is unstable.
    """
    robot, recording = leading.robot, leading.recording
    position, velocity, signal = (np.empty(recording.position.shape) for _ in range(3))
    position[0], signal[0] = recording.position[0], recording.control_signal[0]
    run = kernel.Run(
        reference=leading.points,
        feed_forward=leading.speeds * np.array(robot.controller.velocity_feed_forward),
        position=position,
        velocity=velocity,
        control_signal=signal,
        speed_limit=RUNAWAY * robot.velocity_limits,
    )
    dynamics = kernel.Dynamics(
        frames=frames,
        links=parts.links,
        gravity=np.array(gravity, dtype=np.float64),
        inertia=parts.inertia,
        damping=parts.damping,
        constant=parts.constant,
        terms=parts.terms,
        spans=_spans(parts.terms, robot.n),
    )
    ending, sample = kernel.closed_loop(
        tuple(range(robot.n)), dynamics, _drives(robot), run, leading.substeps
    )
    if ending != kernel.RUNS:
        check_stable(velocity[sample], run.speed_limit, float(recording.time[sample]))
        check_mass_matrix(mass_matrix(dynamics, position[sample]), position[sample])
        raise IdentificationError(f"the simulation fails at {recording.time[sample]:.3f} s")
    return SimulatedRun(recording.time, position, velocity, signal)


def mass_matrix(dynamics: kernel.Dynamics, position: FloatArray) -> FloatArray:
    """M(q) with the drives' inertia, (n, n)."""
    n = position.shape[0]
    mass, bias, work = np.empty((n, n)), np.empty(n), np.empty((n, 22))
    turn = np.column_stack([np.cos(position), np.sin(position)])
    kernel.mass_and_bias(
        tuple(range(n)),
        dynamics.frames,
        dynamics.links,
        dynamics.gravity,
        position,
        turn,
        np.zeros(n),
        mass,
        bias,
        work,
    )
    return np.asarray(mass + dynamics.inertia)


def _spans(terms: FloatArray, n: int) -> IntArray:
    """Begin and end of what is not zero in the speed row and the torque row of each term, (K, 4)."""
    spans = np.zeros((terms.shape[0], 4), dtype=np.int64)
    for span, term in zip(spans, terms, strict=True):
        for column, row in ((0, term[3 : 3 + n]), (2, term[3 + n :])):
            filled = np.flatnonzero(row)
            if filled.size:
                span[column : column + 2] = filled[0], filled[-1] + 1
    return spans


def _drives(robot: Robot) -> kernel.Drives:
    controller = robot.controller
    cutoff = controller.velocity_cutoff_hz
    return kernel.Drives(
        cascade=controller.type == "cascade_p_pi",
        sample_time=controller.sample_time,
        position_gain=np.array(controller.position_gain),
        velocity_gain=np.array(controller.velocity_gain),
        integral_gain=np.array(controller.integral_gain),
        limit=np.array(controller.saturation),
        reach=controller.velocity_difference_samples,
        smoothing=1.0 if cutoff is None else 1.0 - math.exp(-2 * math.pi * cutoff * controller.sample_time),
        delay=controller.delay_samples,
        transmission=robot.transmission_matrix,
        torque=np.ascontiguousarray(robot.transmission_matrix.T * robot.gains),
    )
