"""The compiled closed loop of the usual model: drives that move rigidly with the joints, nothing extra."""

from __future__ import annotations

import math

import numpy as np

from ident.kernels.compilation import compiled, making_arrays
from ident.kernels.controller import control, start_controller
from ident.kernels.friction import friction, implicit_step
from ident.kernels.readings import put, start_arm
from ident.kernels.rigid_bodies import is_positive_definite, mass_and_bias, turn_on
from ident.kernels.values import NOT_POSITIVE_DEFINITE, RUNS, UNSTABLE, Arm, Axes, Drives, Dynamics, Loop, Run
from robots.arrays import FloatArray


@making_arrays
def closed_loop(axes: Axes, dynamics: Dynamics, drives: Drives, run: Run, substeps: int) -> tuple[int, int]:
    """Run one simulation; ``run``'s arrays are filled.

    Velocities are of the instants between steps, positions of the middles of steps (leapfrog): a torque that
    is held over a step then moves the arm exactly, and loads are those of the middle. What the encoders read
    at an instant is half a step of the velocity there before the middle.

    Args:
        axes: of the joints.
        dynamics, drives, run: as in ``values``, with the joints as coordinates.
        substeps: integration steps per controller sample.

    Returns:
        RUNS, or NOT_POSITIVE_DEFINITE or UNSTABLE with the sample in which it happened; ``run.start`` then
        holds positions and velocities there.
    """
    n = len(axes)
    arm = start_arm(axes, n, dynamics, run, drives.sample_time / substeps)
    loop = Loop(np.empty((drives.reach, n)), np.empty(n), np.zeros(n), np.empty((drives.delay + 1, n)))
    output, measured, rate = np.empty(n), np.empty(n), np.empty(n)
    last, middle = run.start[1].copy(), np.empty(n)
    return _through(axes, dynamics, drives, run, substeps, arm, loop, output, measured, rate, last, middle)


@compiled
def _through(  # noqa: C901
    axes: Axes,
    dynamics: Dynamics,
    drives: Drives,
    run: Run,
    substeps: int,
    arm: Arm,
    loop: Loop,
    output: FloatArray,
    measured: FloatArray,
    rate: FloatArray,
    last: FloatArray,
    middle: FloatArray,
) -> tuple[int, int]:
    """All samples of a run."""
    n, samples = len(axes), run.position.shape[0]
    per_sample = run.reference.shape[0] // samples
    h = drives.sample_time / substeps
    q, v, turn, torque, push, bias = arm.q, arm.v, arm.turn, arm.signal, arm.push, arm.bias
    mass, check, work = arm.mass, arm.check, arm.work
    for i in range(n):
        work[0, i] = v[i]
        measured[i], rate[i] = 0.0, 0.0
        for j in range(n):
            measured[i] += drives.transmission[i, j] * q[j]
            rate[i] += drives.transmission[i, j] * v[j]
    start_controller(axes, drives, run, loop, measured, rate)
    for i in range(n):
        q[i] += 0.5 * h * v[i]
    # Not of the literals' own types: the compiler would make everything called with them twice.
    here, step = int(np.int64(4)), int(np.int64(0))
    friction(dynamics.terms, dynamics.spans, None, work, 0, here)
    for sample in range(samples):
        for i in range(n):
            run.position[sample, i], run.velocity[sample, i] = q[i] - 0.5 * h * v[i], v[i]
        for part in range(per_sample):
            for i in range(n):
                turn[i, 0], turn[i, 1] = math.cos(q[i]), math.sin(q[i])
                position = 0.0
                for j in range(n):
                    position += drives.transmission[i, j] * (q[j] - 0.5 * h * v[j])
                measured[i] = position
            control(axes, drives, run, loop, measured, step, output)
            step += 1
            if part == 0:
                put(output, run.control_signal, sample)
            for i in range(n):
                torque[i] = -dynamics.constant[i]
                for j in range(n):
                    torque[i] += drives.torque[i, j] * output[j]
            for substep in range(substeps):
                for i in range(n):
                    middle[i], last[i] = v[i] + 0.5 * (v[i] - last[i]), v[i]
                mass_and_bias(
                    axes,
                    dynamics.frames,
                    dynamics.links,
                    dynamics.gravity,
                    q,
                    turn,
                    middle,
                    mass,
                    bias,
                    arm.links,
                )
                if substep == 0:
                    for i in range(n):
                        for j in range(n):
                            check[i, j] = mass[i, j] + dynamics.inertia[i, j]
                    if not is_positive_definite(axes, check, arm.factors):
                        put(q, run.start, 0)
                        put(v, run.start, 1)
                        return NOT_POSITIVE_DEFINITE, sample
                for i in range(n):
                    force = torque[i] - bias[i]
                    for j in range(n):
                        force -= dynamics.damping[i, j] * v[j]
                        mass[i, j] += arm.implicit[i, j]
                    push[i] = h * force
                here = implicit_step(
                    axes,
                    dynamics.terms,
                    dynamics.spans,
                    dynamics.strength,
                    dynamics.shares,
                    None,
                    mass,
                    push,
                    v,
                    h,
                    check,
                    work,
                    here,
                )
                turn_on(axes, q, turn, v, h)
        for i in range(n):
            if not abs(v[i]) <= run.speed_limit[i]:
                put(q, run.start, 0)
                put(v, run.start, 1)
                return UNSTABLE, sample
    return RUNS, samples
