"""By what the catalogue knows an arm, out of a description, a session with its drives, or a recording."""

from __future__ import annotations

import json
from collections.abc import Sequence
from hashlib import sha256

from daq.catalogue.descriptions import Description
from daq.catalogue.values import ArmIdentity
from daq.recording.capture import Capture, CaptureError
from daq.recording.described_arm import parts_of_capture
from drivers import DriveReport
from robots import Robot
from robots.identity import description_sha256

SIMULATED = "simulated"
"""``kind`` in the records of a run on simulated drives."""


def identity_of_arm(
    robot: Robot, drives: Sequence[DriveReport] = (), *, simulated: bool = False
) -> ArmIdentity:
    """Of an arm with the drives that answered.

    Args:
        robot: its description.
        drives: what the set-up found, in the order of the axes; none where there is no bus.
        simulated: whether they are simulated ones.
    """
    parts = robot.parts
    return ArmIdentity(
        name=robot.name,
        serials=tuple(drive.serial for drive in drives),
        description_sha256=description_sha256(parts),
        simulated=simulated,
        parts=parts,
    )


def identity_of_capture(capture: Capture) -> ArmIdentity:
    """Of the arm that a recording is of."""
    parts = parts_of_capture(capture)
    return ArmIdentity(
        name=capture.robot_name,
        serials=_serials(capture),
        description_sha256=description_sha256(parts) if parts else sha256_of(capture.robot_text),
        simulated=capture.run.get("kind") == SIMULATED,
        parts=parts,
    )


def _serials(capture: Capture) -> tuple[int | None, ...]:
    """Serial numbers of the drives as a recording says."""
    try:
        found = [drive.get("serial") for drive in json.loads(capture.run.get("drives", "[]"))]
    except (ValueError, TypeError, AttributeError, RecursionError):
        found = ["?"]
    if not all(serial is None or type(serial) is int for serial in found):
        raise CaptureError(f"{capture.path}: its record of the drives is none; allowed: a list of identities")
    return tuple(found)


def description_of(robot: Robot) -> Description:
    """A description in use, with its parts."""
    return Description(description_sha256(robot.parts), robot.parts)


def sha256_of(text: str) -> str:
    """Checksum of a text, by which a file is known."""
    return sha256(text.encode()).hexdigest()
