"""The arm of a command: the one that is named, or the one that a capture describes."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import robots
from daq.importing.load import CAPTURE_SUFFIX
from daq.recording.capture import Capture, CaptureError
from daq.recording.reader import read_capture
from robots import Robot


@contextmanager
def described(source: str | None, first: Path) -> Iterator[tuple[Robot, Capture | None]]:
    """The arm that was asked for, or the one that the first capture describes, with that capture.

    Args:
        source: name or path of the arm; None to take the capture's own description.
        first: the first capture or log.

    Raises:
        CaptureError: it is no capture, or its description cannot be unpacked.
        RobotFileError: no such arm, or its description is wrong.
    """
    if source is not None:
        yield robots.load(source), None
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
    (folder / "robot.toml").write_text(capture.robot_text, encoding="utf-8")
    urdf = (folder / str(tomllib.loads(capture.robot_text)["urdf"])).resolve()
    if not urdf.is_relative_to(folder.resolve()):
        raise CaptureError(f"{capture.path}: its description puts the URDF outside its folder; give --robot")
    urdf.parent.mkdir(parents=True, exist_ok=True)
    urdf.write_text(capture.urdf_text, encoding="utf-8")
    return robots.load(folder)
