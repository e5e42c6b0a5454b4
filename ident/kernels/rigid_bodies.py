"""Compiled dynamics of a serial chain.

The functions are few and long: each call and each view of an array costs as much as a joint's arithmetic.

Spatial vectors are taken about the origin of the base, in its axes, as (angular, linear). So nothing has
to be transformed from link to link: velocities add up along the chain, forces and inertias add up back
along it (Featherstone 2008, chapters 5 and 6). Link parameters enter linearly, in pin's order and about
the joint frame; there is no division by a mass.
"""

from __future__ import annotations

import math

from ident.kernels.compilation import compiled
from ident.kernels.values import Axes
from robots.arrays import FloatArray, IntArray

_SMALL_ANGLE = 0.01
"""rad; below it three terms of the series are exact in double precision."""


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
def is_positive_definite(axes: Axes | IntArray, matrix: FloatArray, work: FloatArray) -> bool:
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
def turn_on(axes: Axes, q: FloatArray, turn: FloatArray, v: FloatArray, h: float) -> None:
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
