"""A URDF as values: links with inertia and collision bodies, joints with limits, each with its line.

This is the one reading of the file. Pinocchio and coal are given what was read here (``robots.urdf_text``),
so nothing that they would read otherwise, or leave out with a warning, can come between.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from robots.errors import RobotFileError, shown
from robots.urdf_elements import MAX_BYTES, Element, parse_elements
from robots.urdf_rules import check_elements, numbers

FIXED = "fixed"
MOVING = ("revolute", "prismatic")
LIMITS = ("lower", "upper", "velocity", "effort")

Three = tuple[float, float, float]
_NOWHERE: Three = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Pose:
    """``<origin>``: m, and roll, pitch, yaw about the fixed axes, rad."""

    xyz: Three = _NOWHERE
    rpy: Three = _NOWHERE


@dataclass(frozen=True)
class UrdfInertial:
    """Mass, kg, and ixx ixy ixz iyy iyz izz, kg·m², about the centre of mass in the axes of ``pose``."""

    pose: Pose
    mass: float
    tensor: tuple[float, ...]
    line: int


@dataclass(frozen=True)
class UrdfBody:
    """One collision body: ``shape`` is box, cylinder, sphere or mesh.

    ``size`` is the edges of a box, radius and length of a cylinder, radius of a sphere, scale of a mesh;
    ``mesh`` the file's name as the URDF gives it.
    """

    shape: str
    size: tuple[float, ...]
    mesh: str
    pose: Pose
    line: int


@dataclass(frozen=True)
class UrdfLink:
    """One link."""

    name: str
    inertial: UrdfInertial | None
    bodies: tuple[UrdfBody, ...]
    line: int


@dataclass(frozen=True)
class UrdfJoint:
    """One joint; ``limits`` holds lower, upper, velocity and effort of one that moves."""

    name: str
    kind: str
    parent: str
    child: str
    pose: Pose
    axis: Three
    limits: dict[str, float]
    line: int


@dataclass(frozen=True, eq=False)
class Urdf:
    """A whole file, in its order; ``content`` is what was read. Read once, it is one object."""

    file: Path
    content: bytes
    name: str
    links: tuple[UrdfLink, ...]
    joints: tuple[UrdfJoint, ...]


def read_urdf(file: Path) -> Urdf:
    """Read a URDF strictly.

    Raises:
        RobotFileError: not XML, no URDF, an element or value that is not as it may be; with file and line.
    """
    return _read(_content(file), file)


def read_urdf_joints(file: Path) -> tuple[UrdfJoint, ...]:
    """All joints of a URDF in file order; raises as :func:`read_urdf`."""
    return read_urdf(file).joints


def _content(file: Path) -> bytes:
    try:
        with file.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise RobotFileError(file, f"cannot be read: {error.strerror}") from None
    if len(content) > MAX_BYTES:
        raise RobotFileError(file, f"larger than {MAX_BYTES} bytes", allowed="a URDF file")
    return content


@lru_cache(maxsize=32)
def _read(content: bytes, file: Path) -> Urdf:
    root = parse_elements(content, file)
    check_elements(root, file)
    links = tuple(_link(element) for element in root.of("link"))
    joints = tuple(_joint(element, file) for element in root.of("joint"))
    _names_differ(links, file)
    _check_tree({link.name: link.line for link in links}, joints, file)
    return Urdf(file, content, root.attributes["name"], links, joints)


def _link(element: Element) -> UrdfLink:
    inertial = element.child("inertial")
    bodies = tuple(_body(collision) for collision in element.of("collision"))
    name = element.attributes["name"]
    return UrdfLink(name, None if inertial is None else _inertial(inertial), bodies, element.line)


def _inertial(element: Element) -> UrdfInertial:
    mass, inertia = element.child("mass"), element.child("inertia")
    assert mass is not None  # the rules have seen it
    assert inertia is not None
    tensor = tuple(numbers(inertia, name)[0] for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    return UrdfInertial(_pose(element), numbers(mass, "value")[0], tensor, element.line)


def _body(element: Element) -> UrdfBody:
    geometry = element.child("geometry")
    assert geometry is not None
    (shape,) = geometry.children
    size: tuple[float, ...]
    if shape.tag == "mesh":
        size = numbers(shape, "scale") if "scale" in shape.attributes else (1.0, 1.0, 1.0)
    elif shape.tag == "cylinder":
        size = (*numbers(shape, "radius"), *numbers(shape, "length"))
    else:
        size = numbers(shape, "size" if shape.tag == "box" else "radius")
    return UrdfBody(shape.tag, size, shape.attributes.get("filename", ""), _pose(element), element.line)


def _pose(element: Element) -> Pose:
    origin = element.child("origin")
    if origin is None:
        return Pose()
    return Pose(*(_three(origin, name) if name in origin.attributes else _NOWHERE for name in ("xyz", "rpy")))


def _three(element: Element, name: str) -> Three:
    x, y, z = numbers(element, name)
    return x, y, z


def _joint(element: Element, file: Path) -> UrdfJoint:
    name, kind = element.attributes["name"], element.attributes["type"]
    key = f'joint "{name}"'
    if kind not in (*MOVING, FIXED):
        allowed = f"{', '.join(MOVING)} or {FIXED}"
        problem = f"{shown(kind)} is not a type that can be identified"
        raise RobotFileError(file, problem, line=element.line, key=key, allowed=allowed)
    parent, child, limit = element.child("parent"), element.child("child"), element.child("limit")
    assert parent is not None
    assert child is not None
    moves = kind in MOVING
    return UrdfJoint(
        name=name,
        kind=kind,
        parent=parent.attributes["link"],
        child=child.attributes["link"],
        pose=_pose(element),
        axis=_axis(element, key, file) if moves else (1.0, 0.0, 0.0),
        limits=_limits(element, key, file) if moves else {},
        line=element.line if limit is None else limit.line,
    )


def _axis(element: Element, key: str, file: Path) -> Three:
    axis = element.child("axis")
    if axis is None:
        problem, line = "has no <axis>", element.line
    else:
        xyz = _three(axis, "xyz")
        length = sum(value * value for value in xyz) ** 0.5
        if abs(length - 1.0) <= 1e-3:
            return (xyz[0] / length, xyz[1] / length, xyz[2] / length)
        problem, line = f"{shown(axis.attributes['xyz'])} is not of length 1", axis.line
    raise RobotFileError(file, problem, line=line, key=f"{key} <axis>", allowed='xyz="…" of length 1')


def _limits(element: Element, key: str, file: Path) -> dict[str, float]:
    limit = element.child("limit")
    if limit is None:
        raise RobotFileError(
            file, "has no <limit>", line=element.line, key=key, allowed=f"all of {_each(LIMITS)}"
        )
    missing = [name for name in LIMITS if name not in limit.attributes]
    if missing:
        problem = f"<limit> has no {_each(missing)}"
        raise RobotFileError(file, problem, line=limit.line, key=key, allowed=f"all of {_each(LIMITS)}")
    found = {name: numbers(limit, name)[0] for name in LIMITS}
    if found["lower"] >= found["upper"]:
        problem = f"lower={found['lower']:g} is not below upper={found['upper']:g}"
        raise RobotFileError(file, problem, line=limit.line, key=f"{key} <limit>", allowed="lower < upper")
    return found


def _each(names: tuple[str, ...] | list[str]) -> str:
    return ", ".join(f'{name}="…"' for name in names)


def _names_differ(links: tuple[UrdfLink, ...], file: Path) -> None:
    seen: dict[str, int] = {}
    for link in links:
        if link.name in seen:
            problem = f"appears twice, first in line {seen[link.name]}"
            key = f'link "{link.name}"'
            raise RobotFileError(file, problem, line=link.line, key=key, allowed="a name of its own")
        seen[link.name] = link.line


def _check_tree(links: dict[str, int], joints: tuple[UrdfJoint, ...], file: Path) -> None:
    """Every joint joins two links of the file, and the links make one tree."""
    child_links: set[str] = set()
    names: set[str] = set()
    for joint in joints:
        key = f'joint "{joint.name}"'
        for link in (joint.parent, joint.child):
            if link not in links:
                raise RobotFileError(
                    file,
                    f"{shown(link)} is not a link of this file",
                    line=joint.line,
                    key=key,
                    allowed=", ".join(links),
                )
        if joint.child in child_links:
            raise RobotFileError(file, f"{shown(joint.child)} hangs on two joints", line=joint.line, key=key)
        if joint.name in names:
            raise RobotFileError(file, "appears twice", line=joint.line, key=key)
        child_links.add(joint.child)
        names.add(joint.name)
    roots = [link for link in links if link not in child_links]
    connected = set(roots)
    while grown := {joint.child for joint in joints if joint.parent in connected} - connected:
        connected |= grown
    if len(roots) != 1 or len(connected) != len(links):
        loose = roots[1:] or sorted(set(links) - connected)
        raise RobotFileError(
            file,
            f"not one tree: {', '.join(loose) or 'no link'} apart from it",
            line=links[loose[0]] if loose else 1,
            allowed="links that hang on one base, each named once",
        )
