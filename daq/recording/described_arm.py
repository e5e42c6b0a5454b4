"""The arm of a command: the one that is named, or the one that a capture describes."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import robots
from daq.recording.capture import CAPTURE_SUFFIX, DESCRIPTION, MESHES, Capture, CaptureError
from daq.recording.reader import read_capture
from robots import Robot, RobotFileError
from robots.errors import UserError, one_line


@contextmanager
def described(source: str | Robot | None, first: Path) -> Iterator[tuple[Robot, Capture | None]]:
    """The arm that was asked for, or the one that the first capture describes, with that capture.

    Args:
        source: name or path of the arm, or the arm; None to take the capture's own description.
        first: the first capture or log.

    Raises:
        CaptureError: it is no capture, or its description cannot be unpacked.
        RobotFileError: no such arm, or its description is wrong.
    """
    if source is not None:
        yield source if isinstance(source, Robot) else robots.load(source), None
        return
    if first.suffix.lower() != CAPTURE_SUFFIX:
        raise CaptureError(f"{first}: is no capture, so it does not say of which arm it is; give --robot")
    capture = read_capture(first)
    with TemporaryDirectory(prefix="armhil-") as folder:
        yield robot_of(capture, Path(folder)), capture


def robot_of(capture: Capture, folder: Path) -> Robot:
    """The arm as its capture describes it; its files are unpacked into a folder.

    Raises:
        CaptureError: the description puts a file outside the folder.
        RobotFileError: the description is wrong.
    """
    try:
        name = tomllib.loads(capture.robot_text).get("urdf")
        urdf = (folder / (name if isinstance(name, str) else "")).resolve()
        own = folder.resolve()
        if not urdf.is_relative_to(own) or urdf in (own, own / "robot.toml"):
            raise CaptureError(
                f"{capture.path}: its description puts the URDF outside its folder; give --robot"
            )
        (folder / "robot.toml").write_text(capture.robot_text, encoding="utf-8")
        urdf.parent.mkdir(parents=True, exist_ok=True)
        urdf.write_text(capture.urdf_text, encoding="utf-8")
    except (ValueError, OSError, RecursionError) as error:
        if isinstance(error, UserError):
            raise
        reason = one_line(str(error))[:200]
        raise CaptureError(
            f"{capture.path}: its description cannot be unpacked: {reason}; give --robot"
        ) from None
    return robots.load(folder, known_meshes=mesh_checksums_of(capture))


def mesh_checksums_of(capture: Capture) -> dict[str, str]:
    """Checksums of the meshes of a capture's URDF, by the names in it; the meshes themselves are not kept."""
    try:
        found = json.loads(capture.records.get(DESCRIPTION, {}).get(MESHES, "{}"))
    except ValueError:
        return {}
    return {str(name): str(checksum) for name, checksum in found.items()} if isinstance(found, dict) else {}


def parts_of_capture(capture: Capture) -> dict[str, str]:
    """Checksums of the parts of the description in a capture; empty where it cannot be read any more."""
    with TemporaryDirectory(prefix="armhil-") as folder:
        try:
            return robot_of(capture, Path(folder)).parts
        except (RobotFileError, CaptureError):
            return {}
