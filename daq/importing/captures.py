"""Our own captures as recordings that ident reads."""

from __future__ import annotations

import json
import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from daq.importing.import_map import merged_settings
from daq.importing.loaded import LoadedRecordings
from daq.importing.pieces import long_pieces
from daq.recording.capture import IMPORT, Capture, select
from daq.recording.errors import CaptureError
from daq.recording.reader import read_capture
from drivers.cia402.states import INTERNAL_LIMIT_BIT
from ident import Recording
from ident.identification.second_encoder import words_of_second
from ident.listing import listed
from robots import Identification, Robot

log = logging.getLogger(__name__)


def load_capture(path: Path, robot: Robot) -> LoadedRecordings:
    """Read a capture for the given arm.

    Raises:
        CaptureError: not readable, of an arm with other joints, or without a piece that is long enough.
    """
    return loaded_capture(read_capture(path), robot)


def loaded_capture(capture: Capture, robot: Robot) -> LoadedRecordings:
    """A capture that was read, for the given arm.

    Raises:
        CaptureError: of an arm with other joints, or without a piece that is long enough.
    """
    path = capture.path
    joints = tuple(joint.name for joint in robot.joint)
    if capture.joints != joints:
        raise CaptureError(
            f"{path}: recorded of {capture.robot_name} with the joints {listed(capture.joints)};"
            f" {robot.name} has {listed(joints)}"
        )
    recordings, dropped = _pieces(capture)
    sentences = (*capture.damage.sentences(capture.period), *_limited(capture))
    warnings = [f"{path}: {sentence}" for sentence in sentences]
    settings = imported_settings(capture, robot)
    seen = (words_of_second(robot, one, settings.cutoff_hz) for one in recordings[:1])
    said = (*warnings, *filter(None, [dropped]), *(words for each in seen for words in each))
    return LoadedRecordings(path, recordings, settings, capture, said)


def _limited(capture: Capture) -> list[str]:
    """Drives whose own limits acted: there the control signal is not what the controller asked for."""
    counts = (np.asarray(capture.samples.statusword) & INTERNAL_LIMIT_BIT != 0).sum(axis=0)
    return [
        f"a limit inside drive {k + 1} acted in {count} cycles (statusword bit 11)"
        for k, count in enumerate(counts)
        if count
    ]


def imported_settings(capture: Capture, robot: Robot) -> Identification:
    """The robot's settings; in a capture that was made of a log, with those of its column map in place.

    Raises:
        CaptureError: what the capture holds of the map makes no sense.
    """
    kept = capture.records.get(IMPORT, {}).get("identification")
    if kept is None:
        return robot.identification
    try:
        overrides = json.loads(kept)
    except ValueError:
        raise CaptureError(f"{capture.path}: {IMPORT}: identification is not JSON") from None
    if not isinstance(overrides, dict):
        raise CaptureError(f"{capture.path}: {IMPORT}: identification is no table")
    return merged_settings(overrides, robot, capture.path)


def capture_recordings(capture: Capture) -> tuple[Recording, ...]:
    """The uninterrupted pieces of a capture. Gaps are not filled: each piece is a recording of its own.

    Pieces shorter than ``SHORTEST_PIECE`` are left out, and the log says so.

    Raises:
        CaptureError: no piece is long enough.
    """
    recordings, dropped = _pieces(capture)
    if dropped:
        log.warning(dropped)
    return recordings


def _pieces(capture: Capture) -> tuple[tuple[Recording, ...], str]:
    """The pieces that are long enough, and a sentence on those that are not (empty where all are)."""
    segments = capture.segment_rows()

    def make(number: int, name: str) -> Recording:
        found = select(capture.samples, segments[number])
        reference = found.reference if capture.has_reference else None
        recording = Recording(name, found.time, reference, found.position, found.control_signal)
        beside: dict[str, Any] = {kind: part[segments[number]] for kind, part in capture.beside.items()}
        return replace(recording, **beside)

    return long_pieces(capture.path, [len(segment) for segment in segments], capture.period, make)
