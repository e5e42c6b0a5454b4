"""Torque of the links along a motion, in machine code: recursive Newton–Euler (Featherstone 2008, ch. 5).

Samples are taken in blocks whose values lie beside each other, so that the compiler makes one instruction of
several samples (SIMD): work and turns of a block are rows of ``BLOCK`` values each, one after the other in a
flat array, whose distances the compiler knows. The same holds for sines and cosines, which a library of C
would calculate one by one; they are the series of fdlibm (Sun Microsystems 1993), right to a unit of the last
digit below 10⁶ rad.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ident.kernels.compilation import compiled_with_stamp
from robots.arrays import FloatArray

BLOCK = 16
"""Samples at once."""

_CARRIED = 9 * BLOCK
"""From link to link: angular velocity, angular acceleration, acceleration of the origin."""

_KEPT = 18 * BLOCK
"""Of each link: rotation to its parent (9), its origin there (3), moment (3) and force (3) on it."""

_PER_QUARTER = 0.6366197723675814
_QUARTER, _QUARTER_NEXT, _QUARTER_LAST = (
    1.57079632673412561417e00,
    6.07710050630396597660e-11,
    2.02226624879595063154e-21,
)
"""π/2 in three parts, the first two of 33 bits: their products with whole numbers are exact."""


def _turns(q: FloatArray, turn: FloatArray) -> None:
    """Cosines and sines of angles (BLOCK,), one block after the other."""
    for k in range(BLOCK):
        quarters = np.floor(q[k] * _PER_QUARTER + 0.5)
        y = ((q[k] - quarters * _QUARTER) - quarters * _QUARTER_NEXT) - quarters * _QUARTER_LAST
        z = y * y
        tail = -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10
        tail = -1.98412698298579493134e-04 + z * (2.75573137070700676789e-06 + z * tail)
        sine = y + y * z * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03 + z * tail))
        tail = 2.08757232129817482790e-09 - z * 1.13596475577881948265e-11
        tail = 2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07 + z * tail)
        cosine = 4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * tail)
        cosine = 1.0 - (0.5 * z - z * z * cosine)
        fourth = quarters - 4.0 * np.floor(0.25 * quarters)
        odd = fourth == 1.0 or fourth == 3.0
        first, second = (sine, cosine) if odd else (cosine, sine)
        turn[k] = -first if fourth == 1.0 or fourth == 2.0 else first
        turn[BLOCK + k] = -second if fourth >= 2.0 else second


def _outward(
    frame: FloatArray,
    link: FloatArray,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    turn: FloatArray,
    carried: FloatArray,
    kept: FloatArray,
) -> None:
    """Motion of a link from that of its parent, and what it takes of moment and force, in the link's axes."""
    a00, a01, a02, a10, a11, a12 = frame[0], frame[1], frame[2], frame[3], frame[4], frame[5]
    a20, a21, a22, b00, b01, b02 = frame[6], frame[7], frame[8], frame[9], frame[10], frame[11]
    b10, b11, b12, b20, b21, b22 = frame[12], frame[13], frame[14], frame[15], frame[16], frame[17]
    c00, c01, c02, c10, c11, c12 = frame[18], frame[19], frame[20], frame[21], frame[22], frame[23]
    c20, c21, c22, d0, d1, d2 = frame[24], frame[25], frame[26], frame[27], frame[28], frame[29]
    e0, e1, e2 = frame[30], frame[31], frame[32]
    turns = 1.0 if frame[36] > 0.5 else 0.0
    sx, sy, sz = turns * frame[33], turns * frame[34], turns * frame[35]
    tx, ty, tz = frame[33] - sx, frame[34] - sy, frame[35] - sz
    m, hx, hy, hz = link[0], link[1], link[2], link[3]
    ixx, ixy, iyy, ixz, iyz, izz = link[4], link[5], link[6], link[7], link[8], link[9]
    for k in range(BLOCK):
        c, s, rate, push = turn[k], turn[BLOCK + k], v[k], a[k]
        r00, r01, r02 = a00 + b00 * c + c00 * s, a01 + b01 * c + c01 * s, a02 + b02 * c + c02 * s
        r10, r11, r12 = a10 + b10 * c + c10 * s, a11 + b11 * c + c11 * s, a12 + b12 * c + c12 * s
        r20, r21, r22 = a20 + b20 * c + c20 * s, a21 + b21 * c + c21 * s, a22 + b22 * c + c22 * s
        dx, dy, dz = d0 + e0 * q[k], d1 + e1 * q[k], d2 + e2 * q[k]
        px, py, pz = carried[k], carried[BLOCK + k], carried[2 * BLOCK + k]
        ox, oy, oz = carried[3 * BLOCK + k], carried[4 * BLOCK + k], carried[5 * BLOCK + k]
        ux, uy, uz = py * dz - pz * dy, pz * dx - px * dz, px * dy - py * dx
        lx = carried[6 * BLOCK + k] + oy * dz - oz * dy + py * uz - pz * uy
        ly = carried[7 * BLOCK + k] + oz * dx - ox * dz + pz * ux - px * uz
        lz = carried[8 * BLOCK + k] + ox * dy - oy * dx + px * uy - py * ux
        wx = r00 * px + r10 * py + r20 * pz
        wy = r01 * px + r11 * py + r21 * pz
        wz = r02 * px + r12 * py + r22 * pz
        gx = r00 * ox + r10 * oy + r20 * oz + sx * push + rate * (wy * sz - wz * sy)
        gy = r01 * ox + r11 * oy + r21 * oz + sy * push + rate * (wz * sx - wx * sz)
        gz = r02 * ox + r12 * oy + r22 * oz + sz * push + rate * (wx * sy - wy * sx)
        # A sliding joint: its own acceleration, and Coriolis's.
        fx = r00 * lx + r10 * ly + r20 * lz + tx * push + 2.0 * rate * (wy * tz - wz * ty)
        fy = r01 * lx + r11 * ly + r21 * lz + ty * push + 2.0 * rate * (wz * tx - wx * tz)
        fz = r02 * lx + r12 * ly + r22 * lz + tz * push + 2.0 * rate * (wx * ty - wy * tx)
        wx, wy, wz = wx + sx * rate, wy + sy * rate, wz + sz * rate
        carried[k], carried[BLOCK + k], carried[2 * BLOCK + k] = wx, wy, wz
        carried[3 * BLOCK + k], carried[4 * BLOCK + k], carried[5 * BLOCK + k] = gx, gy, gz
        carried[6 * BLOCK + k], carried[7 * BLOCK + k], carried[8 * BLOCK + k] = fx, fy, fz
        ux, uy, uz = wy * hz - wz * hy, wz * hx - wx * hz, wx * hy - wy * hx
        kx = ixx * wx + ixy * wy + ixz * wz
        ky = ixy * wx + iyy * wy + iyz * wz
        kz = ixz * wx + iyz * wy + izz * wz
        kept[k], kept[BLOCK + k], kept[2 * BLOCK + k] = r00, r01, r02
        kept[3 * BLOCK + k], kept[4 * BLOCK + k], kept[5 * BLOCK + k] = r10, r11, r12
        kept[6 * BLOCK + k], kept[7 * BLOCK + k], kept[8 * BLOCK + k] = r20, r21, r22
        kept[9 * BLOCK + k], kept[10 * BLOCK + k], kept[11 * BLOCK + k] = dx, dy, dz
        kept[12 * BLOCK + k] = ixx * gx + ixy * gy + ixz * gz + wy * kz - wz * ky + hy * fz - hz * fy
        kept[13 * BLOCK + k] = ixy * gx + iyy * gy + iyz * gz + wz * kx - wx * kz + hz * fx - hx * fz
        kept[14 * BLOCK + k] = ixz * gx + iyz * gy + izz * gz + wx * ky - wy * kx + hx * fy - hy * fx
        kept[15 * BLOCK + k] = m * fx + gy * hz - gz * hy + wy * uz - wz * uy
        kept[16 * BLOCK + k] = m * fy + gz * hx - gx * hz + wz * ux - wx * uz
        kept[17 * BLOCK + k] = m * fz + gx * hy - gy * hx + wx * uy - wy * ux


def _inward(frame: FloatArray, kept: FloatArray, torque: FloatArray) -> None:
    """What a link's moment and force are about its joint."""
    turns = 1.0 if frame[36] > 0.5 else 0.0
    sx, sy, sz = turns * frame[33], turns * frame[34], turns * frame[35]
    tx, ty, tz = frame[33] - sx, frame[34] - sy, frame[35] - sz
    for k in range(BLOCK):
        moment = sx * kept[12 * BLOCK + k] + sy * kept[13 * BLOCK + k] + sz * kept[14 * BLOCK + k]
        force = tx * kept[15 * BLOCK + k] + ty * kept[16 * BLOCK + k] + tz * kept[17 * BLOCK + k]
        torque[k] = moment + force


def _handed_on(kept: FloatArray, parent: FloatArray) -> None:
    """What a link's moment and force are on its parent."""
    for k in range(BLOCK):
        nx, ny, nz = kept[12 * BLOCK + k], kept[13 * BLOCK + k], kept[14 * BLOCK + k]
        fx, fy, fz = kept[15 * BLOCK + k], kept[16 * BLOCK + k], kept[17 * BLOCK + k]
        r00, r01, r02 = kept[k], kept[BLOCK + k], kept[2 * BLOCK + k]
        r10, r11, r12 = kept[3 * BLOCK + k], kept[4 * BLOCK + k], kept[5 * BLOCK + k]
        r20, r21, r22 = kept[6 * BLOCK + k], kept[7 * BLOCK + k], kept[8 * BLOCK + k]
        dx, dy, dz = kept[9 * BLOCK + k], kept[10 * BLOCK + k], kept[11 * BLOCK + k]
        gx = r00 * fx + r01 * fy + r02 * fz
        gy = r10 * fx + r11 * fy + r12 * fz
        gz = r20 * fx + r21 * fy + r22 * fz
        parent[12 * BLOCK + k] += r00 * nx + r01 * ny + r02 * nz + dy * gz - dz * gy
        parent[13 * BLOCK + k] += r10 * nx + r11 * ny + r12 * nz + dz * gx - dx * gz
        parent[14 * BLOCK + k] += r20 * nx + r21 * ny + r22 * nz + dx * gy - dy * gx
        parent[15 * BLOCK + k] += gx
        parent[16 * BLOCK + k] += gy
        parent[17 * BLOCK + k] += gz


_STAMP = Path(__file__).read_bytes()
_turns_of = compiled_with_stamp(_turns, _STAMP)
_out_along = compiled_with_stamp(_outward, _STAMP)
_back_along = compiled_with_stamp(_inward, _STAMP)
_hand_on = compiled_with_stamp(_handed_on, _STAMP)


def _newton_euler(
    frames: FloatArray,
    links: FloatArray,
    gravity: FloatArray,
    q: FloatArray,
    v: FloatArray,
    a: FloatArray,
    torque: FloatArray,
) -> None:
    """Torque of each joint (n, samples), written; samples are a whole number of blocks.

    Args:
        frames: (n, 37) as of ``chain_frames``.
        links: (n, 10) standard parameters, about the joint frames.
        gravity: (3,) m/s².
        q, v, a: (n, samples) positions and their derivatives.
    """
    n = q.shape[0]
    turn, carried, kept = np.empty(2 * BLOCK), np.empty(_CARRIED), np.empty((n, _KEPT))
    for start in range(0, q.shape[1], BLOCK):
        end = start + BLOCK
        for k in range(6 * BLOCK):
            carried[k] = 0.0
        for axis in range(3):
            for k in range(BLOCK):
                carried[(6 + axis) * BLOCK + k] = -gravity[axis]
        for i in range(n):
            _turns_of(q[i, start:end], turn)
            _out_along(
                frames[i], links[i], q[i, start:end], v[i, start:end], a[i, start:end], turn, carried, kept[i]
            )
        for i in range(n - 1, -1, -1):
            _back_along(frames[i], kept[i], torque[i, start:end])
            if i > 0:
                _hand_on(kept[i], kept[i - 1])


_kernel = compiled_with_stamp(_newton_euler, _STAMP)


def torque_along(
    frames: FloatArray,
    links: FloatArray,
    gravity: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
) -> FloatArray:
    """τ = M(q) q̈ + N(q, q̇) of a serial chain of links at each sample, samples × n.

    Args:
        frames: (n, 37) as of ``chain_frames``.
        links: (n, 10) standard parameters; the torque is linear in them.
        gravity: (3,) m/s² in the base.
        position, velocity, acceleration: samples × n.
    """
    samples, n = position.shape
    whole = -(-samples // BLOCK) * BLOCK
    rows = np.zeros((3, n, whole))
    for row, values in zip(rows, (position, velocity, acceleration), strict=True):
        row[:, :samples] = values.T
    torque = np.empty((n, whole))
    _kernel(frames, np.ascontiguousarray(links), gravity, rows[0], rows[1], rows[2], torque)
    return np.ascontiguousarray(torque[:, :samples].T)
