"""Where each joint stands on the one before: what every engine is told of the arm's kinematics."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pinocchio

from robots import Robot, rigid_body_model
from robots.arrays import FloatArray
from robots.urdf import read_urdf_joints
from robots.urdf_export import moving_links


@dataclass(frozen=True)
class JointFrame:
    """One joint of a serial arm at position zero.

    Attributes:
        joint: its name.
        link: the link that it moves.
        rotation: (3, 3) from this joint's frame to that of the joint before, or of the base.
        position: (3,) m, origin in the frame before.
        axis: (3,) unit vector in this frame.
    """

    joint: str
    link: str
    rotation: FloatArray
    position: FloatArray
    axis: FloatArray

    @property
    def quaternion(self) -> FloatArray:
        """w x y z."""
        x, y, z, w = pinocchio.Quaternion(self.rotation).coeffs()
        return np.array([w, x, y, z])

    @property
    def roll_pitch_yaw(self) -> FloatArray:
        """(3,) rad, as URDF and SDF write a rotation."""
        return np.asarray(pinocchio.rpy.matrixToRpy(self.rotation))


def joint_frames(robot: Robot) -> tuple[JointFrame, ...]:
    """From base to tip; bodies fixed to a moving link move in its frame."""
    model = rigid_body_model(robot)
    axes = {joint.name: joint.axis for joint in read_urdf_joints(robot.urdf_path)}
    return tuple(
        JointFrame(
            joint.name,
            link,
            np.array(model.jointPlacements[number].rotation),
            np.array(model.jointPlacements[number].translation),
            np.array(axes[joint.name]) / np.linalg.norm(axes[joint.name]),
        )
        for number, (joint, link) in enumerate(zip(robot.joint, moving_links(robot), strict=True), start=1)
    )


def numbers(values: Iterable[float]) -> str:
    """Numbers as XML attributes hold them, read back the same."""
    return " ".join(repr(float(value)) for value in values)
