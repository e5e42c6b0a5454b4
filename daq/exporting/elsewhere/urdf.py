"""The identified arm as URDF: the arm's own file with other inertias, joint damping and dry friction."""

from __future__ import annotations

from xml.etree import ElementTree as ET

from daq.exporting.elsewhere.arm import IdentifiedArm
from daq.exporting.elsewhere.found import BODIES
from robots import unit_of
from robots.urdf import read_urdf
from robots.urdf_export import urdf_with_links


def urdf(arm: IdentifiedArm) -> tuple[bytes, tuple[str, ...]]:
    """The URDF file, and what a URDF has no place for.

    Raises:
        RobotFileError: the arm's own URDF cannot be read.
    """
    text = urdf_with_links(arm.robot, arm.links)
    builder = ET.TreeBuilder(insert_comments=True)
    root = ET.fromstring(text, ET.XMLParser(target=builder))  # noqa: S314 - read strictly before
    for axis, joint in enumerate(arm.robot.joint):
        element = next(one for one in root.findall("joint") if one.get("name") == joint.name)
        for old in element.findall("dynamics"):
            element.remove(old)
        ET.SubElement(
            element,
            "dynamics",
            damping=repr(float(arm.damping[axis])),
            friction=repr(float(arm.friction[axis])),
        )
    _with_whole_paths(arm, root)
    ET.indent(root)
    return ET.tostring(root, encoding="utf-8", xml_declaration=True), (
        *arm.lost(BODIES),
        *beyond_joint_dynamics(arm),
    )


def _with_whole_paths(arm: IdentifiedArm, root: ET.Element) -> None:
    """Meshes are found from any folder."""
    folder = read_urdf(arm.robot.urdf_path).file.parent
    for mesh in root.iter("mesh"):
        name = mesh.get("filename", "")
        if name and "://" not in name:
            mesh.set("filename", str((folder / name).resolve()))


def beyond_joint_dynamics(arm: IdentifiedArm) -> tuple[str, ...]:
    """What joints with damping and dry friction do not have: rotor inertia, offsets, coupled drives."""
    said = []
    for axis, joint in enumerate(arm.robot.joint):
        unit = unit_of("Ia", joint.kind)
        said.append(
            f"{joint.name}: rotor inertia {arm.armature[axis]:.4g} {unit}, torque offset"
            f" {arm.offset[axis]:.4g} {joint.torque_unit}."
        )
    for coupling in arm.couplings:
        moves = ", ".join(
            joint.name for joint, factor in zip(arm.robot.joint, coupling.row, strict=True) if factor
        )
        said.append(
            f"{coupling.name} moves with {moves}: between them inertia {coupling.inertia:.4g}, viscous"
            f" friction {coupling.viscous:.4g}, and Coulomb friction {coupling.coulomb:.4g} of its own speed."
        )
    return tuple(said)
