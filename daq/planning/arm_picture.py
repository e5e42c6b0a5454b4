"""Where an arm's bodies are at a posture, as points whose hulls draw it from any side."""

from __future__ import annotations

from itertools import pairwise

import coal
import numpy as np
import pinocchio
from scipy.spatial import ConvexHull, QhullError

from robots import Robot, rigid_body_model
from robots.arrays import FloatArray
from robots.rigid_body import collision_bodies

_ROUND = 24
"""Points of a circle."""

_THIN = 0.012
"""m; half the width of what stands for a link without a collision body."""


def arm_bodies(robot: Robot, posture: FloatArray) -> tuple[FloatArray, ...]:
    """Points (N × 3, m, base frame) of each body of the arm at a posture (n,), rad or m.

    Links without collision bodies are lines between the joints, so that there is always something to see.

    Raises:
        RobotFileError: a mesh cannot be read.
    """
    model = rigid_body_model(robot)
    data, geometry = model.createData(), collision_bodies(robot, model)
    pinocchio.forwardKinematics(model, data, posture)
    bodies = []
    for body in geometry.geometryObjects:
        pose = data.oMi[body.parentJoint] * body.placement
        bodies.append(_points(body.geometry) @ pose.rotation.T + pose.translation)
    if not bodies:
        joints = [data.oMi[k].translation for k in range(model.njoints)]
        bodies = [_segment(a, b) for a, b in pairwise(joints)]
    return tuple(np.asarray(points) for points in bodies)


def outline(flat: FloatArray) -> FloatArray:
    """Corners (M × 2) of the convex hull of points (N × 2), in order."""
    try:
        return np.asarray(flat[ConvexHull(flat).vertices])
    except QhullError:  # seen along its plane it is a line
        first = flat[np.argmin(flat @ np.ptp(flat, axis=0))]
        last = flat[np.argmax(flat @ np.ptp(flat, axis=0))]
        return np.array([first, last])


def _points(shape: coal.CollisionGeometry) -> FloatArray:
    """Points (N × 3) on the surface of a shape in its own frame, every extreme one among them."""
    if isinstance(shape, coal.BVHModelBase):
        return np.array(shape.vertices(), dtype=np.float64)
    if isinstance(shape, coal.Cylinder):
        return _ring(shape.radius, (-shape.halfLength, shape.halfLength))
    if isinstance(shape, coal.Sphere):
        return _ball(shape.radius)
    if isinstance(shape, coal.Capsule):
        ball, up = _ball(shape.radius), np.array([0.0, 0.0, shape.halfLength])
        return np.vstack([ball - up, ball + up])
    shape.computeLocalAABB()  # a box is the box around it
    low, high = np.asarray(shape.aabb_local.min_), np.asarray(shape.aabb_local.max_)
    corners = np.array([[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1)])
    return np.asarray(low + corners * (high - low))


def _ring(radius: float, heights: tuple[float, ...]) -> FloatArray:
    angle = np.linspace(0.0, 2 * np.pi, _ROUND, endpoint=False)
    circle = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.vstack([np.column_stack([circle, np.full(_ROUND, height)]) for height in heights])


def _ball(radius: float) -> FloatArray:
    tilt = np.linspace(-np.pi / 2, np.pi / 2, _ROUND // 2 + 1)
    return np.vstack([_ring(radius * np.cos(t), (radius * np.sin(t),)) for t in tilt])


def _segment(start: FloatArray, end: FloatArray) -> FloatArray:
    corners = _THIN * np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    return np.vstack([start + corners, end + corners])
