"""Are recordings that are used together of one arm, and of the arm that they are read as?"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from daq.catalogue.identity import description_of, identity_of_capture
from daq.catalogue.values import ArmMismatch
from daq.importing.loaded import LoadedRecordings
from daq.recording.capture import Capture
from robots import Robot
from robots.identity import differing


def refuse_two_arms(loaded: Sequence[LoadedRecordings]) -> None:
    """Recordings of drives with other serial numbers make no model together.

    Raises:
        ArmMismatch: one line that names both recordings and the first drive that differs.
    """
    captures = [part.capture for part in loaded if part.capture is not None]
    for first, other in pairwise(captures):
        difference = _difference(first, other)
        if difference:
            raise ArmMismatch(f"{other.path}: is of another arm than {first.path}: {difference}")


def doubts_of_arm(
    loaded: Sequence[LoadedRecordings], held: Sequence[LoadedRecordings], robot: Robot
) -> list[str]:
    """What is to be said where recordings are of another arm, or version of it, than they are read as.

    Args:
        loaded: fitted to.
        held: predicted, and not fitted to.
        robot: the arm that they are read as.
    """
    doubts, now = [], description_of(robot)
    captures = [part.capture for part in (*loaded, *held) if part.capture is not None]
    for capture in captures:
        identity = identity_of_capture(capture)
        if identity.name != robot.name:
            doubts.append(f"{capture.path.name} is a recording of {identity.name}, read as {robot.name}")
        elif identity.description_sha256 != now.sha256:
            what = differing(identity.parts, now.parts)
            doubts.append(f"{capture.path.name} was recorded with another description: other {what}")
    fitted = [part.capture for part in loaded if part.capture is not None]
    for part in held:
        if fitted and part.capture is not None:
            difference = _difference(fitted[0], part.capture)
            if difference:
                doubts.append(f"{part.capture.path.name} is of another arm: {difference}")
    return doubts


def _difference(first: Capture, other: Capture) -> str:
    """The first drive that is another one, in words; empty where nothing says so."""
    pairs = zip(identity_of_capture(first).serials, identity_of_capture(other).serials, strict=False)
    for joint, (here, there) in enumerate(pairs, start=1):
        if here is not None and there is not None and here != there:
            return f"the drive of joint {joint} has serial number {there} there and {here} here"
    return ""
