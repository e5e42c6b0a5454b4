"""From a robot to its Pinocchio model, and to the collision bodies on it, as many as the URDF has.

Pinocchio and coal leave out with a warning what they cannot read. Here they are given what was read strictly
(``robots.urdf``), and what they made of it is compared with that: masses, places and bodies, one by one.
"""

from __future__ import annotations

from functools import lru_cache

import coal
import numpy as np
import pinocchio

from robots.arrays import FloatArray
from robots.description import Robot
from robots.errors import RobotFileError
from robots.meshes import mesh_extents, mesh_file
from robots.urdf import FIXED, Urdf, UrdfBody, UrdfJoint, read_urdf
from robots.urdf_bodies import bodies_of, carried_parameters, check_bodies, placed_links, transform
from robots.urdf_text import urdf_text

TOLERANCE = 1e-9
"""m, kg, …, and relative: how far two readings of one file may differ by rounding."""
MESH_TOLERANCE = 1e-5
"""Relative; STL holds single precision."""


def rigid_body_model(robot: Robot) -> pinocchio.Model:
    """The rigid-body model of the URDF: gravity of robot.toml, joints in the order of ``robot.joint``.

    Drive inertia and friction are not in it; they belong to the drives.

    Raises:
        RobotFileError: the URDF is not as it may be, or has other joints than robot.toml names.
    """
    urdf = read_urdf(robot.urdf_path)
    model = _model(urdf, _checked_text(urdf))
    names = [joint.name for joint in robot.joint]
    found = list(model.names)[1:]
    if found != names or model.nv != robot.n or model.nq != robot.n:
        raise RobotFileError(
            robot.urdf_path, f"has the moving joints {', '.join(found) or 'none'}", allowed=", ".join(names)
        )
    model.gravity.linear = np.array(robot.gravity)
    return model


def collision_bodies(robot: Robot, model: pinocchio.Model) -> pinocchio.GeometryModel:
    """The collision bodies of the URDF on its model, each of them compared with what the file says.

    Raises:
        RobotFileError: a mesh cannot be read; a body is not there, or is not what the URDF says; with line.
    """
    urdf = read_urdf(robot.urdf_path)
    files = {body: mesh_file(urdf, body) for _, _, body in bodies_of(urdf) if body.mesh}
    extents = {body: mesh_extents(urdf, body, file) for body, file in files.items()}
    text = urdf_text(urdf, lambda body: str(files[body]))
    try:
        geometry = pinocchio.buildGeomFromUrdfString(model, text, pinocchio.GeometryType.COLLISION)
    except (ValueError, RuntimeError) as error:
        raise RobotFileError(urdf.file, f"a collision body cannot be read: {error}") from None
    expected = {f"{link.name}_{k}": (link.name, body) for link, k, body in bodies_of(urdf)}
    found = {str(body.name): body for body in geometry.geometryObjects}
    places = placed_links(urdf)
    for name, (link, body) in expected.items():
        place = places[link]
        joint = model.getJointId(place.joint) if place.joint else 0
        pose = place.pose @ transform(body.pose)
        built = found.get(name)
        if built is None or not (
            built.parentJoint == joint
            and np.allclose(built.placement.homogeneous, pose, rtol=TOLERANCE, atol=TOLERANCE)
            and _is_of_shape(built.geometry, body, extents.get(body))
        ):
            raise RobotFileError(
                urdf.file,
                f"the <{body.shape}> is {'missing from' if built is None else 'not the same in'} the model",
                line=body.line,
                key=f'link "{link}" <collision>',
                allowed="collision bodies that Pinocchio reads as they are written",
            )
    if len(geometry.geometryObjects) != len(expected):
        problem = f"has {len(expected)} collision bodies, the model {len(geometry.geometryObjects)}"
        raise RobotFileError(urdf.file, problem, allowed="as many as the URDF has")
    return geometry


def _is_of_shape(geometry: coal.CollisionGeometry, body: UrdfBody, extents: FloatArray | None) -> bool:
    """Whether coal's body has the URDF's shape and size; of a mesh, ``extents`` (2, 3) around it."""
    size = body.size
    if body.shape == "box":
        return isinstance(geometry, coal.Box) and np.allclose(2 * geometry.halfSide, size, rtol=TOLERANCE)
    if body.shape == "sphere":
        return isinstance(geometry, coal.Sphere) and np.isclose(geometry.radius, size[0], rtol=TOLERANCE)
    if body.shape == "cylinder":
        same = isinstance(geometry, coal.Cylinder)
        return same and np.allclose((geometry.radius, 2 * geometry.halfLength), size, rtol=TOLERANCE)
    if not isinstance(geometry, coal.BVHModelBase):
        return False
    geometry.computeLocalAABB()
    built = np.array([geometry.aabb_local.min_, geometry.aabb_local.max_])
    if extents is None:
        return bool(np.isfinite(built).all() and (built[1] > built[0]).any())
    room = MESH_TOLERANCE * float(np.abs(extents).max())
    return bool(np.allclose(built, extents, rtol=0.0, atol=room))


def check_model(urdf: Urdf) -> None:
    """Can the bodies exist, and does Pinocchio read the file as it is written?

    Raises:
        RobotFileError: where not, with file and line.
    """
    _checked_text(urdf)


@lru_cache(maxsize=32)
def _checked_text(urdf: Urdf) -> str:
    """What Pinocchio is given of a URDF without its collision bodies, once its model has been compared."""
    check_bodies(urdf)
    text = urdf_text(urdf, lambda body: body.mesh, bodies=False)
    _compare(urdf, _model(urdf, text))
    return text


def _model(urdf: Urdf, text: str) -> pinocchio.Model:
    try:
        return pinocchio.buildModelFromXML(text)
    except (ValueError, RuntimeError) as error:
        raise RobotFileError(urdf.file, f"not a URDF that Pinocchio reads: {error}") from None


def _compare(urdf: Urdf, model: pinocchio.Model) -> None:
    """Has the model the masses of the file, and do its links stand where the file puts them?"""
    data = model.createData()
    lower, upper = model.lowerPositionLimit, model.upperPositionLimit
    position = lower + (upper - lower) * np.linspace(0.2, 0.9, model.nq)
    pinocchio.framesForwardKinematics(model, data, position)
    angles = dict(zip(list(model.names)[1:], position.tolist(), strict=True))
    for name, pose in _link_poses(urdf, angles).items():
        frame = model.getBodyId(name)
        built = data.oMf[frame].homogeneous if frame < model.nframes else np.full((4, 4), np.nan)
        if not np.allclose(built, pose, rtol=0.0, atol=TOLERANCE):
            raise _differs(urdf, f'link "{name}"', "stands elsewhere")
    for name, parameters in carried_parameters(urdf).items():
        built = np.asarray(model.inertias[model.getJointId(name)].toDynamicParameters())
        if not np.allclose(built, parameters, rtol=TOLERANCE, atol=TOLERANCE * max(1.0, parameters[0])):
            raise _differs(urdf, f'joint "{name}"', "carries another mass or inertia")


def _differs(urdf: Urdf, key: str, how: str) -> RobotFileError:
    allowed = "a URDF that Pinocchio reads as it is written"
    return RobotFileError(urdf.file, f"{how} in Pinocchio's model", key=key, allowed=allowed)


def _link_poses(urdf: Urdf, position: dict[str, float]) -> dict[str, FloatArray]:
    """(4, 4) of each link in the base frame with the moving joints at ``position``, rad or m."""
    children = {joint.child for joint in urdf.joints}
    found = {link.name: np.eye(4) for link in urdf.links if link.name not in children}
    pending = list(urdf.joints)
    while pending:
        ready = [joint for joint in pending if joint.parent in found]
        for joint in ready:
            moved = _motion(joint, position.get(joint.name, 0.0))
            found[joint.child] = found[joint.parent] @ transform(joint.pose) @ moved
        pending = [joint for joint in pending if joint.child not in found]
    return found


def _motion(joint: UrdfJoint, position: float) -> FloatArray:
    """(4, 4) of a joint's motion; about an axis by Rodrigues' formula."""
    x, y, z = joint.axis
    moved = np.eye(4)
    if joint.kind == "prismatic":
        moved[:3, 3] = position * np.array(joint.axis)
    elif joint.kind != FIXED:
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        moved[:3, :3] += np.sin(position) * cross + (1 - np.cos(position)) * cross @ cross
    return moved
