"""The identified arm as SDF 1.9, for Gazebo and Drake: bodies, joint limits, damping and dry friction."""

from __future__ import annotations

from xml.etree import ElementTree as ET

from daq.exporting.elsewhere.arm import IdentifiedArm
from daq.exporting.elsewhere.frames import JointFrame, joint_frames, numbers
from daq.exporting.elsewhere.mjcf import about_center
from daq.exporting.elsewhere.urdf import beyond_joint_dynamics

_BASE = "base"
_TENSOR = (("ixx", 0, 0), ("iyy", 1, 1), ("izz", 2, 2), ("ixy", 0, 1), ("ixz", 0, 2), ("iyz", 1, 2))


def sdf(arm: IdentifiedArm) -> tuple[bytes, tuple[str, ...]]:
    """The SDF file, and what it has no place for."""
    root = ET.Element("sdf", version="1.9")
    model = ET.SubElement(root, "model", name=arm.robot.name)
    ET.SubElement(model, "link", name=_BASE)
    _joint(model, "base_to_world", "fixed", "world", _BASE)
    before = _BASE
    for axis, frame in enumerate(joint_frames(arm.robot)):
        _link(model, arm, axis, frame, before)
        _moving(model, arm, axis, frame, before)
        before = frame.link
    lost = (*arm.lost, *beyond_joint_dynamics(arm), "Contact: the file has no geometry.")
    if tuple(arm.robot.gravity) != (0.0, 0.0, -9.81):
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


def _moving(model: ET.Element, arm: IdentifiedArm, axis: int, frame: JointFrame, before: str) -> None:
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


def _joint(model: ET.Element, name: str, kind: str, parent: str, child: str) -> ET.Element:
    joint = ET.SubElement(model, "joint", name=name, type=kind)
    _text(joint, "parent", parent)
    _text(joint, "child", child)
    return joint


def _text(parent: ET.Element, tag: str, text: str) -> None:
    ET.SubElement(parent, tag).text = text
