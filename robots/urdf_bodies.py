"""Rigid bodies of a URDF: where each stands on its moving joint, and whether such a body can exist."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robots.arrays import FloatArray
from robots.errors import RobotFileError
from robots.pseudo_inertia import impossible_links
from robots.urdf import FIXED, Pose, Urdf, UrdfBody, UrdfInertial, UrdfJoint, UrdfLink

LEAST_GYRATION, LARGEST_GYRATION = 1e-4, 10.0
"""m; radius of gyration that a body of an arm can have."""


@dataclass(frozen=True)
class Placed:
    """Where a link stands: on which moving joint (empty: on the base), and how there, (4, 4)."""

    joint: str
    pose: FloatArray


def transform(pose: Pose) -> FloatArray:
    """(4, 4) of an ``<origin>``: fixed-axis roll, pitch, yaw, then the translation."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(pose.rpy), np.sin(pose.rpy)
    found = np.eye(4)
    found[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    found[:3, 3] = pose.xyz
    return found


def placed_links(urdf: Urdf) -> dict[str, Placed]:
    """Each link on the moving joint that carries it, in the joint's frame."""
    below: dict[str, list[UrdfJoint]] = {}
    for joint in urdf.joints:
        below.setdefault(joint.parent, []).append(joint)
    children = {joint.child for joint in urdf.joints}
    pending = [(link.name, Placed("", np.eye(4))) for link in urdf.links if link.name not in children]
    found: dict[str, Placed] = {}
    while pending:
        name, place = pending.pop()
        found[name] = place
        for joint in below.get(name, []):
            if joint.kind == FIXED:
                pending.append((joint.child, Placed(place.joint, place.pose @ transform(joint.pose))))
            else:
                pending.append((joint.child, Placed(joint.name, np.eye(4))))
    return found


def carried_parameters(urdf: Urdf) -> dict[str, FloatArray]:
    """(10,) standard parameters of what moves with each joint, about the joint's frame."""
    places = placed_links(urdf)
    found = {joint.name: np.zeros(10) for joint in urdf.joints if joint.kind != FIXED}
    for link in urdf.links:
        place = places[link.name]
        if place.joint and link.inertial is not None:
            found[place.joint] = found[place.joint] + standard_parameters(link.inertial, place.pose)
    return found


def standard_parameters(inertial: UrdfInertial, frame: FloatArray) -> FloatArray:
    """(10,) mass, first moments and inertia tensor (xx xy yy xz yz zz) about a frame, of a link that has the
    pose ``frame`` (4, 4) in it."""
    pose = frame @ transform(inertial.pose)
    rotation, centre, mass = pose[:3, :3], pose[:3, 3], inertial.mass
    tensor = rotation @ _tensor(inertial) @ rotation.T
    tensor = tensor + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return np.concatenate(([mass], mass * centre, tensor[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]))


def check_bodies(urdf: Urdf) -> None:
    """Can these bodies exist, and has each link that moves a mass, and a body where the others have one?

    Raises:
        RobotFileError: the first that cannot, with file and line.
    """
    for link in urdf.links:
        if link.inertial is not None:
            _check_inertial(urdf, link, link.inertial)
    places = placed_links(urdf)
    masses = carried_parameters(urdf)
    watched = {places[link.name].joint for link in urdf.links if link.bodies}
    for joint in urdf.joints:
        if joint.kind == FIXED:
            continue
        link = next(link for link in urdf.links if link.name == joint.child)
        key = f'link "{link.name}"'
        if masses[joint.name][0] == 0.0:
            raise RobotFileError(
                urdf.file,
                f"moves with {joint.name} and has no <inertial>, nor has a link that is fixed to it",
                line=link.line,
                key=key,
                allowed="the mass, centre and inertia of what moves",
            )
        if watched and joint.name not in watched:
            raise RobotFileError(
                urdf.file,
                f"moves with {joint.name} and has no <collision>, nor has a link that is fixed to it",
                line=link.line,
                key=key,
                allowed="a collision body for every link that moves, or for none (then nothing is watched)",
            )


def bodies_of(urdf: Urdf) -> tuple[tuple[UrdfLink, int, UrdfBody], ...]:
    """All collision bodies in file order, with their link and their number on it."""
    return tuple((link, k, body) for link in urdf.links for k, body in enumerate(link.bodies))


def _check_inertial(urdf: Urdf, link: UrdfLink, inertial: UrdfInertial) -> None:
    tensor = _tensor(inertial)
    about_centre = np.concatenate(([inertial.mass, 0, 0, 0], tensor[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]))
    gyration = float(np.sqrt(max(0.0, np.trace(tensor)) / 2 / inertial.mass))
    if impossible_links(about_centre[np.newaxis]):
        moments = ", ".join(f"{value:.4g}" for value in np.linalg.eigvalsh(tensor))
        problem = f"no body has the principal moments of inertia {moments} kg·m²"
        allowed = "each above 0, none larger than the sum of the others"
    elif not LEAST_GYRATION <= gyration <= LARGEST_GYRATION:
        problem = f"mass {inertial.mass:g} kg and this inertia make a radius of gyration of {gyration:.3g} m"
        allowed = f"{LEAST_GYRATION:g} m to {LARGEST_GYRATION:g} m"
    else:
        return
    key = f'link "{link.name}" <inertia>'
    raise RobotFileError(urdf.file, problem, line=inertial.line, key=key, allowed=allowed)


def _tensor(inertial: UrdfInertial) -> FloatArray:
    xx, xy, xz, yy, yz, zz = inertial.tensor
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
