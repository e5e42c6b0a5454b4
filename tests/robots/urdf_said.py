"""What a URDF says, read a second time with ElementTree and numpy: by nothing that armhil uses."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Said:
    """What a URDF says.

    Attributes:
        bodies: shape, numbers of its size and centre in the base frame at the posture zero, per collision.
        masses: per link with one.
        inertias: trace of the inertia tensor, per link with one.
    """

    bodies: tuple[tuple[str, tuple[float, ...], tuple[float, ...]], ...]
    masses: dict[str, float]
    inertias: dict[str, float]


def said(text: str) -> Said:
    """Read a URDF that has been accepted, by nothing of armhil."""
    root = ET.fromstring(text.encode())
    poses = _poses(root)
    bodies = []
    for link in root.findall("link"):
        for collision in link.findall("collision"):
            shape = next(iter(collision.find("geometry") or ()))
            keys = {"box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length")}[shape.tag]
            size = tuple(float(part) for key in keys for part in shape.attrib[key].split())
            centre = (poses[link.attrib["name"]] @ _origin(collision))[:3, 3]
            bodies.append((shape.tag, size, tuple(centre.tolist())))
    masses, inertias = {}, {}
    for link in root.findall("link"):
        inertial = link.find("inertial")
        if inertial is not None:
            masses[link.attrib["name"]] = float(inertial.find("mass").attrib["value"])
            tensor = inertial.find("inertia").attrib
            inertias[link.attrib["name"]] = sum(float(tensor[key]) for key in ("ixx", "iyy", "izz"))
    return Said(tuple(bodies), masses, inertias)


def _poses(root: ET.Element) -> dict[str, np.ndarray]:
    children = {joint.find("child").attrib["link"]: joint for joint in root.findall("joint")}

    def pose(link: str) -> np.ndarray:
        if link not in children:
            return np.eye(4)
        joint = children[link]
        return pose(joint.find("parent").attrib["link"]) @ _origin(joint)

    return {link.attrib["name"]: pose(link.attrib["name"]) for link in root.findall("link")}


def _origin(element: ET.Element) -> np.ndarray:
    origin = element.find("origin")
    found = np.eye(4)
    if origin is not None:
        angles = [float(part) for part in origin.attrib.get("rpy", "0 0 0").split()]
        found[:3, :3] = Rotation.from_euler("xyz", angles).as_matrix()
        found[:3, 3] = [float(part) for part in origin.attrib.get("xyz", "0 0 0").split()]
    return found
