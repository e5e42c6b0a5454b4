"""The start of a compiled motion with effects, and what its encoders and its record read."""

from __future__ import annotations

import numpy as np

from ident.kernels.compilation import compiled, making_arrays
from ident.kernels.effect_torques import look_up
from ident.kernels.friction import WORK_ROWS
from ident.kernels.values import (
    Arm,
    Axes,
    Drives,
    Dynamics,
    Extras,
    Memory,
    Run,
)
from robots.arrays import FloatArray, IntArray


@compiled
def put(values: FloatArray, table: FloatArray, row: int) -> None:
    """Write values into a row of a table."""
    for i in range(values.shape[0]):
        table[row, i] = values[i]


@compiled
def read(coordinates: IntArray, drives: Drives, q: FloatArray, measured: FloatArray) -> None:
    """Drive outputs (n,), or their velocities, of coordinates (m,), or theirs; written to ``measured``."""
    for i in range(measured.shape[0]):
        measured[i] = 0.0
        for j in range(len(coordinates)):
            measured[i] += drives.transmission[i, j] * q[j]


@making_arrays
def start_arm(axes: Axes, m: int, dynamics: Dynamics, run: Run, h: float) -> Arm:
    """The arm with m coordinates where a run begins, and room for what follows from them; steps of h s."""
    n = len(axes)
    return Arm(
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


@making_arrays
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
        followed=np.full(extras.changing.shape[0], np.nan),
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
    for k in range(extras.misread.shape[0]):
        i = int(extras.misread[k, 0])
        measured[i] += look_up(extras.values, extras.tables, int(extras.misread[k, 1]), measured[i])[0]


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
    for k in range(extras.misread.shape[0]):
        i = int(extras.misread[k, 0])
        rate[i] *= 1.0 + look_up(extras.values, extras.tables, int(extras.misread[k, 1]), measured[i])[1]
    for i in range(n):
        run.position[sample, i], run.velocity[sample, i] = 0.0, 0.0
        for j in range(n):
            run.position[sample, i] += back[i, j] * measured[j]
            run.velocity[sample, i] += back[i, j] * rate[j]
