"""The constants of a serial chain's joints, as compiled dynamics want them."""

from __future__ import annotations

import numpy as np
import pinocchio

from robots.arrays import FloatArray


def chain_frames(model: pinocchio.Model) -> FloatArray | None:
    """Joint constants (n, 37) of ``ident.kernels.rigid_bodies.mass_and_bias``, or None for a branched model.

    Rotation about a unit axis a is a aᵀ + (1 − a aᵀ) cos q + [a]× sin q; the joint's placement is put before.
    Joint axes of any direction; revolute and prismatic.
    """
    joints = model.njoints - 1
    if model.nq != joints or model.nv != joints or list(model.parents)[1:] != list(range(joints)):
        return None
    frames = np.zeros((joints, 37))
    for row, joint, placement in zip(
        frames, list(model.joints)[1:], list(model.jointPlacements)[1:], strict=True
    ):
        linear, angular = _axis(joint, joints)
        turns = bool(angular.any())
        axis = angular if turns else linear
        along = np.outer(axis, axis)
        cross = np.cross(np.eye(3), axis)
        parts = (
            (along, np.eye(3) - along, cross) if turns else (np.eye(3), np.zeros((3, 3)), np.zeros((3, 3)))
        )
        row[:27] = np.concatenate([(placement.rotation @ part).ravel() for part in parts])
        row[27:30] = placement.translation
        row[30:33] = placement.rotation @ linear
        row[33:36] = axis
        row[36] = float(turns)
    return frames


def _axis(joint: pinocchio.JointModel, joints: int) -> tuple[FloatArray, FloatArray]:
    """The motion (linear, angular), 3 each, of one unit of joint speed.

    A joint takes its own of the values of all: given its own alone, it reads what is behind them in memory,
    and where that is nobody's the process ends.
    """
    data = joint.createData()
    joint.calc(data, np.zeros(joints), np.zeros(joints))
    motion = np.array(data.S, dtype=np.float64).reshape(6)  # a copy: the data are gone behind the return
    return motion[:3], motion[3:]
