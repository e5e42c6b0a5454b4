"""Compiled motion of an arm with anything that the usual model does not have."""

from __future__ import annotations

import math

import numpy as np

from ident.kernels.compilation import compiled
from ident.kernels.controller import control, start_controller
from ident.kernels.friction import BRISTLES, WORK_ROWS, friction, implicit_step
from ident.kernels.rigid_bodies import is_positive_definite, mass_and_bias, turn_on
from ident.kernels.tables import look_up
from ident.kernels.values import (
    BRISTLE,
    CHANGING_HEAD,
    LOAD_BOTH,
    LOAD_DRIVING,
    NOT_POSITIVE_DEFINITE,
    RUNS,
    TERM_HEAD,
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

_CURVES_HEAD = 2
"""Columns of ``Extras.curves`` before its rows."""

_TRIAL = 2
"""A row of the scratch array that is free between steps."""


@compiled
def read(coordinates: IntArray, drives: Drives, q: FloatArray, measured: FloatArray) -> None:
    """Drive outputs (n,), or their velocities, of coordinates (m,), or theirs; written to ``measured``."""
    for i in range(measured.shape[0]):
        measured[i] = 0.0
        for j in range(len(coordinates)):
            measured[i] += drives.transmission[i, j] * q[j]


@compiled
def start_extras(
    axes: Axes,
    dynamics: Dynamics,
    run: Run,
    extras: Extras,
    measured: FloatArray,
    rate: FloatArray,
    h: float,
) -> Memory:
    """Memory at the start: everything as if the arm had moved at constant speed so far.

    Args:
        axes: of the joints.
        dynamics, run, extras: as in ``values``.
        measured, rate: (n,) drive outputs and their velocities.
        h: integration step, s.
    """
    n = len(axes)
    longest = 0.0
    for i in range(extras.reading.shape[0]):
        longest = max(longest, extras.reading[i])
    kept = int(longest) + 3
    seen = np.empty((kept, n))
    for k in range(kept):
        for i in range(n):
            seen[(-k) % kept, i] = measured[i] + (0.5 - k) * h * rate[i]
    sends = 2
    for i in range(n):
        sends = max(sends, int(extras.chain[i, 2]) + 2)
    sent = np.empty((sends, n))
    for k in range(sends):
        sent[k] = run.control_signal[0]
    return Memory(
        strength=dynamics.strength.copy(),
        last=run.start[1].copy(),
        middle=run.start[1].copy(),
        lagging=run.control_signal[0].copy(),
        sent=sent,
        seen=seen,
        link_position=np.zeros(n),
        link_velocity=np.zeros(n),
        forces=np.zeros(n),
        bend=np.zeros(n),
        jacobian=np.zeros((n, n)),
        product=np.zeros((n, n)),
        load=np.zeros(n),
        warmth=extras.warming[:, 4].copy(),
    )


@compiled
def read_with_extras(
    coordinates: IntArray,
    drives: Drives,
    extras: Extras,
    memory: Memory,
    arm: Arm,
    count: int,
    h: float,
    measured: FloatArray,
) -> None:
    """What the encoders say of the drive outputs, (n,), after ``count`` integration steps of h s."""
    for i in range(measured.shape[0]):
        measured[i] = 0.0
        for j in range(len(coordinates)):
            measured[i] += drives.transmission[i, j] * (arm.q[j] - 0.5 * h * arm.v[j])
    kept = memory.seen.shape[0]
    for i in range(extras.reading.shape[0]):
        late = extras.reading[i] + 0.5
        whole = int(late)
        newer, older = memory.seen[(count - whole) % kept, i], memory.seen[(count - whole - 1) % kept, i]
        measured[i] = newer + (late - whole) * (older - newer)


@compiled
def record_with_extras(
    coordinates: IntArray,
    drives: Drives,
    extras: Extras,
    memory: Memory,
    run: Run,
    v: FloatArray,
    sample: int,
    count: int,
    h: float,
    measured: FloatArray,
    rate: FloatArray,
) -> None:
    """Put joint positions and velocities as the encoders say into the run, after ``count`` steps of h s."""
    read(coordinates, drives, v, rate)
    n, kept, back = measured.shape[0], memory.seen.shape[0], extras.back
    for i in range(extras.reading.shape[0]):
        if extras.reading[i] > 0.0:
            first = count - int(extras.reading[i])
            rate[i] = (memory.seen[first % kept, i] - memory.seen[(first - 1) % kept, i]) / h
    for i in range(n):
        run.position[sample, i], run.velocity[sample, i] = 0.0, 0.0
        for j in range(n):
            run.position[sample, i] += back[i, j] * measured[j]
            run.velocity[sample, i] += back[i, j] * rate[j]


@compiled
def _link_motion(
    axes: Axes, extras: Extras, memory: Memory, q: FloatArray, v: FloatArray, turn: FloatArray
) -> None:
    """Where the links are, given where the gears' inputs are: kinematic errors are added.

    With drive output u = t·q a gear's error e(u) moves the joints by c e(u): q_link = q + c e, so
    q̇_link = (1 + c e′ tᵀ) q̇, and q̈_link has c e″ u̇² besides.
    """
    position, velocity, bending = memory.link_position, memory.link_velocity, memory.bend
    errors, jacobian = extras.errors, memory.jacobian
    n = len(axes)
    for i in range(n):
        position[i], velocity[i] = q[i], v[i]
    count = errors.shape[0]
    if count == 0:
        return
    for i in range(n):
        bending[i] = 0.0
        for j in range(n):
            jacobian[i, j] = 1.0 if i == j else 0.0
    for k in range(count):
        output, rate = 0.0, 0.0
        for j in range(n):
            output += errors[k, 1 + j] * q[j]
            rate += errors[k, 1 + j] * v[j]
        error, slope, bend = look_up(extras.values, extras.tables, int(errors[k, 0]), output)
        for i in range(n):
            share = errors[k, 1 + n + i]
            position[i] += share * error
            velocity[i] += share * slope * rate
            bending[i] += share * bend * rate * rate
            for j in range(n):
                jacobian[i, j] += share * slope * errors[k, 1 + j]
    for i in range(n):
        turn[i, 0], turn[i, 1] = math.cos(position[i]), math.sin(position[i])


@compiled
def _seen_from_gears(axes: Axes, memory: Memory, mass: FloatArray, bias: FloatArray) -> None:
    """Mass matrix and bias of the links as the inputs of the gears see them: Jᵀ M J and Jᵀ (N + M J̇ q̇)."""
    bend, forces = memory.bend, memory.forces
    n = len(axes)
    jacobian, product = memory.jacobian, memory.product
    for i in range(n):
        force = bias[i]
        for j in range(n):
            force += mass[i, j] * bend[j]
            product[i, j] = 0.0
            for k in range(n):
                product[i, j] += mass[i, k] * jacobian[k, j]
        forces[i] = force
    for i in range(n):
        bias[i] = 0.0
        for k in range(n):
            bias[i] += jacobian[k, i] * forces[k]
        for j in range(n):
            mass[i, j] = 0.0
            for k in range(n):
                mass[i, j] += jacobian[k, i] * product[k, j]


@compiled
def _drive_signals(
    axes: Axes, extras: Extras, memory: Memory, step: int, elapsed: float, h: float, signal: FloatArray
) -> None:
    """The control signals that become torque in the integration step ``elapsed`` s into a controller sample.

    Delayed (as a mean over the step where the delayed signal jumps within it), lagging, limited; (n,).
    """
    sent, lagging, chain = memory.sent, memory.lagging, extras.chain
    kept = sent.shape[0]
    for i in range(len(axes)):
        whole, rest = int(chain[i, 2]), chain[i, 3]
        older = min(max((rest - elapsed) / h, 0.0), 1.0)
        now, before = sent[(step - whole) % kept, i], sent[(step - whole - 1) % kept, i]
        wanted = now + older * (before - now)
        behind = lagging[i] - wanted
        lagging[i] = wanted + behind * chain[i, 0]
        mean, limit = wanted + behind * chain[i, 1], chain[i, 4]
        signal[i] = min(max(mean, -limit), limit)


@compiled
def _change_gains(coordinates: IntArray, extras: Extras, q: FloatArray, signal: FloatArray) -> None:
    """Scale the control signals (n,) of drives whose gain changes over a position."""
    gains, m = extras.gains, len(coordinates)
    for k in range(gains.shape[0]):
        x = 0.0
        for j in range(m):
            x += gains[k, 2 + j] * q[j]
        signal[int(gains[k, 0])] *= 1.0 + look_up(extras.values, extras.tables, int(gains[k, 1]), x)[0]


@compiled
def _position_torques(
    coordinates: IntArray, extras: Extras, time: float, q: FloatArray, h: float, arm: Arm
) -> None:
    """Subtract torques over positions from the push, and add their stiffness to the implicit matrix.

    A quarter of h² times the stiffness there makes the step the trapezoidal rule (Newmark with β = 1/4),
    stable at any stiffness and without damping of its own.
    """
    curves, values, tables, push, mass = extras.curves, extras.values, extras.tables, arm.push, arm.mass
    m = len(coordinates)
    for k in range(curves.shape[0]):
        x = 0.0
        for j in range(m):
            x += curves[k, _CURVES_HEAD + j] * q[j]
        value, slope, _ = look_up(values, tables, int(curves[k, 0]), x)
        course = int(curves[k, 1])
        if course >= 0:
            factor = look_up(values, tables, course, time)[0]
            value, slope = value * factor, slope * factor
        along = 0.0
        for i in range(m):
            share = curves[k, _CURVES_HEAD + m + i]
            push[i] -= h * share * value
            along += share * curves[k, _CURVES_HEAD + i]
        if slope * along > 0.0:
            for i in range(m):
                stiffness = 0.25 * h * h * slope * curves[k, _CURVES_HEAD + m + i]
                if stiffness != 0.0:
                    for j in range(m):
                        mass[i, j] += stiffness * curves[k, _CURVES_HEAD + j]


@compiled
def _of_load(load: float, speed: float, side: float) -> float:
    """The size of a load where a term with this speed follows it: see ``LOAD_SIDES``."""
    if side != LOAD_BOTH and (load * speed >= 0.0) != (side == LOAD_DRIVING):
        return 0.0
    return abs(load)


@compiled
def _change_strengths(
    axes: Axes,
    coordinates: IntArray,
    extras: Extras,
    memory: Memory,
    terms: FloatArray,
    time: float,
    q: FloatArray,
    v: FloatArray,
) -> None:
    """The strength of friction that depends on position, time, speed (that before the step) or load."""
    changing, values, tables = extras.changing, extras.values, extras.tables
    loads, strength = memory.load, memory.strength
    n = len(axes)
    for k in range(changing.shape[0]):
        factor = changing[k, 1]
        over_position, over_time, over_speed = (
            int(changing[k, 2]),
            int(changing[k, 3]),
            int(changing[k, 4]),
        )
        if over_position >= 0:
            x = 0.0
            for j in range(len(coordinates)):
                x += changing[k, CHANGING_HEAD + n + j] * q[j]
            factor *= look_up(values, tables, over_position, x)[0]
        if over_time >= 0:
            factor *= look_up(values, tables, over_time, time)[0]
        speed = 0.0
        for j in range(len(coordinates)):
            speed += terms[int(changing[k, 0]), TERM_HEAD + j] * v[j]
        if over_speed >= 0:
            factor *= look_up(values, tables, over_speed, speed)[0]
        if changing[k, 5] != 0.0:
            load = 0.0
            for i in range(n):
                load += changing[k, CHANGING_HEAD + i] * loads[i]
            factor *= _of_load(load, speed, changing[k, 5])
        strength[int(changing[k, 0])] = factor


@compiled
def _warm_gears(
    coordinates: IntArray, terms: FloatArray, extras: Extras, memory: Memory, v: FloatArray
) -> None:
    """Friction in gears that it warms: its strength now, and what its heat makes of the warmth in a step."""
    warming, warmth, strength = extras.warming, memory.warmth, memory.strength
    for k in range(warming.shape[0]):
        term, speed = int(warming[k, 0]), 0.0
        for j in range(len(coordinates)):
            speed += terms[term, TERM_HEAD + j] * v[j]
        strength[term] *= warmth[k]
        heat = (warming[k, 2] + warming[k, 3] * abs(speed)) * abs(speed)
        warmth[k] = heat + (warmth[k] - heat) * warming[k, 1]


@compiled
def move_with_extras(  # noqa: C901
    axes: Axes,
    coordinates: IntArray,
    dynamics: Dynamics,
    drives: Drives,
    arm: Arm,
    extras: Extras,
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
        dynamics, drives, arm, extras, memory: as in ``values``.
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
    memory.sent[step % memory.sent.shape[0]] = output
    for i in range(n):
        turn[i, 0], turn[i, 1] = math.cos(q[i]), math.sin(q[i])
    for substep in range(substeps):
        for i in range(m):
            middle[i] = v[i] + 0.5 * (v[i] - last[i])
        _link_motion(axes, extras, memory, q, middle, turn)
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
        if extras.errors.shape[0] > 0:
            _seen_from_gears(axes, memory, mass, bias)
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
        _drive_signals(axes, extras, memory, step, substep * h, h, signal)
        _change_gains(coordinates, extras, q, signal)
        for i in range(m):
            force = -constant[i] - bias[i]
            for j in range(n):
                force += gains[i, j] * signal[j]
            for j in range(m):
                force -= damping[i, j] * v[j]
                mass[i, j] += implicit[i, j]
            push[i] = h * force
            last[i] = v[i]
        _position_torques(coordinates, extras, time, q, h, arm)
        _change_strengths(axes, coordinates, extras, memory, terms, time, q, v)
        _warm_gears(coordinates, terms, extras, memory, v)
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
                if terms[k, 1] >= BRISTLE:
                    work[BRISTLES, k] = work[here + 1, k]
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


@compiled
def closed_loop_with_extras(
    axes: Axes,
    coordinates: IntArray,
    dynamics: Dynamics,
    drives: Drives,
    run: Run,
    substeps: int,
    extras: Extras,
) -> tuple[int, int]:
    """Run one simulation of any model, as ``loop.closed_loop``.

    Args:
        axes: of the joints.
        coordinates: (m,) of the coordinates; an array, so that one machine code serves any number of them.
        dynamics, drives, run, extras: as in ``values``.
        substeps: integration steps per controller sample.

    Returns:
        as ``loop.closed_loop``.
    """
    n, m, samples = len(axes), len(coordinates), run.position.shape[0]
    per_sample = run.reference.shape[0] // samples
    h = drives.sample_time / substeps
    arm = Arm(
        q=run.start[0].copy(),
        v=run.start[1].copy(),
        turn=np.empty((n, 2)),
        signal=np.zeros(n),
        push=np.zeros(m),
        bias=np.zeros(m),
        mass=np.zeros((m, m)),
        implicit=dynamics.inertia + 0.5 * h * dynamics.damping,
        check=np.empty((m, m)),
        factors=np.empty((m, m)),
        links=np.empty((n, 22)),
        work=np.zeros((WORK_ROWS, max(m, dynamics.terms.shape[0]))),
    )
    loop = Loop(np.empty((drives.reach, n)), np.empty(n), np.zeros(n), np.empty((drives.delay + 1, n)))
    output, measured, rate = np.empty(n), np.empty(n), np.empty(n)
    read(coordinates, drives, arm.q, measured)
    read(coordinates, drives, arm.v, rate)
    start_controller(axes, drives, run, loop, measured, rate)
    memory = start_extras(axes, dynamics, run, extras, measured, rate, h)
    for i in range(m):
        arm.work[0, i] = arm.v[i]
        arm.q[i] += 0.5 * h * arm.v[i]
    here, step = 4, 0
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
                run.control_signal[sample] = output
            here = move_with_extras(
                axes,
                coordinates,
                dynamics,
                drives,
                arm,
                extras,
                memory,
                output,
                h,
                substeps,
                step,
                extras.time[sample],
                here,
            )
            if here < 0:
                run.start[0], run.start[1] = arm.q, arm.v
                return NOT_POSITIVE_DEFINITE, sample
            step += 1
        for i in range(m):
            if not abs(arm.v[i]) <= run.speed_limit[i]:
                run.start[0], run.start[1] = arm.q, arm.v
                return UNSTABLE, sample
    return RUNS, samples
