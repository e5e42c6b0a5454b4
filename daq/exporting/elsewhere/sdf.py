"""The identified arm as SDF 1.9, for Gazebo and Drake: bodies, joint limits, damping and dry friction."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np
import pinocchio

from daq.exporting.elsewhere.arm import IdentifiedArm
from daq.exporting.elsewhere.found import BODIES, SPRINGS, TILT, Spring, springs_of
from daq.exporting.elsewhere.frames import JointFrame, joint_frames, numbers
from daq.exporting.elsewhere.mjcf import about_center
from daq.exporting.elsewhere.urdf import beyond_joint_dynamics

_BASE = "base"
_GRAVITY, _SHARE = 9.81, 0.002
"""m/s² of a world, and by how much of it a place on earth may differ at most for it to count as that."""
_TENSOR = (("ixx", 0, 0), ("iyy", 1, 1), ("izz", 2, 2), ("ixy", 0, 1), ("ixz", 0, 2), ("iyz", 1, 2))


def sdf(arm: IdentifiedArm) -> tuple[bytes, tuple[str, ...]]:
    """The SDF file, and what it has no place for."""
    root = ET.Element("sdf", version="1.9")
    model = ET.SubElement(root, "model", name=arm.robot.name)
    ET.SubElement(model, "link", name=_BASE)
    _joint(model, "base_to_world", "fixed", "world", _BASE)
    springs, unsprung = _springs(arm)
    before = _BASE
    for axis, frame in enumerate(joint_frames(arm.robot)):
        _link(model, arm, axis, frame, before)
        _moving(model, arm, axis, frame, before, springs.get(axis))
        before = frame.link
    lost = (*unsprung, *beyond_joint_dynamics(arm), "Contact: the file has no geometry.")
    if not _upright(model, arm):
        lost += (f"Gravity {numbers(arm.robot.gravity)} m/s²: SDF states it for the world, not for a model.",)
    ET.indent(root)
    return ET.tostring(root, encoding="utf-8", xml_declaration=True), lost


def _link(model: ET.Element, arm: IdentifiedArm, axis: int, frame: JointFrame, before: str) -> None:
    link = ET.SubElement(model, "link", name=frame.link)
    pose = ET.SubElement(link, "pose", relative_to=before)
    pose.text = numbers([*frame.position, *frame.roll_pitch_yaw])
    mass, center, tensor = about_center(arm.links[axis])
    inertial = ET.SubElement(link, "inertial")
    _text(inertial, "pose", numbers([*center, 0.0, 0.0, 0.0]))
    _text(inertial, "mass", repr(mass))
    inertia = ET.SubElement(inertial, "inertia")
    for name, row, column in _TENSOR:
        _text(inertia, name, repr(float(tensor[row, column])))


def _springs(arm: IdentifiedArm) -> tuple[dict[int, Spring], tuple[str, ...]]:
    """The spring of each joint that has one which the format takes, and all that is lost."""
    springs: dict[int, Spring] = {}
    for spring in springs_of(arm.found):
        if spring.stiffness > 0.0 and not spring.cubic and not spring.side:
            springs.setdefault(spring.axis, spring)
    taken = {spring.label for spring in springs.values()}
    others = tuple(one.sentence for one in arm.found if one.name in SPRINGS and one.label not in taken)
    return springs, (*arm.lost(BODIES | SPRINGS | {TILT}), *others)


def _upright(model: ET.Element, arm: IdentifiedArm) -> bool:
    """Stand the base as gravity says, which a world has along −z; whether that is all there is to it."""
    gravity = np.array(arm.robot.gravity)
    size = float(np.linalg.norm(gravity))
    if abs(size - _GRAVITY) > _SHARE * _GRAVITY:
        return False
    turn = pinocchio.Quaternion.FromTwoVectors(gravity / size, np.array([0.0, 0.0, -1.0])).matrix()
    if not np.array_equal(turn, np.eye(3)):
        link = next(one for one in model.findall("link") if one.get("name") == _BASE)
        _text(link, "pose", numbers([0.0, 0.0, 0.0, *pinocchio.rpy.matrixToRpy(turn)]))
    return True


def _moving(
    model: ET.Element, arm: IdentifiedArm, axis: int, frame: JointFrame, before: str, spring: Spring | None
) -> None:
    described = arm.robot.joint[axis]
    joint = _joint(model, described.name, described.kind, before, frame.link)
    element = ET.SubElement(joint, "axis")
    _text(element, "xyz", numbers(frame.axis))
    limit = ET.SubElement(element, "limit")
    _text(limit, "lower", repr(described.position[0]))
    _text(limit, "upper", repr(described.position[1]))
    _text(limit, "effort", repr(described.torque))
    _text(limit, "velocity", repr(described.velocity))
    dynamics = ET.SubElement(element, "dynamics")
    _text(dynamics, "damping", repr(float(arm.damping[axis])))
    _text(dynamics, "friction", repr(float(arm.friction[axis])))
    if spring is not None:
        _text(dynamics, "spring_reference", repr(spring.rest))
        _text(dynamics, "spring_stiffness", repr(spring.stiffness))


def _joint(model: ET.Element, name: str, kind: str, parent: str, child: str) -> ET.Element:
    joint = ET.SubElement(model, "joint", name=name, type=kind)
    _text(joint, "parent", parent)
    _text(joint, "child", child)
    return joint


def _text(parent: ET.Element, tag: str, text: str) -> None:
    ET.SubElement(parent, tag).text = text
