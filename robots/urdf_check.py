"""Does the URDF carry the arm that robot.toml describes? Joints, their order, kinds and limits."""

from __future__ import annotations

from pathlib import Path

from robots.description import Joint, Robot
from robots.errors import RobotFileError, shown
from robots.meshes import mesh_file
from robots.rigid_body import check_model
from robots.toml_lines import Path as KeyPath
from robots.toml_lines import TomlLines, key_text
from robots.urdf import MOVING, UrdfJoint, read_urdf
from robots.urdf_bodies import bodies_of

LIMIT_TOLERANCE = 1e-9
"""Relative: a limit copied from one file to the other may lose its last digits."""


def check_urdf(robot: Robot, file: Path, lines: TomlLines) -> None:
    """Raise RobotFileError, with file and line, where a URDF is wrong or does not fit its robot.toml."""
    urdf = robot.urdf_path
    if not urdf.is_file():
        raise _toml_error(
            file, lines, ("urdf",), f"{shown(robot.urdf)} is not a file in {file.parent}", "a URDF file"
        )
    content = read_urdf(urdf)
    joints = content.joints
    moving = {joint.name: joint for joint in joints if joint.kind in MOVING}
    for i, joint in enumerate(robot.joint):
        if joint.name not in moving:
            problem = f"{shown(joint.name)} is not a moving joint of {urdf}"
            raise _toml_error(
                file, lines, ("joint", i, "name"), problem, ", ".join(moving) or "none: it has none"
            )
    names = [joint.name for joint in robot.joint]
    for name, urdf_joint in moving.items():
        if name not in names:
            problem = f"moves, but {file} has no [[joint]] of that name"
            allowed = f'{", ".join(names)}, or type="fixed"'
            raise RobotFileError(urdf, problem, line=urdf_joint.line, key=f'joint "{name}"', allowed=allowed)
    _check_order(names, joints, file, lines)
    for i, joint in enumerate(robot.joint):
        _check_joint(i, joint, moving[joint.name], file, lines, urdf)
    check_model(content)
    for _, _, body in bodies_of(content) if robot.known_meshes is None else ():
        if body.mesh:
            mesh_file(content, body)


def _check_order(names: list[str], joints: tuple[UrdfJoint, ...], file: Path, lines: TomlLines) -> None:
    """The moving joints are one serial chain, listed from the base to the tip."""
    above = {joint.child: joint for joint in joints}
    for i, name in enumerate(names):
        link = next(joint.parent for joint in joints if joint.name == name)
        chain: list[str] = []
        seen: set[str] = set()
        while link in above and link not in seen:
            seen.add(link)
            if above[link].name in names:
                chain.insert(0, above[link].name)
            link = above[link].parent
        if chain != names[:i]:
            problem = (
                f"{shown(name)} is out of place: the URDF has {', '.join(chain) or 'no joint'} before it"
            )
            raise _toml_error(
                file, lines, ("joint", i, "name"), problem, "the joints of one serial chain, from base to tip"
            )


def _check_joint(
    i: int, joint: Joint, urdf_joint: UrdfJoint, file: Path, lines: TomlLines, urdf: Path
) -> None:
    if joint.kind != urdf_joint.kind:
        problem = f"{shown(joint.kind)} is {shown(urdf_joint.kind)} in {urdf.name}:{urdf_joint.line}"
        raise _toml_error(file, lines, ("joint", i, "kind"), problem, shown(urdf_joint.kind))
    bounds: list[tuple[KeyPath, float, str, int]] = [
        (("position", 0), joint.position[0], "lower", -1),
        (("position", 1), joint.position[1], "upper", 1),
        (("velocity",), joint.velocity, "velocity", 1),
        (("torque",), joint.torque, "effort", 1),
    ]
    for key, value, name, side in bounds:
        limit = urdf_joint.limits.get(name)
        if limit is not None and side * (value - limit) > LIMIT_TOLERANCE * abs(limit):
            problem = f"{value} is beyond {name}={limit} in {urdf.name}:{urdf_joint.line}"
            allowed = f"at {'most' if side > 0 else 'least'} {limit}"
            raise _toml_error(file, lines, ("joint", i, *key), problem, allowed)


def _toml_error(file: Path, lines: TomlLines, path: KeyPath, problem: str, allowed: str) -> RobotFileError:
    return RobotFileError(file, problem, line=lines.line_of(path), key=key_text(path), allowed=allowed)
