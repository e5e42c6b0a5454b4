"""The identified arm for MuJoCo: bodies, armature, damping, dry friction, coupled drives as tendons.

MuJoCo compiles the URDF, so kinematics are read by MuJoCo itself; what a URDF has no place for is added to
its own MJCF of that.
"""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np

from daq.exporting.elsewhere.arm import IdentifiedArm
from daq.exporting.elsewhere.frames import joint_frames, numbers
from daq.exporting.elsewhere.mjcf_found import actuator, not_in_mujoco, tendon_springs
from robots.arrays import FloatArray

TIMESTEP = 0.0005
"""s; dry friction in MuJoCo yields over a few steps, see FRICTION_TIME."""
FRICTION_TIME = 2 * TIMESTEP
"""s; time constant of the dry friction constraint, the shortest that MuJoCo is stable with."""


def mjcf(arm: IdentifiedArm) -> tuple[bytes, tuple[str, ...]]:
    """The MJCF file, and what MuJoCo cannot express of the model."""
    lost = list(not_in_mujoco(arm))
    root = ET.Element("mujoco", model=arm.robot.name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="true", balanceinertia="false")
    gravity = numbers(arm.robot.gravity)
    ET.SubElement(root, "option", timestep=repr(TIMESTEP), gravity=gravity, integrator="implicitfast")
    armature, damping = _own(arm, lost)
    parent = ET.SubElement(root, "worldbody")
    for axis, frame in enumerate(joint_frames(arm.robot)):
        joint = arm.robot.joint[axis]
        body = ET.SubElement(
            parent, "body", name=frame.link, pos=numbers(frame.position), quat=numbers(frame.quaternion)
        )
        body.append(_inertial(arm.links[axis]))
        ET.SubElement(
            body,
            "joint",
            name=joint.name,
            type="hinge" if joint.kind == "revolute" else "slide",
            axis=numbers(frame.axis),
            range=numbers(joint.position),
            armature=repr(float(armature[axis])),
            damping=repr(float(damping[axis])),
            frictionloss=repr(float(arm.friction[axis])),
            solreffriction=f"{FRICTION_TIME!r} 1",
        )
        parent = body
    _tendons(root, arm, lost)
    tendon_springs(root, arm)
    actuators = ET.SubElement(root, "actuator")
    for axis, joint in enumerate(arm.robot.joint):
        attributes = {"name": joint.name, "joint": joint.name, **actuator(arm, axis)}
        ET.SubElement(actuators, "general", attributes)
    lost.append(
        "Contact between links: the file has no geometry. Dry friction yields over"
        f" {1e3 * FRICTION_TIME:g} ms near standstill, where the model holds still."
    )
    ET.indent(root)
    return ET.tostring(root, encoding="utf-8"), tuple(lost)


def _own(arm: IdentifiedArm, lost: list[str]) -> tuple[FloatArray, FloatArray]:
    """Armature and damping of each joint alone: the tendons have those of coupled drives."""
    armature, damping = arm.armature.copy(), arm.damping.copy()
    for coupling in arm.couplings:
        armature -= coupling.inertia * coupling.row**2
        damping -= coupling.viscous * coupling.row**2
    for what, values in (("rotor inertia", armature), ("viscous friction", damping)):
        for axis, joint in enumerate(arm.robot.joint):
            if values[axis] < 0.0:
                lost.append(
                    f"{joint.name}: {what} less that of its coupled drive comes to {values[axis]:.3g};"
                    " written is 0."
                )
    return np.maximum(armature, 0.0), np.maximum(damping, 0.0)


def _tendons(root: ET.Element, arm: IdentifiedArm, lost: list[str]) -> None:
    if not arm.couplings:
        return
    tendons = ET.SubElement(root, "tendon")
    for coupling in arm.couplings:
        if min(coupling.inertia, coupling.viscous, coupling.coulomb) < 0.0:
            lost.append(
                f"{coupling.name}: inertia {coupling.inertia:.3g}, viscous friction {coupling.viscous:.3g},"
                f" Coulomb friction {coupling.coulomb:.3g} of its own; of what is negative, written is 0."
            )
        tendon = ET.SubElement(
            tendons,
            "fixed",
            name=coupling.name,
            armature=repr(max(coupling.inertia, 0.0)),
            damping=repr(max(coupling.viscous, 0.0)),
            frictionloss=repr(max(coupling.coulomb, 0.0)),
            solreffriction=f"{FRICTION_TIME!r} 1",
        )
        for joint, factor in zip(arm.robot.joint, coupling.row.tolist(), strict=True):
            if factor:
                ET.SubElement(tendon, "joint", joint=joint.name, coef=repr(factor))


def _inertial(link: FloatArray) -> ET.Element:
    """Of standard parameters (10,): MJCF wants the tensor about the centre of mass."""
    mass, center, tensor = about_center(link)
    entries = [tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2]]
    return ET.Element("inertial", pos=numbers(center), mass=repr(mass), fullinertia=numbers(entries))


def about_center(link: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Mass, centre of mass (3,) in the link's frame, and inertia (3, 3) about it in the link's axes."""
    mass, center = float(link[0]), link[1:4] / link[0]
    xx, xy, yy, xz, yz, zz = link[4:]
    about_frame = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return mass, center, about_frame - mass * (center @ center * np.eye(3) - np.outer(center, center))
