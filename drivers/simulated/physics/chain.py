"""Rigid bodies of a serial arm in body coordinates: mass matrix and bias torques.

Each link carries a frame whose z axis is its joint's axis, so that a joint is a turn about z, or a shift
along it. The recursions are Newton and Euler's outward and inward (Luh, Walker and Paul 1980) for the
bias, and composite bodies (Walker and Orin 1982) for the mass matrix, with the moments of inertia about
the frame's origin, so that mass, first moment and inertia enter linearly.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from drivers.simulated.physics.compile import inner
from drivers.simulated.physics.vectors import (
    Rotation,
    Vector,
    add,
    cross,
    dot,
    load3,
    load9,
    rotate,
    rotate_back,
    scale,
    store,
    turned_about_z,
)
from robots.arrays import BoolArray, FloatArray

_WORK_SIZE = 40


class Chain(NamedTuple):
    """A serial arm as arrays."""

    rotation: FloatArray
    """(n, 9) from each joint's frame at position 0 to its parent's frame, by rows."""
    offset: FloatArray
    """(n, 3) origin of the joint's frame in its parent's frame, m."""
    slides: BoolArray
    """(n,) True for a prismatic joint."""
    links: FloatArray
    """(n, 10): mass, first moment (3), Ixx Ixy Iyy Ixz Iyz Izz about the frame's origin."""
    gravity: FloatArray
    """(3,) in the base frame, m/s²."""
    work: FloatArray
    """(n, 40) scratch: rotation 0–8, origin 9–11, force 12–14, moment 15–17, composite body 18–27."""


def chain_of(model: pin.Model, gravity: FloatArray) -> Chain:
    """The chain of a model whose joints are one after another.

    Args:
        model: one revolute or prismatic joint per body, each the child of the one before.
        gravity: (3,) in the base frame, m/s².
    """
    n = model.nv
    rotation, offset, links = np.empty((n, 9)), np.empty((n, 3)), np.empty((n, 10))
    slides = np.zeros(n, dtype=np.bool_)
    before = np.eye(3)
    for j in range(n):
        slides[j], axis = _axis(model, j + 1)
        align = frame_along(axis)
        placement = model.jointPlacements[j + 1]
        rotation[j] = (before.T @ placement.rotation @ align).ravel()
        offset[j] = before.T @ placement.translation
        turned = model.inertias[j + 1].se3ActionInverse(pin.SE3(align, np.zeros(3)))
        links[j] = turned.toDynamicParameters()
        before = align
    return Chain(
        rotation, offset, slides, links, np.array(gravity, dtype=np.float64), np.zeros((n, _WORK_SIZE))
    )


def _axis(model: pin.Model, joint: int) -> tuple[bool, FloatArray]:
    """Whether a joint slides, and its unit axis in its own frame."""
    kind = model.joints[joint]
    data = kind.createData()
    # Each joint takes its own of the values of all, by its place among them.
    kind.calc(data, np.zeros(model.nq), np.zeros(model.nv))
    motion = np.asarray(data.S).reshape(6)
    slides = bool(np.linalg.norm(motion[:3]) > 0.5)
    return slides, motion[:3] if slides else motion[3:]


def frame_along(axis: FloatArray) -> FloatArray:
    """A rotation (3 × 3) whose third column is the axis; the identity for z itself."""
    z = axis / np.linalg.norm(axis)
    other = np.eye(3)[0] if abs(z[0]) < 0.9 else np.eye(3)[1]
    x = other - (other @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


@inner
def place(chain: Chain, position: FloatArray) -> None:
    """Rotation and origin of every frame in its parent's, for joint positions (n,)."""
    for j in range(len(position)):
        row = chain.work[j]
        turn = load9(chain.rotation[j], 0)
        origin = load3(chain.offset[j], 0)
        if chain.slides[j]:
            origin = add(origin, scale(position[j], (turn[2], turn[5], turn[8])))
        else:
            turn = turned_about_z(turn, math.cos(position[j]), math.sin(position[j]))
        store(row, 0, turn)
        store(row, 9, origin)


@inner
def _moment_of(link: FloatArray, a: Vector) -> Vector:
    """Inertia tensor times a vector."""
    return (
        link[4] * a[0] + link[5] * a[1] + link[7] * a[2],
        link[5] * a[0] + link[6] * a[1] + link[8] * a[2],
        link[7] * a[0] + link[8] * a[1] + link[9] * a[2],
    )


@inner
def bias(chain: Chain, velocity: FloatArray, out: FloatArray) -> None:
    """Gravity, Coriolis and centrifugal torques at the joints, (n,), for the frames of :func:`place`."""
    n = len(velocity)
    spin = (0.0, 0.0, 0.0)
    spin_rate = (0.0, 0.0, 0.0)
    pull = (-chain.gravity[0], -chain.gravity[1], -chain.gravity[2])
    for j in range(n):
        row, link = chain.work[j], chain.links[j]
        turn, origin = load9(row, 0), load3(row, 9)
        pull = add(pull, add(cross(spin_rate, origin), cross(spin, cross(spin, origin))))
        pull, spin, spin_rate = rotate_back(turn, pull), rotate_back(turn, spin), rotate_back(turn, spin_rate)
        along = (0.0, 0.0, velocity[j])
        if chain.slides[j]:
            pull = add(pull, scale(2.0, cross(spin, along)))
        else:
            spin_rate = add(spin_rate, cross(spin, along))
            spin = add(spin, along)
        first = load3(link, 1)
        force = add(scale(link[0], pull), add(cross(spin_rate, first), cross(spin, cross(spin, first))))
        moment = add(_moment_of(link, spin_rate), cross(spin, _moment_of(link, spin)))
        store(row, 12, force)
        store(row, 15, add(moment, cross(first, pull)))
    force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for k in range(n):
        j = n - 1 - k
        row = chain.work[j]
        force, moment = add(force, load3(row, 12)), add(moment, load3(row, 15))
        out[j] = force[2] if chain.slides[j] else moment[2]
        turn = load9(row, 0)
        force = rotate(turn, force)
        moment = add(rotate(turn, moment), cross(load3(row, 9), force))


@inner
def _times(r: Rotation, s: Rotation) -> Rotation:
    """R S."""
    a, b, c = rotate(r, (s[0], s[3], s[6])), rotate(r, (s[1], s[4], s[7])), rotate(r, (s[2], s[5], s[8]))
    return (a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2])


@inner
def _add_to_parent(body: FloatArray, turn: Rotation, origin: Vector, parent: FloatArray) -> None:
    """Adds a body (mass, first moment, inertia; from index 18), seen from the parent's frame."""
    mass = body[18]
    first = rotate(turn, load3(body, 19))
    xx, xy, yy, xz, yz, zz = body[22], body[23], body[24], body[25], body[26], body[27]
    half = _times(turn, (xx, xy, xz, xy, yy, yz, xz, yz, zz))
    # The rows of R I are turned once more: R I Rᵀ is symmetric.
    x = rotate(turn, (half[0], half[1], half[2]))
    y = rotate(turn, (half[3], half[4], half[5]))
    z = rotate(turn, (half[6], half[7], half[8]))
    # Parallel axes with the first moment about the old origin: p·(2 h + m p) 1 − (p hᵀ + h pᵀ + m p pᵀ).
    p = origin
    across = 2.0 * dot(p, first) + mass * dot(p, p)
    parent[18] += mass
    parent[19] += first[0] + mass * p[0]
    parent[20] += first[1] + mass * p[1]
    parent[21] += first[2] + mass * p[2]
    parent[22] += x[0] + across - (2.0 * p[0] * first[0] + mass * p[0] * p[0])
    parent[23] += x[1] - (p[0] * first[1] + first[0] * p[1] + mass * p[0] * p[1])
    parent[24] += y[1] + across - (2.0 * p[1] * first[1] + mass * p[1] * p[1])
    parent[25] += x[2] - (p[0] * first[2] + first[0] * p[2] + mass * p[0] * p[2])
    parent[26] += y[2] - (p[1] * first[2] + first[1] * p[2] + mass * p[1] * p[2])
    parent[27] += z[2] + across - (2.0 * p[2] * first[2] + mass * p[2] * p[2])


@inner
def mass_matrix(chain: Chain, out: FloatArray) -> None:
    """M(q) of the links, (n, n), for the frames of :func:`place`."""
    n = len(chain.slides)
    for j in range(n):
        for k in range(10):
            chain.work[j, 18 + k] = chain.links[j, k]
    for k in range(n):
        j = n - 1 - k
        body = chain.work[j]
        if j > 0:
            _add_to_parent(body, load9(body, 0), load3(body, 9), chain.work[j - 1])
        first = load3(body, 19)
        if chain.slides[j]:
            force, moment = (0.0, 0.0, body[18]), (first[1], -first[0], 0.0)
            out[j, j] = force[2]
        else:
            force, moment = (-first[1], first[0], 0.0), (body[25], body[26], body[27])
            out[j, j] = moment[2]
        for up in range(j):
            i = j - up
            turn = load9(chain.work[i], 0)
            force = rotate(turn, force)
            moment = add(rotate(turn, moment), cross(load3(chain.work[i], 9), force))
            value = force[2] if chain.slides[i - 1] else moment[2]
            out[i - 1, j] = value
            out[j, i - 1] = value
