"""Torque of a serial chain per unit of each standard parameter of its links, in machine code.

Velocity, acceleration and the axes of the joints before are carried from link to link, each in the link's own
frame, where its ten parameters are: m, the first moments m·c, and the inertia about the frame's origin.
Gravity is an acceleration of the base.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from ident.kernels.compilation import compiled_with_stamp, inlined
from robots.arrays import FloatArray


@inlined
def _cross(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> tuple[float, float, float]:
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@inlined
def _turned(turn: FloatArray, old: FloatArray, new: FloatArray) -> None:
    for x in range(3):
        new[x] = turn[x, 0] * old[0] + turn[x, 1] * old[1] + turn[x, 2] * old[2]


@inlined
def _carry(
    turn: FloatArray, at: FloatArray, angular: FloatArray, linear: FloatArray, old: FloatArray
) -> None:
    """Axes of joints into a frame whose origin is at a place of the one that they are in."""
    for i in range(angular.shape[0]):
        gx, gy, gz = _cross(angular[i, 0], angular[i, 1], angular[i, 2], at[0], at[1], at[2])
        old[0], old[1], old[2] = linear[i, 0] + gx, linear[i, 1] + gy, linear[i, 2] + gz
        _turned(turn, old, linear[i])
        old[:] = angular[i]
        _turned(turn, old, angular[i])


@inlined
def _project(
    axis: FloatArray, along: FloatArray, w: FloatArray, rate: FloatArray, b: FloatArray, ten: FloatArray
) -> None:
    """Torque about one joint, (angular, linear) axis, per unit of a link's ten parameters."""
    ux, uy, uz = axis[0], axis[1], axis[2]
    vx, vy, vz = along[0], along[1], along[2]
    # Force m b + (α × + ω × ω ×) m c, couple I α + ω × I ω + m c × b.
    cx, cy, cz = _cross(w[0], w[1], w[2], vx, vy, vz)
    gx, gy, gz = _cross(w[0], w[1], w[2], cx, cy, cz)
    hx, hy, hz = _cross(rate[0], rate[1], rate[2], vx, vy, vz)
    dx, dy, dz = _cross(b[0], b[1], b[2], ux, uy, uz)
    ten[0] = vx * b[0] + vy * b[1] + vz * b[2]
    ten[1], ten[2], ten[3] = gx - hx + dx, gy - hy + dy, gz - hz + dz
    px, py, pz = _cross(ux, uy, uz, w[0], w[1], w[2])
    ten[4] = ux * rate[0] + px * w[0]
    ten[5] = ux * rate[1] + uy * rate[0] + px * w[1] + py * w[0]
    ten[6] = uy * rate[1] + py * w[1]
    ten[7] = ux * rate[2] + uz * rate[0] + px * w[2] + pz * w[0]
    ten[8] = uy * rate[2] + uz * rate[1] + py * w[2] + pz * w[1]
    ten[9] = uz * rate[2] + pz * w[2]


def _link_columns(
    frames: FloatArray,
    gravity: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    first: int,
    columns: FloatArray,
) -> None:
    """Write the columns of links from a first one on; a joint behind a link has none of it.

    Args:
        frames: (n, 37), as of ``chain_frames``.
        gravity: (3,) m/s².
        position, velocity, acceleration: samples × n.
        first: link.
        columns: samples × n × 10 (n − first), zero.
    """
    samples, n = position.shape
    angular, linear = np.zeros((n, 3)), np.zeros((n, 3))
    turn, old, at = np.empty((3, 3)), np.empty(3), np.empty(3)
    w, rate, b = np.empty(3), np.empty(3), np.empty(3)
    for k in range(samples):
        for x in range(3):
            w[x], rate[x], b[x] = 0.0, 0.0, -gravity[x]
        for link in range(n):
            q, v, a = position[k, link], velocity[k, link], acceleration[k, link]
            c, s = math.cos(q), math.sin(q)
            for x in range(3):
                for y in range(3):
                    # Transposed: from the link before into this one.
                    turn[y, x] = (
                        frames[link, 3 * x + y]
                        + frames[link, 9 + 3 * x + y] * c
                        + frames[link, 18 + 3 * x + y] * s
                    )
                at[x] = frames[link, 27 + x] + frames[link, 30 + x] * q
            # Acceleration of the new origin, in the frame before.
            cx, cy, cz = _cross(w[0], w[1], w[2], at[0], at[1], at[2])
            gx, gy, gz = _cross(w[0], w[1], w[2], cx, cy, cz)
            hx, hy, hz = _cross(rate[0], rate[1], rate[2], at[0], at[1], at[2])
            b[0], b[1], b[2] = b[0] + gx + hx, b[1] + gy + hy, b[2] + gz + hz
            _carry(turn, at, angular[:link], linear[:link], old)
            for part in (b, w, rate):
                old[:] = part
                _turned(turn, old, part)
            ex, ey, ez = frames[link, 33], frames[link, 34], frames[link, 35]
            gx, gy, gz = _cross(w[0], w[1], w[2], ex * v, ey * v, ez * v)
            for x in range(3):
                angular[link, x] = frames[link, 33 + x] * frames[link, 36]
                linear[link, x] = frames[link, 33 + x] * (1.0 - frames[link, 36])
            if frames[link, 36] > 0.5:
                rate[0], rate[1], rate[2] = (
                    rate[0] + ex * a + gx,
                    rate[1] + ey * a + gy,
                    rate[2] + ez * a + gz,
                )
                w[0], w[1], w[2] = w[0] + ex * v, w[1] + ey * v, w[2] + ez * v
            else:
                b[0] += ex * a + 2.0 * gx
                b[1] += ey * a + 2.0 * gy
                b[2] += ez * a + 2.0 * gz
            for i in range(link + 1 if link >= first else 0):
                _project(angular[i], linear[i], w, rate, b, columns[k, i, 10 * (link - first) :])


link_columns = compiled_with_stamp(_link_columns, Path(__file__).read_bytes())
"""See :func:`_link_columns`."""
