"""What MuJoCo has of found effects: springs as tendons, drives as actuators."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree as ET

import numpy as np

from daq.exporting.elsewhere.arm import IdentifiedArm
from daq.exporting.elsewhere.found import BODIES, SPRINGS, TILT, FoundEffect, Spring, springs_of
from daq.exporting.elsewhere.frames import joint_frames, numbers
from robots.arrays import FloatArray

DRIVES = frozenset({"drive_gain_error", "current_loop_lag", "saturation"})
"""Of a drive that moves one joint alone: then that joint's actuator is the drive."""
_FAR = 1e6
"""rad (or m); the end of a dead band that no joint reaches."""


def not_in_mujoco(arm: IdentifiedArm) -> tuple[str, ...]:
    """A sentence for each found effect that the file does not hold."""
    held = BODIES | SPRINGS | DRIVES | {TILT}
    shared = tuple(one.sentence for one in arm.found if one.name in DRIVES and np.count_nonzero(one.row) > 1)
    return (*arm.lost(held), *shared)


def tendon_springs(root: ET.Element, arm: IdentifiedArm) -> None:
    """A tendon of its own for each spring, as one joint can have several."""
    springs = springs_of(arm.found)
    anchored = [one for one in arm.found if "spring" in one.values]
    if not springs and not anchored:
        return
    tendons = root.find("tendon")
    if tendons is None:
        tendons = ET.SubElement(root, "tendon")
    for spring in springs:
        tendon = ET.SubElement(
            tendons,
            "fixed",
            name=spring.label,
            stiffness=numbers([spring.stiffness, 0.0, spring.cubic]),
            springlength=_length(spring),
        )
        ET.SubElement(tendon, "joint", joint=arm.robot.joint[spring.axis].name, coef="1")
    for one in anchored:
        _between_anchors(root, tendons, arm, one)


def _length(spring: Spring) -> str:
    """At rest; of a contact the dead band before it."""
    ends = {0: [spring.rest], 1: [-_FAR, spring.rest], -1: [spring.rest, _FAR]}
    return numbers(ends[spring.side])


def _between_anchors(root: ET.Element, tendons: ET.Element, arm: IdentifiedArm, one: FoundEffect) -> None:
    """A spring from an anchor before the joint to one behind it, the fixed one 1 m off the axis."""
    axis, radius = one.joints[0], one.shape["moving_radius"]
    frame = joint_frames(arm.robot)[axis]
    across = np.cross(frame.axis, np.eye(3)[int(np.argmin(np.abs(frame.axis)))])
    across /= np.linalg.norm(across)
    turn = _turned(across, frame.axis, -one.shape["anchor_angle"])
    moving = _body(root, frame.link)
    before = _body(root, joint_frames(arm.robot)[axis - 1].link) if axis else root.find("worldbody")
    places = ((before, frame.position + frame.rotation @ across), (moving, radius * turn))
    tendon = ET.SubElement(
        tendons,
        "spatial",
        name=one.label,
        stiffness=repr(one.values["spring"] / radius),
        springlength=repr(one.shape["free_length"]),
    )
    for end, (body, position) in zip("ab", places, strict=True):
        if body is not None:
            ET.SubElement(body, "site", name=f"{one.label}_{end}", pos=numbers(position))
            ET.SubElement(tendon, "site", site=f"{one.label}_{end}")


def _body(root: ET.Element, link: str) -> ET.Element | None:
    return next((body for body in root.iter("body") if body.get("name") == link), None)


def _turned(vector: FloatArray, axis: FloatArray, angle: float) -> FloatArray:
    """A vector across an axis, turned about it."""
    return np.asarray(np.cos(angle) * vector + np.sin(angle) * np.cross(axis, vector))


def actuator(arm: IdentifiedArm, axis: int) -> dict[str, str]:
    """Attributes of a joint's actuator: force = gain · control − offset, the control limited and lagging.

    The control is the torque that the drive is thought to give by its control signal, as it was recorded.
    """
    own = [one for one in arm.found if one.name in DRIVES and np.count_nonzero(one.row) == 1]
    own = [one for one in own if one.joints == (axis,)]
    lag = sum(max(0.0, one.values.get("lag", 0.0)) for one in own)
    limits = [one.shape["torque_limit"] for one in own if one.name == "saturation"]
    attributes = {
        "gainprm": repr(_gain(own)),
        "biastype": "affine",
        "biasprm": numbers([-float(arm.offset[axis]), 0.0, 0.0]),
    }
    if lag:
        attributes |= {"dyntype": "filterexact", "dynprm": repr(lag)}
    if limits:
        # What lags is limited behind the lag.
        attributes["actrange" if lag else "ctrlrange"] = numbers([-min(limits), min(limits)])
    return attributes


def _gain(own: Sequence[FoundEffect]) -> float:
    """Of a drive that does not show a share of its torque."""
    share = sum(one.values.get("gain_error", 0.0) for one in own)
    return 1.0 / (1.0 - float(np.clip(share, -0.9, 0.9)))
