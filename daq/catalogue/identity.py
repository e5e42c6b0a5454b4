"""By what the catalogue knows an arm, out of a description, a session with its drives, or a recording."""

from __future__ import annotations

import json
from collections.abc import Sequence
from hashlib import sha256

from daq.catalogue.values import ArmIdentity
from daq.recording.capture import Capture
from drivers import DriveReport
from robots import Robot

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
    return ArmIdentity(
        name=robot.name,
        serials=tuple(drive.serial for drive in drives),
        description_sha256=sha256_of(robot.source_text),
        simulated=simulated,
    )


def identity_of_capture(capture: Capture) -> ArmIdentity:
    """Of the arm that a recording is of."""
    drives = json.loads(capture.run.get("drives", "[]"))
    return ArmIdentity(
        name=capture.robot_name,
        serials=tuple(drive.get("serial") for drive in drives),
        description_sha256=sha256_of(capture.robot_text),
        simulated=capture.run.get("kind") == SIMULATED,
    )


def sha256_of(text: str) -> str:
    """Checksum of a description's text, by which a file knows the arm that it was made for."""
    return sha256(text.encode()).hexdigest()
