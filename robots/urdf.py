"""The kinematic skeleton of a URDF with the line of every element, read with the standard library.

Pinocchio builds the model; this reader exists to say *where* a URDF is wrong before Pinocchio meets it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from robots.errors import RobotFileError, shown

FIXED = "fixed"
MOVING = ("revolute", "prismatic")

_NUMBERS = {
    ("origin", "xyz"): 3,
    ("origin", "rpy"): 3,
    ("axis", "xyz"): 3,
    ("mass", "value"): 1,
    **{("inertia", name): 1 for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")},
    **{("limit", name): 1 for name in ("lower", "upper", "velocity", "effort")},
}


@dataclass
class Element:
    """One XML element and the line where it begins."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)

    def child(self, tag: str) -> Element | None:
        return next((child for child in self.children if child.tag == tag), None)


@dataclass(frozen=True)
class UrdfJoint:
    """One joint; ``limits`` holds what the file states of lower, upper, velocity and effort."""

    name: str
    kind: str
    parent: str
    child: str
    limits: dict[str, float]
    line: int


def read_urdf_joints(file: Path) -> tuple[UrdfJoint, ...]:
    """All joints of a URDF in file order, their attributes checked.

    Raises:
        RobotFileError: not XML, not a URDF, or a joint without what a joint needs; with file and line.
    """
    root = _parse(file)
    if root.tag != "robot":
        raise RobotFileError(
            file, f"<{root.tag}> is not a URDF", line=root.line, allowed="<robot> at the top"
        )
    _check_numbers(root, file)
    links = [_attribute(link, "name", file) for link in root.children if link.tag == "link"]
    joints = tuple(_joint(element, file) for element in root.children if element.tag == "joint")
    _check_tree(links, joints, file)
    return joints


def _parse(file: Path) -> Element:
    top = Element("", {}, 0)
    stack = [top]
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, parser.CurrentLineNumber)
        stack[-1].children.append(element)
        stack.append(element)

    def end(_tag: str) -> None:
        stack.pop()

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    try:
        parser.Parse(file.read_bytes(), True)
    except OSError as error:
        raise RobotFileError(file, f"cannot be read: {error.strerror}") from None
    except expat.ExpatError as error:
        problem = f"not XML: {expat.ErrorString(error.code)} at column {error.offset + 1}"
        raise RobotFileError(file, problem, line=error.lineno, allowed="a URDF file") from None
    return top.children[0]


def _check_numbers(root: Element, file: Path) -> None:
    pending = [root]
    while pending:
        element = pending.pop()
        pending += reversed(element.children)
        for name, text in element.attributes.items():
            count = _NUMBERS.get((element.tag, name))
            if count is not None and not _are_numbers(text, count):
                allowed = "a number" if count == 1 else f"{count} numbers"
                key = f"<{element.tag} {name}>"
                raise RobotFileError(
                    file, f"{shown(text)} is not {allowed}", line=element.line, key=key, allowed=allowed
                )


def _are_numbers(text: str, count: int) -> bool:
    try:
        values = [float(part) for part in text.split()]
    except ValueError:
        return False
    return len(values) == count and all(math.isfinite(value) for value in values)


def _joint(element: Element, file: Path) -> UrdfJoint:
    name = _attribute(element, "name", file)
    kind = _attribute(element, "type", file)
    if kind not in (*MOVING, FIXED):
        raise RobotFileError(
            file,
            f"{shown(kind)} is not a type that can be identified",
            line=element.line,
            key=f'joint "{name}"',
            allowed=f"{', '.join(MOVING)} or {FIXED}",
        )
    limits = {}
    limit = element.child("limit")
    if kind in MOVING and limit is None:
        raise RobotFileError(file, "has no <limit>", line=element.line, key=f'joint "{name}"')
    if limit is not None:
        limits = {key: float(value) for key, value in limit.attributes.items() if ("limit", key) in _NUMBERS}
    return UrdfJoint(
        name=name,
        kind=kind,
        parent=_link_of(element, "parent", name, file),
        child=_link_of(element, "child", name, file),
        limits=limits,
        line=element.line if limit is None else limit.line,
    )


def _link_of(element: Element, role: str, joint: str, file: Path) -> str:
    child = element.child(role)
    if child is None:
        raise RobotFileError(file, f"has no <{role}>", line=element.line, key=f'joint "{joint}"')
    return _attribute(child, "link", file)


def _attribute(element: Element, name: str, file: Path) -> str:
    value = element.attributes.get(name)
    if not value:
        raise RobotFileError(file, f'<{element.tag}> has no {name}="…"', line=element.line)
    return value


def _check_tree(links: list[str], joints: tuple[UrdfJoint, ...], file: Path) -> None:
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
        loose = ", ".join(roots[1:] or sorted(set(links) - connected)) or "no link"
        raise RobotFileError(
            file,
            f"not one tree: {loose} apart from it",
            allowed="links that hang on one base, each named once",
        )
