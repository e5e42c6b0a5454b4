"""What goes into the compiled closed loop and comes out of it, as plain arrays.

n are the joints, m ≥ n the coordinates: the joints, then one output angle for each drive that does not
move rigidly with them. ``ident.closed_loop.compiled`` makes these values from the model and the recording.
"""

from __future__ import annotations

from typing import NamedTuple

from robots.arrays import FloatArray, IntArray

RUNS, NOT_POSITIVE_DEFINITE, UNSTABLE = 0, 1, 2
"""What the closed loop ends with."""

TANH, LINEAR, TABULATED, BRISTLE, SLIP, CONSTRAINT = 0, 1, 2, 3, 4, 5
"""Laws of a speed term; from ``BRISTLE`` on they have a past."""

TERM_HEAD = 4
"""Columns of a speed term before its speed row."""

LAW_CELLS = 2048
"""Cells of a tabulated law on either side of zero speed."""

CHANGING_HEAD = 10
"""Columns of ``Extras.changing`` before its rows."""

LOAD_BOTH, LOAD_DRIVING, LOAD_DRIVEN, LOAD_SQUARE, LOAD_SIGNED, LOAD_SIGNED_SQUARE = 1, 2, 3, 4, 5, 6
LOAD_SIDES = {
    "both": LOAD_BOTH,
    "driving": LOAD_DRIVING,
    "driven": LOAD_DRIVEN,
    "square": LOAD_SQUARE,
    "signed": LOAD_SIGNED,
    "signed square": LOAD_SIGNED_SQUARE,
}
"""When the strength of a speed term follows a load: always, while load · speed ≥ 0, while it is below; or
always, and by its square; or with its sign."""

Axes = tuple[int, ...]
"""(0, 1, … n − 1): the compiler knows the length of a tuple, so it can unroll what goes over the axes."""


class Dynamics(NamedTuple):
    """M(q) q̈ + N(q, q̇) of links and drives."""

    frames: FloatArray
    """(n, 37), as for ``mass_and_bias``."""
    links: FloatArray
    """(n, 10)."""
    gravity: FloatArray
    """(3,)."""
    inertia: FloatArray
    """(m, m), of the drives."""
    damping: FloatArray
    """(m, m)."""
    constant: FloatArray
    """(m,) torque."""
    terms: FloatArray
    """(K, 4 + 2m) speed terms: 1/width, law, direction, number of a tabulated law, speed row, torque row.

    In place of that number a ``CONSTRAINT`` has −1 less the share of x that it goes on with.
    """
    spans: IntArray
    """(K, 4) begin and end of what is not zero in speed row and torque row."""
    strength: FloatArray
    """(K,) factors of the terms; taken implicitly where they are not negative."""
    shares: FloatArray
    """(K,) how much of each term a step takes at its new velocity."""


class Drives(NamedTuple):
    """The sampled control law (``ident.closed_loop.control_law``); gains (n,) per drive."""

    cascade: bool
    sample_time: float
    position_gain: FloatArray
    velocity_gain: FloatArray
    integral_gain: FloatArray
    limit: FloatArray
    reach: int
    smoothing: float
    delay: int
    transmission: FloatArray
    """(n, m) drive outputs from coordinates."""
    torque: FloatArray
    """(m, n) torque on the coordinates per control signal."""


class Arm(NamedTuple):
    """The moving arm: coordinates, velocities, and room for what follows from them; written."""

    q: FloatArray
    """(m,) in the middle of the coming step."""
    v: FloatArray
    """(m,) before it."""
    turn: FloatArray
    """(n, 2) cosine and sine of the joints."""
    signal: FloatArray
    """(n,) control signals that become torque."""
    push: FloatArray
    """(m,) torque times step."""
    bias: FloatArray
    """(m,)."""
    mass: FloatArray
    """(m, m)."""
    implicit: FloatArray
    """(m, m) inertia and half a step times damping of the drives."""
    check: FloatArray
    """(m, m)."""
    factors: FloatArray
    """(m, m)."""
    links: FloatArray
    """(n, 22)."""
    work: FloatArray
    """As for ``implicit_step``."""


class Loop(NamedTuple):
    """The memory of the control law; written."""

    past: FloatArray
    """(reach, n) earlier drive positions."""
    filtered: FloatArray
    """(n,) velocity."""
    integral: FloatArray
    """(n,)."""
    coming: FloatArray
    """(delay + 1, n) outputs on their way."""


class Run(NamedTuple):
    """What one run starts from and is led by, and where its samples go."""

    reference: FloatArray
    """(steps, n) set-points at the drive outputs, one per controller sample."""
    speed: FloatArray
    """(steps, n) their velocities times the feed-forward gains."""
    added: FloatArray
    """(steps, n) control signal that is fed forward; or (0, n) where none is."""
    start: FloatArray
    """(2, m) coordinates and their velocities at the start."""
    position: FloatArray
    """(samples, n), written."""
    velocity: FloatArray
    """(samples, n), written."""
    control_signal: FloatArray
    """(samples, n), row 0 is what the drives put out at the start; then written whole."""
    speed_limit: FloatArray
    """(m,) a coordinate beyond this says that the loop is unstable."""


class Extras(NamedTuple):
    """What only some models have.

    Tables are evenly spaced; ``-1`` in the place of a table's number means none.
    """

    values: FloatArray
    """The values of all tables, one after the other."""
    tables: FloatArray
    """(T, 4) first value, number of values, lower end, 1/spacing."""
    laws: FloatArray
    """(L, 2 · LAW_CELLS + 1) tabulated laws of speed."""
    curves: FloatArray
    """(C, 2 + 2m) torque over a position: table, table over time, position row, torque row."""
    changing: FloatArray
    """(G, 10 + n + 2m) terms whose strength changes: term, its constant strength, tables over a position,
    over time and over the term's speed, one of ``LOAD_SIDES`` where the strength follows the load, table over
    another speed, constant load, share of a change of load that is followed in a step, share of friction in
    the load; load row (of link torques), position row and row of that speed."""
    warming: FloatArray
    """(W, 5) those that follow the warmth of a gear: term, share of the warmth that a step leaves, dry
    and viscous friction that heat, warmth at the start, W."""
    errors: FloatArray
    """(E, 1 + 2n) kinematic errors of gears: table over drive output, row of the transmission, column of its
    inverse."""
    chain: FloatArray
    """(n, 8) from control signal to torque: what is left of a lag after a step, its mean over the step, delay
    in whole controller samples and the rest in s, limit of the control signal that becomes torque, dead zone
    on either side of zero, droop and its power."""
    gains: FloatArray
    """(G, 2 + m) gains that change over a position: drive, table of their relative error, position row."""
    reading: FloatArray
    """(n,) delay of the position reading in integration steps; or (0,) where none is delayed."""
    misread: FloatArray
    """(R, 2) encoders that are not true: drive, table of what they read too much over the drive output."""
    back: FloatArray
    """(n, n) joint positions from drive outputs."""
    time: FloatArray
    """(samples,) s, for what changes with time."""


class Memory(NamedTuple):
    """What the extras remember from step to step, and room for what they work out; written."""

    strength: FloatArray
    """(K,) of the terms, now."""
    last: FloatArray
    """(m,) velocity before the last step."""
    middle: FloatArray
    """(m,) velocity in the middle of the coming step, as the last one foretells it."""
    lagging: FloatArray
    """(n,) control signal behind the lag."""
    sent: FloatArray
    """(kept, n) control signals of the last controller samples, in a ring."""
    seen: FloatArray
    """(kept, n) drive outputs in the middles of the last integration steps, in a ring."""
    link_position: FloatArray
    """(n,)."""
    link_velocity: FloatArray
    """(n,)."""
    forces: FloatArray
    """(n,)."""
    bend: FloatArray
    """(n,) acceleration of the links by the bend of the gears' errors."""
    jacobian: FloatArray
    """(n, n) link velocity from joint velocity."""
    product: FloatArray
    """(n, n)."""
    load: FloatArray
    """(n,) link torque."""
    followed: FloatArray
    """(G,) load that each changing term follows; no number before the first step."""
    warmth: FloatArray
    """(W,) of the gears, W."""
