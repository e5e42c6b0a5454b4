"""Compiled motion of an arm with anything that the usual model does not have."""

from __future__ import annotations

import math

import numpy as np

from ident.kernels.compilation import compiled, making_arrays
from ident.kernels.controller import control, start_controller
from ident.kernels.effect_torques import (
    change_gains,
    change_strengths,
    drive_signals,
    link_motion,
    position_torques,
    seen_from_gears,
    warm_gears,
)
from ident.kernels.foot import Foot, follow, links_on_foot, without_foot
from ident.kernels.friction import BRISTLES, friction, implicit_step
from ident.kernels.readings import put, read, read_with_extras, record_with_extras, start_arm, start_extras
from ident.kernels.rigid_bodies import is_positive_definite, mass_and_bias, turn_on
from ident.kernels.values import (
    BRISTLE,
    CONSTRAINT,
    NOT_POSITIVE_DEFINITE,
    RUNS,
    UNSTABLE,
    Arm,
    Axes,
    Drives,
    Dynamics,
    Extras,
    Loop,
    Memory,
    Run,
)
from robots.arrays import FloatArray, IntArray

_TRIAL = 2
"""A row of the scratch array that is free between steps."""


@compiled
def move_with_extras(  # noqa: C901
    axes: Axes,
    coordinates: IntArray,
    dynamics: Dynamics,
    drives: Drives,
    arm: Arm,
    extras: Extras,
    foot: Foot,
    memory: Memory,
    output: FloatArray,
    h: float,
    substeps: int,
    step: int,
    time: float,
    here: int,
) -> int:
    """Move the arm through one controller sample.

    Args:
        axes, coordinates: of joints and coordinates.
        dynamics, drives, arm, extras, memory: as in ``values``; foot: of the base.
        output: (n,) control signals.
        h, substeps: integration step, s, and how many.
        step: number of the controller sample.
        time: s, of the recording.
        here: row of the scratch array, as for ``implicit_step``.

    Returns:
        the row of the scratch array; -1 where the mass matrix is not positive definite.
    """
    # Names for the arrays: reaching into a tuple in a loop costs a count of references each time.
    frames, parameters, gravity = dynamics.frames, dynamics.links, dynamics.gravity
    inertia, damping, constant = dynamics.inertia, dynamics.damping, dynamics.constant
    terms, spans, strength, laws = dynamics.terms, dynamics.spans, memory.strength, extras.laws
    q, v, turn, signal, push, bias = arm.q, arm.v, arm.turn, arm.signal, arm.push, arm.bias
    mass, implicit, check, factors = arm.mass, arm.implicit, arm.check, arm.factors
    links, work, load, last, seen = arm.links, arm.work, memory.load, memory.last, memory.seen
    link_position, link_velocity, middle = memory.link_position, memory.link_velocity, memory.middle
    gains, transmission = drives.torque, drives.transmission
    n, m, kept = len(axes), len(coordinates), seen.shape[0]
    bristles = False
    for k in range(terms.shape[0]):
        bristles = bristles or terms[k, 1] >= BRISTLE
    put(output, memory.sent, step % memory.sent.shape[0])
    for i in range(n):
        turn[i, 0], turn[i, 1] = math.cos(q[i]), math.sin(q[i])
    for substep in range(substeps):
        for i in range(m):
            middle[i] = v[i] + 0.5 * (v[i] - last[i])
        link_motion(axes, extras, memory, q, middle, turn)
        mass_and_bias(
            axes,
            frames,
            parameters,
            gravity,
            link_position,
            turn,
            link_velocity,
            mass,
            bias,
            links,
        )
        if len(foot.axes) > 0:
            links_on_foot(foot, gravity, link_position, link_velocity, turn, mass, bias)
        if extras.errors.shape[0] > 0:
            seen_from_gears(axes, memory, mass, bias)
        for i in range(n):
            load[i] = bias[i]
            for j in range(n):
                load[i] += mass[i, j] * (v[j] - last[j]) / h
        for i in range(m):
            for j in range(m):
                if i >= n or j >= n:
                    mass[i, j] = 0.0
                check[i, j] = mass[i, j] + inertia[i, j]
        if substep == 0 and not is_positive_definite(coordinates, check, factors):
            return -1
        drive_signals(axes, extras, memory, step, substep * h, h, signal)
        change_gains(coordinates, extras, q, signal)
        for i in range(m):
            force = -constant[i] - bias[i]
            for j in range(n):
                force += gains[i, j] * signal[j]
            for j in range(m):
                force -= damping[i, j] * v[j]
                mass[i, j] += implicit[i, j]
            push[i] = h * force
            last[i] = v[i]
        if len(foot.axes) > 0:
            without_foot(foot, mass, push, n, h)
        position_torques(coordinates, extras, time, q, h, arm)
        change_strengths(axes, coordinates, extras, memory, terms, time, q, v)
        warm_gears(coordinates, terms, extras, memory, v)
        if bristles:
            for i in range(m):
                work[_TRIAL, i] = v[i]
            friction(terms, spans, laws, work, _TRIAL, here)
        here = implicit_step(
            coordinates,
            terms,
            spans,
            strength,
            dynamics.shares,
            laws,
            mass,
            push,
            v,
            h,
            check,
            work,
            here,
        )
        if bristles:
            for k in range(terms.shape[0]):
                if terms[k, 1] == CONSTRAINT:
                    work[BRISTLES, k] = (-1.0 - terms[k, 3]) * work[here, k]
                elif terms[k, 1] >= BRISTLE:
                    work[BRISTLES, k] = work[here + 1, k]
        if len(foot.axes) > 0:
            follow(foot, v, last, n, h)
        turn_on(axes, q, turn, v, h)
        for i in range(n, m):
            q[i] += h * v[i]
        if extras.reading.shape[0] > 0:
            count = step * substeps + substep + 1
            for i in range(n):
                seen[count % kept, i] = 0.0
                for j in range(m):
                    seen[count % kept, i] += transmission[i, j] * q[j]
    return here


@making_arrays
def closed_loop_with_extras(
    axes: Axes,
    coordinates: IntArray,
    dynamics: Dynamics,
    drives: Drives,
    run: Run,
    substeps: int,
    extras: Extras,
    foot: Foot,
) -> tuple[int, int]:
    """Run one simulation of any model, as ``loop.closed_loop``.

    Args:
        axes: of the joints.
        coordinates: (m,) of the coordinates; an array, so that one machine code serves any number of them.
        dynamics, drives, run, extras: as in ``values``; foot: of the base.
        substeps: integration steps per controller sample.

    Returns:
        as ``loop.closed_loop``.
    """
    n, m = len(axes), len(coordinates)
    h = drives.sample_time / substeps
    arm = start_arm(axes, m, dynamics, run, h)
    loop = Loop(np.empty((drives.reach, n)), np.empty(n), np.zeros(n), np.empty((drives.delay + 1, n)))
    output, measured, rate = np.empty(n), np.empty(n), np.empty(n)
    read(coordinates, drives, arm.q, measured)
    read(coordinates, drives, arm.v, rate)
    start_controller(axes, drives, run, loop, measured, rate)
    memory = start_extras(axes, dynamics, run, extras, measured, rate, h)
    for i in range(m):
        arm.work[0, i] = arm.v[i]
        arm.q[i] += 0.5 * h * arm.v[i]
    return _through(
        axes,
        coordinates,
        dynamics,
        drives,
        run,
        substeps,
        extras,
        foot,
        arm,
        loop,
        memory,
        output,
        measured,
        rate,
    )


@compiled
def _through(
    axes: Axes,
    coordinates: IntArray,
    dynamics: Dynamics,
    drives: Drives,
    run: Run,
    substeps: int,
    extras: Extras,
    foot: Foot,
    arm: Arm,
    loop: Loop,
    memory: Memory,
    output: FloatArray,
    measured: FloatArray,
    rate: FloatArray,
) -> tuple[int, int]:
    """All samples of a run."""
    m, samples = len(coordinates), run.position.shape[0]
    per_sample = run.reference.shape[0] // samples
    h = drives.sample_time / substeps
    here, step = int(np.int64(4)), int(np.int64(0))  # as in ``closed_loop``
    friction(dynamics.terms, dynamics.spans, extras.laws, arm.work, 0, here)
    for sample in range(samples):
        for part in range(per_sample):
            read_with_extras(coordinates, drives, extras, memory, arm, step * substeps, h, measured)
            if part == 0:
                record_with_extras(
                    coordinates,
                    drives,
                    extras,
                    memory,
                    run,
                    arm.v,
                    sample,
                    step * substeps,
                    h,
                    measured,
                    rate,
                )
            control(axes, drives, run, loop, measured, step, output)
            if part == 0:
                put(output, run.control_signal, sample)
            here = move_with_extras(
                axes,
                coordinates,
                dynamics,
                drives,
                arm,
                extras,
                foot,
                memory,
                output,
                h,
                substeps,
                step,
                extras.time[sample],
                here,
            )
            if here < 0:
                put(arm.q, run.start, 0)
                put(arm.v, run.start, 1)
                return NOT_POSITIVE_DEFINITE, sample
            step += 1
        for i in range(m):
            if not abs(arm.v[i]) <= run.speed_limit[i]:
                put(arm.q, run.start, 0)
                put(arm.v, run.start, 1)
                return UNSTABLE, sample
    return RUNS, samples
