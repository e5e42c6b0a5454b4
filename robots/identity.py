"""By what a description is known: a checksum of each part, of what it says and not of how it is written.

White space, comments, spelling of numbers, file names and what is only drawn make no difference. A figure
that motion, masses, collision bodies or windows follow from does, wherever it stands.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import sha256

from robots.description import Robot
from robots.meshes import mesh_content, mesh_file
from robots.urdf import Urdf, UrdfBody, read_urdf
from robots.urdf_bodies import bodies_of
from robots.urdf_text import body_text, inertial_text, urdf_text

PARTS: Mapping[str, str] = {
    "robot.toml": "robot.toml",
    "kinematics": "the URDF's joints, limits or frames",
    "inertias": "the URDF's masses or inertias",
    "bodies": "the URDF's collision bodies",
    "meshes": "the content of its meshes",
}
"""Part → what a message calls it."""

_FOR_PEOPLE = {"description", "urdf"}
"""Keys of robot.toml that say nothing of the arm."""


def description_parts(robot: Robot) -> dict[str, str]:
    """Checksum of each part of a description, in the order of ``PARTS``; a robot has it from its loader.

    Raises:
        RobotFileError: the URDF or a mesh of it cannot be read any more.
    """
    urdf = read_urdf(robot.urdf_path)
    left_out = set() if robot.has_drives else {"drive"}
    left_out |= set() if robot.controller.is_given else {"controller"}
    toml = robot.model_dump(mode="json", exclude_defaults=True, exclude=_FOR_PEOPLE | left_out)
    inertias = {link.name: inertial_text(link.inertial) for link in urdf.links if link.inertial is not None}
    bodies = [[link.name, body_text(body, lambda _: "")] for link, _, body in bodies_of(urdf)]
    meshes = [[link.name, k, _content(robot, urdf, body)] for link, k, body in bodies_of(urdf) if body.mesh]
    texts = {
        "robot.toml": toml,
        "kinematics": urdf_text(urdf, lambda body: body.mesh, inertias=False, bodies=False),
        "inertias": inertias,
        "bodies": sorted(bodies),
        "meshes": sorted(meshes),
    }
    return {part: _digest(text) for part, text in texts.items()}


def description_sha256(parts: Mapping[str, str]) -> str:
    """The checksum by which a whole description is known."""
    return _digest(dict(parts))


def mesh_checksums(robot: Robot) -> dict[str, str]:
    """File name in the URDF → checksum of its content, of each mesh that is a collision body."""
    urdf = read_urdf(robot.urdf_path)
    return {body.mesh: _content(robot, urdf, body) for _, _, body in bodies_of(urdf) if body.mesh}


def differing(then: Mapping[str, str], now: Mapping[str, str]) -> str:
    """What of two descriptions differs, in words; empty where nothing does."""
    return " and ".join(words for part, words in PARTS.items() if then.get(part) != now.get(part))


def _content(robot: Robot, urdf: Urdf, body: UrdfBody) -> str:
    if robot.known_meshes is not None:
        return robot.known_meshes.get(body.mesh, "")
    return sha256(mesh_content(urdf, body, mesh_file(urdf, body))).hexdigest()


def _digest(value: object) -> str:
    return sha256(json.dumps(value, sort_keys=True, ensure_ascii=False).encode()).hexdigest()
