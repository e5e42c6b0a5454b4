"""Compiled friction: laws of speed, and the step of the velocity that takes them implicitly."""

from __future__ import annotations

import math

from ident.kernels.compilation import compiled
from ident.kernels.values import BRISTLE, CONSTRAINT, LAW_CELLS, SLIP, TABULATED, TERM_HEAD, Axes
from robots.arrays import FloatArray, IntArray

_NEWTON_STEPS = 50
_BISECTIONS = 50
_NEWTON_TOLERANCE = 1e-10
"""Residual of the implicit step, as a share of the largest push."""

_SATURATED = 20.0
"""tanh of anything beyond is ±1 in double precision."""

WORK_ROWS = 12
"""Rows of the scratch array of :func:`implicit_step`."""

SHARES, BRISTLES = 10, 11
"""Its rows of step times strength of the terms, as far as implicit, and of the past of laws that have one (of
bristles their deflection, ±1)."""


@compiled
def other_laws(terms: FloatArray, laws: FloatArray, work: FloatArray, into: int) -> None:
    """The laws that only some models have, as :func:`friction` for terms whose x stands in ``work`` already.

    ``TABULATED``: x is a share of the table's range; its points are spaced by squares, close to standstill.
    ``BRISTLE``: x is the way over this step in bristle lengths; the deflection after it, which creeps towards
    ±1 (Dahl). ``SLIP``: the same, but elastic until ±1 and slipping then. ``CONSTRAINT``: x is of the speed
    and what it would gain in the time of the constraint, of which the past has the part before the step.
    """
    for k in range(terms.shape[0]):
        kind, x = terms[k, 1], work[into, k]
        if terms[k, 2] * x < 0.0:
            continue
        if kind == TABULATED:
            row, step = int(terms[k, 3]), 1 if x >= 0.0 else -1
            squared = abs(x) * LAW_CELLS * LAW_CELLS
            cell = min(int(math.sqrt(squared)), LAW_CELLS - 1)
            near = laws[row, LAW_CELLS + step * cell]
            per_square = (laws[row, LAW_CELLS + step * (cell + 1)] - near) / (2.0 * cell + 1.0)
            work[into + 1, k] = near + (squared - cell * cell) * per_square
            work[into + 2, k] = step * per_square * LAW_CELLS * LAW_CELLS
        elif kind == BRISTLE:
            direction = 1.0 if x >= 0.0 else -1.0
            left = (work[BRISTLES, k] - direction) * math.exp(-abs(x))
            work[into + 1, k], work[into + 2, k] = direction + left, -direction * left
        elif kind == SLIP:
            moved = work[BRISTLES, k] + x
            work[into + 1, k], work[into + 2, k] = moved, 1.0
            if abs(moved) > 1.0:
                work[into + 1, k], work[into + 2, k] = math.copysign(1.0, moved), 0.0
        elif kind == CONSTRAINT:
            asked = x - work[BRISTLES, k]
            work[into + 1, k], work[into + 2, k] = asked, 1.0
            if abs(asked) > 1.0:
                work[into + 1, k], work[into + 2, k] = math.copysign(1.0, asked), 0.0


@compiled
def friction(
    terms: FloatArray,
    spans: IntArray,
    laws: FloatArray | None,
    work: FloatArray,
    velocity: int,
    into: int,
) -> None:
    """Of each speed term: its argument x = speed · v / width, its law of x and the slope of that.

    The velocity is in one row of ``work``, the results go into three rows from ``into`` on.
    """
    for k in range(terms.shape[0]):
        speed = 0.0
        for j in range(spans[k, 0], spans[k, 1]):
            speed += terms[k, TERM_HEAD + j] * work[velocity, j]
        x = speed * terms[k, 0]
        law, slope = 1.0, 0.0
        if terms[k, 2] * x < 0.0:
            law = 0.0
        elif terms[k, 1] > 0.0:
            law, slope = x, 1.0
        elif x < -_SATURATED:
            law = -1.0
        elif not x > _SATURATED:
            law = math.tanh(x)
            slope = 1.0 - law * law
        work[into, k], work[into + 1, k], work[into + 2, k] = x, law, slope
    if laws is not None:
        other_laws(terms, laws, work, into)


@compiled
def implicit_step(  # noqa: C901
    axes: Axes | IntArray,
    terms: FloatArray,
    spans: IntArray,
    strength: FloatArray,
    shares: FloatArray,
    laws: FloatArray | None,
    implicit: FloatArray,
    push: FloatArray,
    v: FloatArray,
    h: float,
    matrix: FloatArray,
    work: FloatArray,
    here: int,
) -> int:
    """The velocity after a step: solve A (v⁺ − v) + h f(v⁺) = push for v⁺, in place of v.

    f = Σ strength_k · torque_k · law_k(speed_k · v / width_k) is the gradient of a convex potential, so that
    Newton's method with a line search always ends well. Terms of negative strength, whose potential is
    concave, are taken at the old velocity instead: convex and concave parts apart, every step has one
    solution (Eyre 1998). Of the others, too, a part is (``friction_rows.shares_at_new_velocity``). What is
    left after Newton's step is the curvature of f alone: no product with A.

    Args:
        axes: of the coordinates.
        terms, spans, strength, shares: as in ``values.Dynamics``; each law grows with its argument.
        laws: as in ``values.Extras``, or None where no law is tabulated.
        implicit: (m, m) A = M + hD/2.
        push: (m,) h (τ − N − D v), without f.
        v: (m,) velocity, is replaced.
        h: step, s.
        matrix: (m, m) scratch.
        work: (12, max(m, K)) scratch. Rows of it, not views: a view costs more than what is done with it.
            Row ``BRISTLES`` holds the deflections of bristles before the step.
        here: row of ``work`` from which on :func:`friction` has put what belongs to v, 4 or 7.

    Returns:
        the row from which on it stands for the new v.
    """
    n, count = len(axes), terms.shape[0]
    rest, change, trial, found, there = 0, 1, 2, 3, 11 - here
    torque = TERM_HEAD + n
    size, scale = 0.0, 0.0
    for i in range(n):
        work[rest, i] = -push[i]
        scale = max(scale, abs(push[i]))
    for k in range(count):
        work[SHARES, k] = h * max(strength[k], 0.0) * shares[k]
        for i in range(spans[k, 2], spans[k, 3]):
            work[rest, i] += h * strength[k] * work[here + 1, k] * terms[k, torque + i]
    for i in range(n):
        size = max(size, abs(work[rest, i]))
    for _ in range(_NEWTON_STEPS):
        if size <= _NEWTON_TOLERANCE * scale:
            break
        for i in range(n):
            work[change, i] = work[rest, i]
            for j in range(n):
                matrix[i, j] = implicit[i, j]
        for k in range(count):
            slope = work[SHARES, k] * work[here + 2, k] * terms[k, 0]
            if slope != 0.0:
                for i in range(spans[k, 2], spans[k, 3]):
                    for j in range(spans[k, 0], spans[k, 1]):
                        matrix[i, j] += slope * terms[k, torque + i] * terms[k, TERM_HEAD + j]
        # Gaussian elimination; the symmetric part is positive definite, so no pivoting is needed.
        for k in range(n):
            matrix[k, k] = 1.0 / matrix[k, k]
            for i in range(k + 1, n):
                factor = matrix[i, k] * matrix[k, k]
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                work[change, i] -= factor * work[change, k]
        for j in range(n - 1, -1, -1):
            work[change, j] *= matrix[j, j]
            for i in range(j):
                work[change, i] -= matrix[i, j] * work[change, j]
        # The whole step, unless it goes past the lowest point of the potential, whose gradient the residual
        # is: then to that point, which is where a friction term changes sign.
        share, below, above, uphill = 1.0, 0.0, 1.0, 0.0
        for i in range(n):
            uphill += work[change, i] * work[rest, i]
        for _ in range(_BISECTIONS):
            for i in range(n):
                work[trial, i] = v[i] - share * work[change, i]
                work[found, i] = (1.0 - share) * work[rest, i]
            friction(terms, spans, laws, work, trial, there)
            for k in range(count):
                curved = work[there + 1, k] - work[here + 1, k]
                curved -= work[here + 2, k] * (work[there, k] - work[here, k])
                curved *= work[SHARES, k]
                if curved != 0.0:
                    for i in range(spans[k, 2], spans[k, 3]):
                        work[found, i] += curved * terms[k, torque + i]
            size_found, along = 0.0, 0.0
            for i in range(n):
                size_found = max(size_found, abs(work[found, i]))
                along += work[change, i] * work[found, i]
            if size_found <= 0.5 * size or abs(along) <= 0.1 * uphill or (share == 1.0 and along > 0.0):
                break
            if along > 0.0:
                below = share
            else:
                above = share
            share = 0.5 * (below + above)
        size = size_found
        for i in range(n):
            v[i], work[rest, i] = work[trial, i], work[found, i]
        here, there = there, here
    return here
