"""Links behind gears that give way, stepped by Newmark's rule with γ = ½, which damps nothing itself.

With β = 1/12 (Fox and Goodwin) an oscillation is right to the fourth order of a step that is a part of it;
with β = ¼, the trapezoidal rule, to the second, but stable at any stiffness and where a flank is met.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ident.kernels.compilation import compiled, inlined
from robots.arrays import FloatArray

_NEWTON_STEPS = 4
"""Of a spring that stiffens, from the step of its linear part, at most."""
_SETTLED = 1e-9
"""Of the acceleration: the step after one that is less would change nothing."""
_SWEEPS, _ALIKE = 60, 1e-6
"""Over links behind springs that are not straight, at most; and of the largest acceleration: after a sweep
that changed less none is needed."""

_STABLE = 1.5
"""Of (h ω)², up to which a step is a part of an oscillation: Fox and Goodwin's rule is stable to 6, and a
spring that stiffens is that much harder where it is bent."""


@inlined
def _rule(h: float, inertia: float, stiffness: float, half: float) -> float:
    """β h²."""
    return h * h * (0.25 if half > 0.0 or h * h * stiffness > _STABLE * inertia else 1.0 / 12.0)


@inlined
def _pushed(
    f: float,
    m: float,
    y: float,
    w: float,
    b: float,
    h: float,
    spring: tuple[float, float, float, float],
) -> float:
    """Acceleration at the end of a step that without it ends at y with speed w, m a = f less the spring.

    Free flight is tried first; where that ends beyond the gap, the flank's implicit step is taken instead.
    """
    stiffness, damping, half, cubic = spring
    given = b * stiffness + 0.5 * h * damping
    if half == 0.0:  # a spring that is never left
        a = (f - stiffness * y - damping * w) * (1.0 / (m + given))
        for _ in range(_NEWTON_STEPS if cubic > 0.0 else 0):
            bent = y + b * a
            force = (stiffness + cubic * bent * bent) * bent + damping * (w + 0.5 * h * a)
            hardness = stiffness + 3.0 * cubic * bent * bent
            less = (m * a + force - f) / (m + b * hardness + 0.5 * h * damping)
            a -= less
            if abs(less) <= _SETTLED * abs(a):
                break
    else:
        a, give = f / m, 1.0 / (m + given)  # neither waits for the step before
        end = y + b * a
        if end > half or end < -half:
            edge = half if end > half else -half
            pressed = (f - stiffness * (y - edge) - damping * w) * give
            if (f - m * pressed) * edge > 0.0:  # a flank never pulls
                a = pressed
    return a


@compiled
def link_behind_a_gear(
    inertia: FloatArray,
    load: FloatArray,
    by_way: FloatArray,
    by_rate: FloatArray,
    h: float,
    substeps: int,
    spring: tuple[float, float, float, float],
    start: FloatArray,
    found: FloatArray,
) -> None:
    """One link: writes its lag and its two rates at each sample.

    Args:
        inertia, load, by_way, by_rate: (samples,) m, τ, k and c of :mod:`ident.effects.gear_state`.
        h: s, of a step.
        substeps: per sample.
        spring: stiffness, damping, half the gap, and what stiffens.
        start: (3,) lag and its rates at the first sample.
        found: (3, samples), is filled.
    """
    x, v, a = start[0], start[1], start[2]
    found[0, 0], found[1, 0], found[2, 0] = x, v, a
    for k in range(1, load.shape[0]):
        for s in range(1, substeps + 1):
            ahead = s / substeps
            way = by_way[k - 1] + ahead * (by_way[k] - by_way[k - 1])
            drag = by_rate[k - 1] + ahead * (by_rate[k] - by_rate[k - 1])
            m = inertia[k - 1] + ahead * (inertia[k] - inertia[k - 1])
            b = _rule(h, m, spring[0], spring[2])
            # Position and speed at the end of the step, less what the new acceleration adds to them.
            y, w = x + h * v + (0.5 * h * h - b) * a, v + 0.5 * h * a
            f = load[k - 1] + ahead * (load[k] - load[k - 1]) - way * y - drag * w
            a = _pushed(f, m + b * way + 0.5 * h * drag, y, w, b, h, spring)
            x, v = y + b * a, w + 0.5 * h * a
        found[0, k], found[1, k], found[2, k] = x, v, a


class Swing(NamedTuple):
    """Links in motion, and room for what moves them; written."""

    x: FloatArray
    """(springs,) lag, and its two rates."""
    v: FloatArray
    a: FloatArray
    end: FloatArray
    """(springs, 4) of a step: lag and speed without an acceleration, and what one adds to each."""
    now: FloatArray
    """(springs, springs, 3) what links feel."""
    given: FloatArray
    """(springs, springs + 1) equations of the accelerations, and their right sides."""

    @classmethod
    def of(cls, start: FloatArray) -> Swing:
        """From lags and their rates (springs, 3) on."""
        count = start.shape[0]
        x, v, a = start.T.copy()
        return cls(x, v, a, np.empty((count, 4)), np.empty((count, count, 3)), np.empty((count, count + 1)))


@inlined
def _between(slopes: FloatArray, k: int, ahead: float, now: FloatArray) -> None:
    """What links feel within a step; fills ``now``."""
    for i in range(now.shape[0]):
        for j in range(now.shape[1]):
            for d in range(3):
                before = slopes[k - 1, i, j, d]
                now[i, j, d] = before + ahead * (slopes[k, i, j, d] - before)


@inlined
def _posed(now: FloatArray, end: FloatArray, springs: FloatArray, straight: int, given: FloatArray) -> None:
    """Equations of the accelerations at the end of a step, straight springs in them; fills ``given``.

    Its last column has the loads.
    """
    count = end.shape[0]
    for i in range(count):
        for j in range(count):
            given[i, j] = now[i, j, 2] + end[j, 2] * now[i, j, 0] + end[j, 3] * now[i, j, 1]
            given[i, count] -= now[i, j, 0] * end[j, 0] + now[i, j, 1] * end[j, 1]
        if i < straight:
            given[i, count] -= springs[i, 0] * end[i, 0] + springs[i, 1] * end[i, 1]
            given[i, i] += end[i, 2] * springs[i, 0] + end[i, 3] * springs[i, 1]


@inlined
def _in_turn(
    given: FloatArray, end: FloatArray, h: float, springs: FloatArray, straight: int, a: FloatArray
) -> None:
    """Accelerations behind springs that are not straight, one after the other until none changes."""
    count = a.size
    for _ in range(_SWEEPS):
        changed, largest = 0.0, 0.0
        for i in range(straight, count):
            f = given[i, count]
            for j in range(straight, count):
                if j != i:
                    f -= given[i, j] * a[j]
            spring = (springs[i, 0], springs[i, 1], springs[i, 2], springs[i, 3])
            pushed = _pushed(f, given[i, i], end[i, 0], end[i, 1], end[i, 2], h, spring)
            changed, largest = max(changed, abs(pushed - a[i])), max(largest, abs(pushed))
            a[i] = pushed
        if count - straight == 1 or changed <= _ALIKE * largest:
            break


@inlined
def _solved(
    given: FloatArray, end: FloatArray, h: float, springs: FloatArray, straight: int, a: FloatArray
) -> None:
    """All accelerations: those behind straight springs are eliminated, and follow the others."""
    count = a.size
    for i in range(straight):
        for below in range(i + 1, count):
            share = given[below, i] / given[i, i]
            for j in range(i, count + 1):
                given[below, j] -= share * given[i, j]
    if straight < count:
        _in_turn(given, end, h, springs, straight, a)
    for i in range(straight - 1, -1, -1):
        left = given[i, count]
        for j in range(i + 1, count):
            left -= given[i, j] * a[j]
        a[i] = left / given[i, i]


@compiled
def links_behind_gears(
    slopes: FloatArray,
    load: FloatArray,
    h: float,
    substeps: int,
    springs: FloatArray,
    straight: int,
    swing: Swing,
    found: FloatArray,
) -> None:
    """Links that push each other: writes the lag behind each spring and its two rates at each sample.

    Accelerations behind straight springs are eliminated; of the rest each takes those of the others until
    none changes, which mass matrices of bodies let end. Forces between links are those at a step's end.

    Args:
        slopes: (samples, springs, springs, 3) of the torque on one along the lag of another: k, c and m.
        load: (samples, springs) τ of each.
        h: s, of a step.
        substeps: per sample.
        springs: (springs, 4) stiffness, damping, half the gap, and what stiffens.
        straight: how many of them, the first, have neither of the last two.
        swing: the links at the first sample.
        found: (samples, springs, 3), is filled.
    """
    count = springs.shape[0]
    x, v, a, end, now, given = swing
    for i in range(count):
        found[0, i, 0], found[0, i, 1], found[0, i, 2] = x[i], v[i], a[i]
    for k in range(1, load.shape[0]):
        for s in range(1, substeps + 1):
            ahead = s / substeps
            _between(slopes, k, ahead, now)
            for i in range(count):
                b = _rule(h, now[i, i, 2], springs[i, 0], springs[i, 2])
                end[i, 0], end[i, 1] = x[i] + h * v[i] + (0.5 * h * h - b) * a[i], v[i] + 0.5 * h * a[i]
                end[i, 2], end[i, 3] = b, 0.5 * h
            for i in range(count):
                given[i, count] = load[k - 1, i] + ahead * (load[k, i] - load[k - 1, i])
            _posed(now, end, springs, straight, given)
            _solved(given, end, h, springs, straight, a)
            for i in range(count):
                x[i], v[i] = end[i, 0] + end[i, 2] * a[i], end[i, 1] + end[i, 3] * a[i]
        for i in range(count):
            found[k, i, 0], found[k, i, 1], found[k, i, 2] = x[i], v[i], a[i]
