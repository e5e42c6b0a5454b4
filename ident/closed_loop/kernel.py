"""Compiled code of the closed loop: dynamics of a serial chain, friction taken implicitly, control law.

All of it stands in one file because the cache of compiled code looks at the age of one file only. The
functions work on plain arrays; ``ident.closed_loop.compiled`` makes those from the model and the recording.
They are few and long: each call and each view of an array costs as much as a joint's arithmetic.

Spatial vectors are taken about the origin of the base, in its axes, as (angular, linear). So nothing has
to be transformed from link to link: velocities add up along the chain, forces and inertias add up back
along it (Featherstone 2008, chapters 5 and 6). Link parameters enter linearly, in pin's order and about
the joint frame; there is no division by a mass.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, ParamSpec, TypeVar

import numba
import numpy as np

from robots.arrays import FloatArray, IntArray

P = ParamSpec("P")
R = TypeVar("R")

RUNS, NOT_POSITIVE_DEFINITE, UNSTABLE = 0, 1, 2
"""What :func:`closed_loop` ends with."""

Axes = tuple[int, ...]
"""(0, 1, … n − 1): the compiler knows the length of a tuple, so it can unroll what goes over the axes."""


class Dynamics(NamedTuple):
    """M(q) q̈ + N(q, q̇) of links and drives as arrays.

    ``frames``, ``links`` and ``gravity`` as for :func:`mass_and_bias`; ``inertia`` and ``damping`` (n, n) and
    ``constant`` (n,) are of the drives, ``terms`` and ``spans`` as for :func:`implicit_step`.
    """

    frames: FloatArray
    links: FloatArray
    gravity: FloatArray
    inertia: FloatArray
    damping: FloatArray
    constant: FloatArray
    terms: FloatArray
    spans: IntArray


class Drives(NamedTuple):
    """The sampled control law (``ident.closed_loop.control_law``) as arrays; gains (n,) per drive."""

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
    torque: FloatArray
    """(n, n) joint torque per control signal."""


class Run(NamedTuple):
    """What one run starts from and is led by, and where its samples go."""

    reference: FloatArray
    """(steps, n) set-points at the drive outputs, one per controller sample."""
    feed_forward: FloatArray
    """(steps, n) their velocities times the feed-forward gains."""
    position: FloatArray
    """(samples, n), row 0 is where it starts; the rest is written."""
    velocity: FloatArray
    control_signal: FloatArray
    """(samples, n), row 0 is what the drives put out at the start; then written whole."""
    speed_limit: FloatArray
    """(n,) a joint beyond this says that the loop is unstable."""


_NEWTON_STEPS = 50
_BISECTIONS = 50
_NEWTON_TOLERANCE = 1e-10
"""Residual of the implicit step, as a share of the largest push."""

_SMALL_ANGLE = 0.01
"""rad; below it three terms of the series are exact in double precision."""

_SATURATED = 20.0
"""tanh of anything beyond is ±1 in double precision."""


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Machine code, kept on disk where there is a writable place for it; strict IEEE arithmetic, no GIL."""
    try:
        return numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # no place for a cache
        return numba.njit(nogil=True, error_model="numpy")(function)


@compiled
def mass_and_bias(
    axes: Axes,
    frames: FloatArray,
    links: FloatArray,
    gravity: FloatArray,
    q: FloatArray,
    turn: FloatArray,
    v: FloatArray,
    mass: FloatArray,
    bias: FloatArray,
    work: FloatArray,
) -> None:
    """M(q) and N(q, q̇) of a serial chain, in place.

    Args:
        axes: of n.
        frames: (n, 37) constants of the joints: rotation A + B cos q + C sin q (9 each, by rows), position
            d0 + d1 q (3 each), axis in the joint frame (3), 1 for revolute and 0 for prismatic.
        links: (n, 10) standard parameters.
        gravity: (3,) m/s².
        q, v: (n,) positions and velocities.
        turn: (n, 2) cos q and sin q.
        mass: (n, n), written whole; bias: (n,).
        work: (n, 22) scratch.
    """
    n = len(axes)
    r00, r01, r02, r10, r11, r12, r20, r21, r22 = 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0
    px, py, pz = 0.0, 0.0, 0.0
    wx, wy, wz, ux, uy, uz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    ax, ay, az, bx, by, bz = 0.0, 0.0, 0.0, -gravity[0], -gravity[1], -gravity[2]
    for i in range(n):
        turns = frames[i, 36] > 0.5
        dx = frames[i, 27] + frames[i, 30] * q[i]
        dy = frames[i, 28] + frames[i, 31] * q[i]
        dz = frames[i, 29] + frames[i, 32] * q[i]
        px += r00 * dx + r01 * dy + r02 * dz
        py += r10 * dx + r11 * dy + r12 * dz
        pz += r20 * dx + r21 * dy + r22 * dz
        c, s = turn[i, 0], turn[i, 1]
        e00 = frames[i, 0] + frames[i, 9] * c + frames[i, 18] * s
        e01 = frames[i, 1] + frames[i, 10] * c + frames[i, 19] * s
        e02 = frames[i, 2] + frames[i, 11] * c + frames[i, 20] * s
        e10 = frames[i, 3] + frames[i, 12] * c + frames[i, 21] * s
        e11 = frames[i, 4] + frames[i, 13] * c + frames[i, 22] * s
        e12 = frames[i, 5] + frames[i, 14] * c + frames[i, 23] * s
        e20 = frames[i, 6] + frames[i, 15] * c + frames[i, 24] * s
        e21 = frames[i, 7] + frames[i, 16] * c + frames[i, 25] * s
        e22 = frames[i, 8] + frames[i, 17] * c + frames[i, 26] * s
        r00, r01, r02 = (
            r00 * e00 + r01 * e10 + r02 * e20,
            r00 * e01 + r01 * e11 + r02 * e21,
            r00 * e02 + r01 * e12 + r02 * e22,
        )
        r10, r11, r12 = (
            r10 * e00 + r11 * e10 + r12 * e20,
            r10 * e01 + r11 * e11 + r12 * e21,
            r10 * e02 + r11 * e12 + r12 * e22,
        )
        r20, r21, r22 = (
            r20 * e00 + r21 * e10 + r22 * e20,
            r20 * e01 + r21 * e11 + r22 * e21,
            r20 * e02 + r21 * e12 + r22 * e22,
        )
        # Joint axis S = (angular, linear).
        zx = r00 * frames[i, 33] + r01 * frames[i, 34] + r02 * frames[i, 35]
        zy = r10 * frames[i, 33] + r11 * frames[i, 34] + r12 * frames[i, 35]
        zz = r20 * frames[i, 33] + r21 * frames[i, 34] + r22 * frames[i, 35]
        if turns:
            sx, sy, sz = zx, zy, zz
            tx, ty, tz = py * zz - pz * zy, pz * zx - px * zz, px * zy - py * zx
        else:
            sx, sy, sz = 0.0, 0.0, 0.0
            tx, ty, tz = zx, zy, zz
        # Velocity (w, u); acceleration (a, b) without q̈, gravity as an acceleration of the base.
        rate = v[i]
        wx += sx * rate
        wy += sy * rate
        wz += sz * rate
        ux += tx * rate
        uy += ty * rate
        uz += tz * rate
        ax += (wy * sz - wz * sy) * rate
        ay += (wz * sx - wx * sz) * rate
        az += (wx * sy - wy * sx) * rate
        bx += (wy * tz - wz * ty + uy * sz - uz * sy) * rate
        by += (wz * tx - wx * tz + uz * sx - ux * sz) * rate
        bz += (wx * ty - wy * tx + ux * sy - uy * sx) * rate
        # Link inertia: turned into the base's axes, then moved to its origin.
        m = links[i, 0]
        fx = r00 * links[i, 1] + r01 * links[i, 2] + r02 * links[i, 3]
        fy = r10 * links[i, 1] + r11 * links[i, 2] + r12 * links[i, 3]
        fz = r20 * links[i, 1] + r21 * links[i, 2] + r22 * links[i, 3]
        g00 = r00 * links[i, 4] + r01 * links[i, 5] + r02 * links[i, 7]
        g01 = r00 * links[i, 5] + r01 * links[i, 6] + r02 * links[i, 8]
        g02 = r00 * links[i, 7] + r01 * links[i, 8] + r02 * links[i, 9]
        g10 = r10 * links[i, 4] + r11 * links[i, 5] + r12 * links[i, 7]
        g11 = r10 * links[i, 5] + r11 * links[i, 6] + r12 * links[i, 8]
        g12 = r10 * links[i, 7] + r11 * links[i, 8] + r12 * links[i, 9]
        g20 = r20 * links[i, 4] + r21 * links[i, 5] + r22 * links[i, 7]
        g21 = r20 * links[i, 5] + r21 * links[i, 6] + r22 * links[i, 8]
        g22 = r20 * links[i, 7] + r21 * links[i, 8] + r22 * links[i, 9]
        hx, hy, hz = fx + m * px, fy + m * py, fz + m * pz
        # -[h][p] - [p][f] with h = f + m p
        xx, yy, zz2 = hx * px + fx * px, hy * py + fy * py, hz * pz + fz * pz
        ixx = g00 * r00 + g01 * r01 + g02 * r02 + yy + zz2
        iyy = g10 * r10 + g11 * r11 + g12 * r12 + xx + zz2
        izz = g20 * r20 + g21 * r21 + g22 * r22 + xx + yy
        ixy = g00 * r10 + g01 * r11 + g02 * r12 - hx * py - px * fy
        ixz = g00 * r20 + g01 * r21 + g02 * r22 - hx * pz - px * fz
        iyz = g10 * r20 + g11 * r21 + g12 * r22 - hy * pz - py * fz
        # Momentum (k, l) of the link, then the force (n, f) = I a + v ×* (I v).
        kx = ixx * wx + ixy * wy + ixz * wz + hy * uz - hz * uy
        ky = ixy * wx + iyy * wy + iyz * wz + hz * ux - hx * uz
        kz = ixz * wx + iyz * wy + izz * wz + hx * uy - hy * ux
        lx = m * ux + wy * hz - wz * hy
        ly = m * uy + wz * hx - wx * hz
        lz = m * uz + wx * hy - wy * hx
        work[i, 0], work[i, 1], work[i, 2], work[i, 3], work[i, 4], work[i, 5] = sx, sy, sz, tx, ty, tz
        work[i, 6], work[i, 7], work[i, 8], work[i, 9] = m, hx, hy, hz
        work[i, 10], work[i, 11], work[i, 12], work[i, 13], work[i, 14], work[i, 15] = (
            ixx,
            ixy,
            iyy,
            ixz,
            iyz,
            izz,
        )
        work[i, 16] = (
            ixx * ax + ixy * ay + ixz * az + hy * bz - hz * by + wy * kz - wz * ky + uy * lz - uz * ly
        )
        work[i, 17] = (
            ixy * ax + iyy * ay + iyz * az + hz * bx - hx * bz + wz * kx - wx * kz + uz * lx - ux * lz
        )
        work[i, 18] = (
            ixz * ax + iyz * ay + izz * az + hx * by - hy * bx + wx * ky - wy * kx + ux * ly - uy * lx
        )
        work[i, 19] = m * bx + ay * hz - az * hy + wy * lz - wz * ly
        work[i, 20] = m * by + az * hx - ax * hz + wz * lx - wx * lz
        work[i, 21] = m * bz + ax * hy - ay * hx + wx * ly - wy * lx
    for j in range(n - 1, -1, -1):
        bias[j] = (
            work[j, 0] * work[j, 16]
            + work[j, 1] * work[j, 17]
            + work[j, 2] * work[j, 18]
            + work[j, 3] * work[j, 19]
            + work[j, 4] * work[j, 20]
            + work[j, 5] * work[j, 21]
        )
        sx, sy, sz, tx, ty, tz = work[j, 0], work[j, 1], work[j, 2], work[j, 3], work[j, 4], work[j, 5]
        m, hx, hy, hz = work[j, 6], work[j, 7], work[j, 8], work[j, 9]
        kx = work[j, 10] * sx + work[j, 11] * sy + work[j, 13] * sz + hy * tz - hz * ty
        ky = work[j, 11] * sx + work[j, 12] * sy + work[j, 14] * sz + hz * tx - hx * tz
        kz = work[j, 13] * sx + work[j, 14] * sy + work[j, 15] * sz + hx * ty - hy * tx
        lx = m * tx + sy * hz - sz * hy
        ly = m * ty + sz * hx - sx * hz
        lz = m * tz + sx * hy - sy * hx
        for i in range(j + 1):
            value = (
                work[i, 0] * kx
                + work[i, 1] * ky
                + work[i, 2] * kz
                + work[i, 3] * lx
                + work[i, 4] * ly
                + work[i, 5] * lz
            )
            mass[i, j] = value
            mass[j, i] = value
        if j > 0:
            for column in range(6, 22):
                work[j - 1, column] += work[j, column]


@compiled
def is_positive_definite(axes: Axes, matrix: FloatArray, work: FloatArray) -> bool:
    """Whether all pivots of L D Lᵀ of a symmetric matrix (n, n) are positive; ``work`` is (n, n) scratch."""
    n = len(axes)
    for j in range(n):
        pivot = matrix[j, j]
        for k in range(j):
            pivot -= work[j, k] * work[j, k] * work[k, k]
        if not pivot > 0.0:
            return False
        work[j, j] = pivot
        for i in range(j + 1, n):
            value = matrix[i, j]
            for k in range(j):
                value -= work[i, k] * work[j, k] * work[k, k]
            work[i, j] = value / pivot
    return True


@compiled
def friction(terms: FloatArray, spans: IntArray, work: FloatArray, velocity: int, into: int) -> None:
    """Of each speed term: its argument x = speed · v / width, its law (tanh x or x) and the slope of that.

    The velocity is in one row of ``work``, the results go into three rows from ``into`` on.
    """
    for k in range(terms.shape[0]):
        speed = 0.0
        for j in range(spans[k, 0], spans[k, 1]):
            speed += terms[k, 3 + j] * work[velocity, j]
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


@compiled
def implicit_step(  # noqa: C901
    axes: Axes,
    terms: FloatArray,
    spans: IntArray,
    implicit: FloatArray,
    push: FloatArray,
    v: FloatArray,
    h: float,
    matrix: FloatArray,
    work: FloatArray,
    here: int,
) -> int:
    """The velocity after a step: solve A (v⁺ − v) + h f(v⁺) = push for v⁺, in place of v.

    f = Σ torque_k · law_k(speed_k · v / width_k) is the gradient of a convex potential, so that Newton's
    method with a line search always ends well. What is left after a step of it is the curvature of f alone:
    no product with A.

    Args:
        terms: (K, 3 + 2n) as of ``ident.closed_loop.torque_parts``.
        spans: (K, 4) begin and end of what is not zero in speed row and torque row.
        implicit: (n, n) A = M + hD.
        push: (n,) h (τ − N − D v), without f.
        v: (n,) velocity, is replaced.
        h: step, s.
        matrix: (n, n) scratch.
        work: (10, max(n, K)) scratch. Rows of it, not views: a view costs more than what is done with it.
        here: row of ``work`` from which on :func:`friction` has put what belongs to v, 4 or 7.

    Returns:
        the row from which on it stands for the new v.
    """
    n, count = len(axes), terms.shape[0]
    rest, change, trial, found, there = 0, 1, 2, 3, 11 - here
    size, scale = 0.0, 0.0
    for i in range(n):
        work[rest, i] = -push[i]
        scale = max(scale, abs(push[i]))
    for k in range(count):
        for i in range(spans[k, 2], spans[k, 3]):
            work[rest, i] += h * work[here + 1, k] * terms[k, 3 + n + i]
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
            slope = h * work[here + 2, k] * terms[k, 0]
            if slope != 0.0:
                for i in range(spans[k, 2], spans[k, 3]):
                    for j in range(spans[k, 0], spans[k, 1]):
                        matrix[i, j] += slope * terms[k, 3 + n + i] * terms[k, 3 + j]
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
            friction(terms, spans, work, trial, there)
            for k in range(count):
                curved = work[there + 1, k] - work[here + 1, k]
                curved -= work[here + 2, k] * (work[there, k] - work[here, k])
                if curved != 0.0:
                    for i in range(spans[k, 2], spans[k, 3]):
                        work[found, i] += h * curved * terms[k, 3 + n + i]
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


@compiled
def _turn(axes: Axes, q: FloatArray, turn: FloatArray, v: FloatArray, h: float) -> None:
    """Move q (n,) on by h v, with its cosine and sine in ``turn`` (n, 2): series of the small angle."""
    for i in range(len(axes)):
        angle = h * v[i]
        q[i] += angle
        if abs(angle) > _SMALL_ANGLE:
            turn[i, 0], turn[i, 1] = math.cos(q[i]), math.sin(q[i])
        else:
            c, s, a = turn[i, 0], turn[i, 1], angle * angle
            sine = angle * (1.0 - a / 6.0 * (1.0 - a / 20.0 * (1.0 - a / 42.0)))
            less = 0.5 * a * (1.0 - a / 12.0 * (1.0 - a / 30.0))  # 1 − cos
            turn[i, 0], turn[i, 1] = c - (c * less + s * sine), s + (c * sine - s * less)


@compiled
def closed_loop(  # noqa: C901
    axes: Axes, dynamics: Dynamics, drives: Drives, run: Run, substeps: int
) -> tuple[int, int]:
    """Run one simulation; ``run``'s arrays are filled.

    Returns:
        RUNS, or NOT_POSITIVE_DEFINITE or UNSTABLE with the sample in which it happened; that sample's rows of
        ``run`` then hold where.
    """
    samples, n = run.position.shape[0], len(axes)
    per_sample = run.reference.shape[0] // samples
    h = drives.sample_time / substeps
    span = drives.reach * drives.sample_time
    q, turn, v = run.position[0].copy(), np.empty((n, 2)), np.zeros(n)
    integral, filtered = np.zeros(n), np.zeros(n)
    past, coming = np.empty((drives.reach, n)), np.empty((drives.delay + 1, n))
    output, torque, push, bias = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    mass, check, factors, links = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty((n, 22))
    drives_part = dynamics.inertia + h * dynamics.damping
    work = np.empty((10, max(n, dynamics.terms.shape[0])))
    work[:] = 0.0
    here = 4
    friction(dynamics.terms, dynamics.spans, work, 0, here)  # at rest
    coming[:] = run.control_signal[0]
    step = 0
    for sample in range(samples):
        run.position[sample], run.velocity[sample] = q, v
        for part in range(per_sample):
            # The controller, as ControlLaw.step.
            oldest, latest = step % drives.reach, step % (drives.delay + 1)
            for i in range(n):
                turn[i, 0], turn[i, 1] = math.cos(q[i]), math.sin(q[i])
                measured = 0.0
                for j in range(n):
                    measured += drives.transmission[i, j] * q[j]
                if step == 0:
                    past[:, i] = measured
                raw = (measured - past[oldest, i]) / span
                past[oldest, i] = measured
                filtered[i] += drives.smoothing * (raw - filtered[i])
                error = run.reference[step, i] - measured
                speed_error = run.feed_forward[step, i] - filtered[i]
                if drives.cascade:
                    wanted = drives.velocity_gain[i] * (drives.position_gain[i] * error + speed_error)
                    growth = drives.integral_gain[i] * wanted
                else:
                    wanted = drives.position_gain[i] * error + drives.velocity_gain[i] * speed_error
                    growth = drives.integral_gain[i] * error
                if step == 0 and drives.integral_gain[i] > 0.0:
                    integral[i] = run.control_signal[0, i] - wanted
                wanted += integral[i]
                limited = min(max(wanted, -drives.limit[i]), drives.limit[i])
                if limited == wanted or growth * wanted <= 0.0:
                    integral[i] += growth * drives.sample_time
                coming[latest, i] = limited
            step += 1
            output[:] = coming[step % (drives.delay + 1)]
            if part == 0:
                run.control_signal[sample] = output
            for i in range(n):
                torque[i] = -dynamics.constant[i]
                for j in range(n):
                    torque[i] += drives.torque[i, j] * output[j]
            # The arm.
            for substep in range(substeps):
                mass_and_bias(
                    axes, dynamics.frames, dynamics.links, dynamics.gravity, q, turn, v, mass, bias, links
                )
                if substep == 0:
                    for i in range(n):
                        for j in range(n):
                            check[i, j] = mass[i, j] + dynamics.inertia[i, j]
                    if not is_positive_definite(axes, check, factors):
                        run.position[sample], run.velocity[sample] = q, v
                        return NOT_POSITIVE_DEFINITE, sample
                for i in range(n):
                    force = torque[i] - bias[i]
                    for j in range(n):
                        force -= dynamics.damping[i, j] * v[j]
                        mass[i, j] += drives_part[i, j]
                    push[i] = h * force
                here = implicit_step(
                    axes, dynamics.terms, dynamics.spans, mass, push, v, h, check, work, here
                )
                _turn(axes, q, turn, v, h)
        for i in range(n):
            if not abs(v[i]) <= run.speed_limit[i]:
                run.position[sample], run.velocity[sample] = q, v
                return UNSTABLE, sample
    return RUNS, samples
