"""Any serial arm's URDF, read for what a log needs: the chain of moving joints, their limits, the bodies.

Files as they are published name meshes that are not at hand, joints without limits, grippers and continuous
axes. For driving an arm all that is refused (``robots.urdf``); to read logs it is put right here and said,
and the text that comes out passes the strict reader.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from robots.arrays import FloatArray
from robots.errors import RobotFileError
from robots.urdf_elements import MAX_BYTES, Element, parse_elements
from robots.urdf_pose import angles_of, body_text, exact_angle, origin_text, rotation_of

_SAFE = re.compile(r"[^a-z0-9_-]+")


@dataclass(frozen=True)
class LooseJoint:
    """One joint; limits are None where the file has none."""

    name: str
    kind: str
    parent: str
    child: str
    pose: FloatArray
    axis: FloatArray
    position: tuple[float, float] | None
    velocity: float | None
    effort: float | None


@dataclass(frozen=True)
class LooseUrdf:
    """A URDF for reading logs.

    Attributes:
        file: where it was read.
        name: as robot.toml may say it.
        joints: all of the chain from the base to the tip, fixed ones included.
        inertials: link → ``<inertial>`` as text; only bodies that can exist.
        words: what was put right, one sentence each.
        has_masses: whether every moving link of the file has a mass, itself or behind it.
    """

    file: Path
    name: str
    joints: tuple[LooseJoint, ...]
    inertials: dict[str, str]
    words: tuple[str, ...]
    has_masses: bool

    @property
    def moving(self) -> tuple[LooseJoint, ...]:
        """From base to tip."""
        return tuple(joint for joint in self.joints if joint.kind != "fixed")


def read_loose_urdf(file: Path) -> LooseUrdf:
    """Read a URDF for logs.

    Raises:
        RobotFileError: no XML, no URDF, xacro, no moving joint, or one of another kind.
    """
    root = _root(file)
    words: list[str] = []
    joints = [_joint(element, file) for element in root.of("joint")]
    chain = _longest_chain(joints, file)
    aside = [j.name for j in joints if j.kind != "fixed" and j not in chain]
    if aside:
        words.append(f"{file.name}: {', '.join(aside)} beside the longest chain: held still")
    elements = {link.attributes.get("name", ""): link.child("inertial") for link in root.of("link")}
    kept, inertials, massless = _with_rigid(joints, chain), dict[str, str](), list[str]()
    for joint in kept:
        text, said = _inertial(elements.get(joint.child))
        if said:
            words.append(f"{file.name}: link {joint.child}: {said}")
        inertials[joint.child] = text
    for joint in (joint for joint in chain if joint.kind != "fixed"):
        if not any(inertials[link] for link in _carried(joint, kept)):
            massless.append(joint.child)
            inertials[joint.child] = body_text(1.0, np.zeros(3))
    if massless:
        words.append(
            f"{file.name}: no mass in {', '.join(massless)}: 1 kg stands in, which the fit does not use"
        )
    name = _SAFE.sub("_", root.attributes.get("name", "").lower()).strip("_-") or "arm"
    name = name if name[0].isalpha() else f"arm_{name}"
    return LooseUrdf(file, name, kept, inertials, tuple(words), not massless)


def _root(file: Path) -> Element:
    try:
        content = file.read_bytes()[: MAX_BYTES + 1]
    except OSError as error:
        raise RobotFileError(file, f"cannot be read: {error.strerror}") from None
    root = parse_elements(content, file)
    if root.tag != "robot":
        raise RobotFileError(
            file, f"<{root.tag}> is not a URDF", line=root.line, allowed="<robot> at the top"
        )
    xacro = next((child for child in root.children if child.tag.startswith("xacro:")), None)
    if xacro is not None:
        raise RobotFileError(
            file, "is xacro, not yet a URDF", line=xacro.line, allowed="the output of `xacro`"
        )
    return root


def _numbers(
    element: Element | None, key: str, default: str, file: Path, read: Callable[[str], float] = float
) -> FloatArray:
    text = default if element is None else element.attributes.get(key, default)
    try:
        values = np.array([read(part) for part in text.split()])
    except ValueError:
        values = np.array([np.nan])
    if values.size != len(default.split()) or not np.isfinite(values).all():
        line = None if element is None else element.line
        raise RobotFileError(file, f'{key}="{text[:60]}" is not {len(default.split())} numbers', line=line)
    return values


def _joint(element: Element, file: Path) -> LooseJoint:
    name, kind = element.attributes.get("name", ""), element.attributes.get("type", "")
    mimic = element.child("mimic") is not None
    if kind not in ("revolute", "prismatic", "fixed", "continuous"):
        allowed = "revolute, continuous, prismatic or fixed"
        raise RobotFileError(
            file, f'type "{kind}"', line=element.line, key=f'joint "{name}"', allowed=allowed
        )
    origin, limit, axis = element.child("origin"), element.child("limit"), element.child("axis")
    pose = np.eye(4)
    pose[:3, 3] = _numbers(origin, "xyz", "0 0 0", file)
    pose[:3, :3] = rotation_of(_numbers(origin, "rpy", "0 0 0", file, exact_angle))
    direction = _numbers(axis, "xyz", "1 0 0", file)
    length = float(np.linalg.norm(direction))
    if length == 0 and kind != "fixed":
        raise RobotFileError(file, "its <axis> is 0 0 0", line=element.line, key=f'joint "{name}"')
    keys = ("lower", "upper", "velocity", "effort")
    lower, upper, velocity, effort = (float(_numbers(limit, key, "0", file)[0]) for key in keys)
    parent, child = element.child("parent"), element.child("child")
    if parent is None or child is None:
        raise RobotFileError(file, "has no <parent> or no <child>", line=element.line, key=f'joint "{name}"')
    return LooseJoint(
        name=name,
        kind="fixed" if mimic or kind == "fixed" else ("revolute" if kind == "continuous" else kind),
        parent=parent.attributes.get("link", ""),
        child=child.attributes.get("link", ""),
        pose=pose,
        axis=direction / (length or 1.0),
        position=(lower, upper) if lower < upper and kind != "continuous" else None,
        velocity=velocity if velocity > 0 else None,
        effort=effort if effort > 0 else None,
    )


def _longest_chain(joints: list[LooseJoint], file: Path) -> tuple[LooseJoint, ...]:
    """The joints from base to that tip which most moving joints carry."""
    above = {joint.child: joint for joint in joints}
    best: tuple[LooseJoint, ...] = ()
    for tip in joints:
        chain, link = [tip], tip.parent
        while link in above and len(chain) <= len(joints):
            chain.insert(0, above[link])
            link = above[link].parent
        if _count(tuple(chain)) > _count(best):
            best = tuple(chain)
    if not best:
        raise RobotFileError(file, "has no moving joint", allowed="revolute, continuous or prismatic joints")
    return best


def _count(chain: tuple[LooseJoint, ...]) -> int:
    return sum(joint.kind != "fixed" for joint in chain)


def _with_rigid(joints: list[LooseJoint], chain: tuple[LooseJoint, ...]) -> tuple[LooseJoint, ...]:
    """The chain and all that hangs on it, held still: a gripper's fingers are a mass, not an axis."""
    kept, links = list(chain), {joint.child for joint in chain} | {chain[0].parent}
    while more := [j for j in joints if j.parent in links and j.child not in links]:
        kept += [LooseJoint(**{**j.__dict__, "kind": "fixed"}) for j in more]
        links |= {joint.child for joint in more}
    return tuple(kept)


def _carried(joint: LooseJoint, kept: tuple[LooseJoint, ...]) -> list[str]:
    """The link behind a joint and those fixed to it."""
    links, grown = [joint.child], True
    while grown:
        more = [j.child for j in kept if j.kind == "fixed" and j.parent in links and j.child not in links]
        links += more
        grown = bool(more)
    return links


def _inertial(element: Element | None) -> tuple[str, str]:
    """``<inertial>`` of a body that can exist (empty where there is none), and what was put right."""
    if element is None or element.child("mass") is None:
        return "", ""
    try:
        mass = _value(element.child("mass"), "value", "nan")[0]
        center, rpy = (np.array(_value(element.child("origin"), key, "0 0 0")) for key in ("xyz", "rpy"))
        tensor = element.child("inertia")
        values = [_value(tensor, key, "0")[0] for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")]
    except ValueError:
        return "", "its <inertial> is not numbers and is left out"
    if not (np.isfinite([mass, *center, *rpy, *values]).all() and 1e-6 <= mass <= 1e4):
        return "", "" if mass == 0 else f"a mass of {mass:g} kg is left out"
    a, b, c, d, e, f = values
    moments = np.linalg.eigvalsh(np.array([[a, b, c], [b, d, e], [c, e, f]]))
    can_be = moments[0] > 1e-8 * mass and moments[2] <= moments[0] + moments[1] and moments[2] < 100 * mass
    if not can_be:
        return body_text(mass, center), "no body has its inertia tensor; that of a small ball stands in"
    return body_text(mass, center, rpy, values), ""


def _value(element: Element | None, key: str, default: str) -> list[float]:
    text = default if element is None else element.attributes.get(key, default)
    values = [float(part) for part in text.split()]
    if len(values) != len(default.split()):
        raise ValueError(text)
    return values


Limits = tuple[float, float, float, float]


def strict_text(urdf: LooseUrdf, limits: dict[str, Limits], held: dict[str, float]) -> str:
    """The URDF as the strict reader takes it: the chain, the bodies, no shapes.

    Args:
        urdf: the arm.
        limits: of each joint that moves: lower, upper, velocity, effort.
        held: joint → position in rad (or m) at which it is fixed, of the other moving ones.
    """
    root = urdf.joints[0].parent
    lines = ['<?xml version="1.0"?>', f'<robot name="{urdf.name}">', f'  <link name="{root}"/>']
    for joint in urdf.joints:
        pose = joint.pose if joint.name not in held else joint.pose @ _moved(joint, held[joint.name])
        origin = f"<origin {origin_text(pose[:3, 3], angles_of(pose[:3, :3]))}/>"
        ends = f'<parent link="{joint.parent}"/><child link="{joint.child}"/>{origin}'
        kind, more = "fixed", ""
        if joint.name in limits:
            kind, (lower, upper, velocity, effort) = joint.kind, limits[joint.name]
            axis = " ".join(repr(float(x)) for x in joint.axis)
            more = f'<axis xyz="{axis}"/><limit lower="{lower!r}" upper="{upper!r}"'
            more += f' velocity="{velocity!r}" effort="{effort!r}"/>'
        lines.append(f'  <joint name="{joint.name}" type="{kind}">{ends}{more}</joint>')
        lines.append(f'  <link name="{joint.child}">{urdf.inertials[joint.child]}</link>')
    return "\n".join([*lines, "</robot>", ""])


def _moved(joint: LooseJoint, position: float) -> FloatArray:
    moved = np.eye(4)
    if joint.kind == "prismatic":
        moved[:3, 3] = position * joint.axis
    else:
        cross = np.cross(np.eye(3), joint.axis)
        moved[:3, :3] += np.sin(position) * cross + (1 - np.cos(position)) * cross @ cross
    return moved
