"""Torques of effects along a compiled motion: of gears, drive signals, tables over position, friction."""

from __future__ import annotations

import math

from ident.kernels.compilation import compiled
from ident.kernels.values import (
    CHANGING_HEAD,
    LOAD_BOTH,
    LOAD_DRIVING,
    LOAD_SIGNED,
    LOAD_SIGNED_SQUARE,
    LOAD_SQUARE,
    TERM_HEAD,
    Arm,
    Axes,
    Extras,
    Memory,
)
from robots.arrays import FloatArray, IntArray

_NEWTON_STEPS, _NEWTON_TOLERANCE = 30, 1e-12

_CURVES_HEAD = 2
"""Columns of ``Extras.curves`` before its rows."""


@compiled
def look_up(values: FloatArray, tables: FloatArray, number: int, x: float) -> tuple[float, float, float]:
    """Value, slope and second derivative: the cubic through four neighbours, a straight line outside.

    Args:
        values, tables: as in ``values.Extras``.
        number: which table; it has at least four values.
        x: where.
    """
    first, count, per_unit = int(tables[number, 0]), int(tables[number, 1]), tables[number, 3]
    t = (x - tables[number, 2]) * per_unit
    inside = min(max(t, 0.0), count - 1.0)
    cell = min(max(math.floor(inside), 1), count - 3)
    s = inside - cell
    a, b, c, d = (
        values[first + cell - 1],
        values[first + cell],
        values[first + cell + 1],
        values[first + cell + 2],
    )
    c1, c2, c3 = -a / 3 - b / 2 + c - d / 6, (a + c) / 2 - b, (d - a) / 6 + (b - c) / 2
    value = b + s * (c1 + s * (c2 + s * c3))
    slope = c1 + s * (2 * c2 + 3 * s * c3)
    if inside != t:
        return value + slope * (t - inside), slope * per_unit, 0.0
    return value, slope * per_unit, (2 * c2 + 6 * s * c3) * per_unit * per_unit


@compiled
def link_motion(
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
def seen_from_gears(axes: Axes, memory: Memory, mass: FloatArray, bias: FloatArray) -> None:
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
def drive_signals(
    axes: Axes, extras: Extras, memory: Memory, step: int, elapsed: float, h: float, signal: FloatArray
) -> None:
    """The control signals that become torque in the integration step ``elapsed`` s into a controller sample.

    Delayed (as a mean over the step where the delayed signal jumps within it), lagging, less the dead zone,
    limited, drooping; (n,).
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
        mean -= min(max(mean, -chain[i, 5]), chain[i, 5])
        signal[i] = min(max(mean, -limit), limit)
        if chain[i, 6] > 0.0:
            signal[i] = drooped(signal[i], chain[i, 6], chain[i, 7])


@compiled
def drooped(signal: float, droop: float, power: float) -> float:
    """The root y, of the signal's sign, of y + droop·|y|^power·y = signal.

    Newton's method: the left side is convex beyond zero, so from the signal down no step goes past the root.
    """
    asked = abs(signal)
    root = asked
    for _ in range(_NEWTON_STEPS):
        more = droop * root**power
        step = (root * (1.0 + more) - asked) / (1.0 + (power + 1.0) * more)
        root -= step
        if step <= _NEWTON_TOLERANCE * asked:
            break
    return math.copysign(root, signal)


@compiled
def change_gains(coordinates: IntArray, extras: Extras, q: FloatArray, signal: FloatArray) -> None:
    """Scale the control signals (n,) of drives whose gain changes over a position."""
    gains, m = extras.gains, len(coordinates)
    for k in range(gains.shape[0]):
        x = 0.0
        for j in range(m):
            x += gains[k, 2 + j] * q[j]
        signal[int(gains[k, 0])] *= 1.0 + look_up(extras.values, extras.tables, int(gains[k, 1]), x)[0]


@compiled
def position_torques(
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
def of_load(load: float, speed: float, side: float, share: float) -> float:
    """The size of a load where a term with this speed follows it: see ``LOAD_SIDES``.

    With a share r of friction in the load that is |load| / (1 − r) while the speed drives the load, and
    |load| / (1 + r) while it is driven by it.
    """
    if side == LOAD_SQUARE:
        return load * load
    if side == LOAD_SIGNED:
        return load
    if side == LOAD_SIGNED_SQUARE:
        return load * abs(load)
    if side != LOAD_BOTH and (load * speed >= 0.0) != (side == LOAD_DRIVING):
        return 0.0
    return abs(load) / (1.0 - share if load * speed >= 0.0 else 1.0 + share)


@compiled
def _along(coordinates: IntArray, rows: FloatArray, k: int, first: int, values: FloatArray) -> float:
    """A row of coordinates that begins at column ``first`` of row k, times their values (m,)."""
    found = 0.0
    for j in range(len(coordinates)):
        found += rows[k, first + j] * values[j]
    return found


@compiled
def change_strengths(
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
    loads, followed, strength = memory.load, memory.followed, memory.strength
    n = len(axes)
    for k in range(changing.shape[0]):
        factor = changing[k, 1]
        over_position, over_time, over_speed = (
            int(changing[k, 2]),
            int(changing[k, 3]),
            int(changing[k, 4]),
        )
        if over_position >= 0:
            x = _along(coordinates, changing, k, CHANGING_HEAD + n, q)
            factor *= look_up(values, tables, over_position, x)[0]
        if over_time >= 0:
            factor *= look_up(values, tables, over_time, time)[0]
        speed = _along(coordinates, terms, int(changing[k, 0]), TERM_HEAD, v)
        if over_speed >= 0:
            factor *= look_up(values, tables, over_speed, speed)[0]
        if changing[k, 6] >= 0.0:
            other = _along(coordinates, changing, k, CHANGING_HEAD + n + len(coordinates), v)
            factor *= look_up(values, tables, int(changing[k, 6]), other)[0]
        if changing[k, 5] != 0.0:
            load = changing[k, 7]
            for i in range(n):
                load += changing[k, CHANGING_HEAD + i] * loads[i]
            if not math.isnan(followed[k]):
                load = followed[k] + changing[k, 8] * (load - followed[k])
            followed[k] = load
            factor *= of_load(load, speed, changing[k, 5], changing[k, 9])
        strength[int(changing[k, 0])] = factor


@compiled
def warm_gears(
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
