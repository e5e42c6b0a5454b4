"""A URDF with other inertias: each ``<inertial>`` is replaced, every other byte of the file stays.

URDF gives the inertia about the centre of mass, in the axes of ``<inertial><origin rpy=…>``; standard
parameters are about the joint frame, which is the frame of the joint's child link. The tensor is written in
the axes of the link (rpy = 0). Links that hang on a moving link by fixed joints move with it, and only the
whole can be identified: it is written to the moving link, and theirs are taken out.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

import numpy as np

from robots.arrays import FloatArray
from robots.description import Robot
from robots.errors import RobotFileError
from robots.pseudo_inertia import impossible_links
from robots.urdf import FIXED, UrdfJoint, read_urdf_joints
from robots.urdf_text import quoted

_TAG = re.compile(rb"""<(?:[^<>"']|"[^"]*"|'[^']*')*>""")
_TENSOR = ("ixx", "ixy", "iyy", "ixz", "iyz", "izz")


def urdf_with_links(robot: Robot, links: FloatArray, note: str = "") -> bytes:
    """The arm's URDF file with other inertias of its moving links.

    Args:
        robot: the arm.
        links: (n, 10) standard parameters of the moving links, each possible for a body.
        note: put in a comment at the top of the robot, e.g. where the figures come from.

    Raises:
        RobotFileError: the URDF cannot be read, is in an encoding without ASCII, or a link is no body.
    """
    impossible = impossible_links(links)
    moving = moving_links(robot)
    if impossible or not (links[:, 0] > 0).all():
        names = [moving[k] for k in impossible] or [moving[int(np.argmin(links[:, 0]))]]
        raise RobotFileError(
            robot.urdf_path,
            f"the inertia of {', '.join(names)} is none that a body can have",
            allowed="links of a physically consistent fit",
        )
    text = robot.urdf_path.read_bytes()
    places = _Places(text, robot.urdf_path)
    carried = _carried(robot, moving)
    changes: list[tuple[int, int, bytes]] = []
    for name, link in zip(moving, links, strict=True):
        changes += places.put(name, link)
        for other in carried[name]:
            changes += [(start, end, b"") for start, end in places.links[other].inertials]
    if note:
        comment = f"\n  <!-- {note.replace('--', '‐‐')} -->"
        changes.append((places.top, places.top, comment.encode()))
    for start, end, piece in sorted(changes, reverse=True):
        text = text[:start] + piece + text[end:]
    return text


def moving_links(robot: Robot) -> tuple[str, ...]:
    """The URDF's names of the links that the joints move, from base to tip, (n,)."""
    joints = {joint.name: joint.child for joint in read_urdf_joints(robot.urdf_path)}
    return tuple(joints[joint.name] for joint in robot.joint)


def _carried(robot: Robot, moving: tuple[str, ...]) -> dict[str, list[str]]:
    """Per moving link, the links that hang on it by fixed joints, directly or not."""
    joints = read_urdf_joints(robot.urdf_path)

    def hanging(link: str) -> list[str]:
        below: list[UrdfJoint] = [j for j in joints if j.parent == link and j.kind == FIXED]
        return [name for joint in below for name in (joint.child, *hanging(joint.child))]

    return {link: hanging(link) for link in moving}


def _inertial(link: FloatArray, indent: bytes) -> bytes:
    """``<inertial>`` of standard parameters (10,); floats are written so that they read back the same."""
    mass, center = float(link[0]), link[1:4] / link[0]
    xx, xy, yy, xz, yz, zz = link[4:]
    about_frame = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    tensor = about_frame - mass * (center @ center * np.eye(3) - np.outer(center, center))
    entries = tensor[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
    values = dict(zip(_TENSOR, entries.tolist(), strict=True))
    xyz = " ".join(repr(value) for value in center.tolist())
    lines = (
        "<inertial>",
        f"  <mass value={quoted(repr(mass))}/>",
        f"  <origin xyz={quoted(xyz)} rpy={quoted('0 0 0')}/>",
        "  <inertia " + " ".join(f"{name}={quoted(repr(value))}" for name, value in values.items()) + "/>",
        "</inertial>",
    )
    return (b"\n" + indent).join(line.encode() for line in lines)


@dataclass
class _Link:
    """Where a link stands in the file: its start tag, its end tag (where it has none: where the first ends),
    and its ``<inertial>`` elements."""

    start: int
    end: int
    inertials: list[tuple[int, int]]


class _Places:
    """Byte offsets of what is replaced."""

    def __init__(self, text: bytes, file: Path) -> None:
        self._text = text
        self.links: dict[str, _Link] = {}
        self.top = 0
        self._open: list[tuple[str, int]] = []
        self._name = ""
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._begin
        self._parser.EndElementHandler = self._finish
        if b"\0" in text:
            raise RobotFileError(
                file, "is in UTF-16", allowed="UTF-8 or another encoding that contains ASCII"
            )
        try:
            self._parser.Parse(text, True)
        except expat.ExpatError as error:
            raise RobotFileError(
                file, f"not XML: {expat.ErrorString(error.code)}", line=error.lineno
            ) from None

    def put(self, name: str, link: FloatArray) -> list[tuple[int, int, bytes]]:
        """The changes that give a link these standard parameters (10,): start, end, new text."""
        place = self.links[name]
        if place.inertials:
            (start, end), *others = place.inertials
            return [(start, end, _inertial(link, self._indent(start))), *((a, b, b"") for a, b in others)]
        indent = self._indent(place.start)
        piece = b"  " + _inertial(link, indent + b"  ") + b"\n" + indent
        after = self._tag_end(place.start)
        if place.end != after or self._text[after - 2 : after] != b"/>":
            return [(place.end, place.end, piece)]
        opened = self._text[place.start : after].rstrip(b">").rstrip(b"/").rstrip() + b">"
        return [(place.start, after, opened + b"\n" + indent + piece + b"</link>")]

    def _begin(self, tag: str, attributes: dict[str, str]) -> None:
        at = self._parser.CurrentByteIndex
        path = [name for name, _ in self._open] + [tag]
        self._open.append((tag, at))
        if len(path) == 1:
            self.top = self._tag_end(at)
        elif path[1:] == ["link"]:
            self._name = attributes.get("name", "")
            self.links[self._name] = _Link(at, at, [])

    def _finish(self, tag: str) -> None:
        at = self._parser.CurrentByteIndex
        _, start = self._open.pop()
        path = [name for name, _ in self._open] + [tag]
        if path[1:] == ["link"]:
            self.links[self._name].end = at
        elif path[1:] == ["link", "inertial"]:
            end = at if at == self._tag_end(start) else self._tag_end(at)
            self.links[self._name].inertials.append((start, end))

    def _tag_end(self, start: int) -> int:
        found = _TAG.match(self._text, start)
        assert found is not None  # the parser has just read it
        return found.end()

    def _indent(self, start: int) -> bytes:
        """The white space before a place, back to the beginning of its line."""
        line = self._text[self._text.rfind(b"\n", 0, start) + 1 : start]
        return line if not line.strip() else b"  "
