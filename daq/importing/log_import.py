"""A log of somebody else as a capture of ours: everything after recording works on it as on our own."""

from __future__ import annotations

import json
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from daq.files.checksum import file_sha256
from daq.importing.import_map import ImportMap, load_import_map, settings_of
from daq.importing.load import log_recording
from daq.recording.capture import DESCRIPTION, IMPORT, RUN, TRAJECTORY, Capture, CaptureError
from daq.recording.joint_channels import KINDS
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from drivers.frames.samples import Samples
from ident import Recording
from robots import Robot
from robots.arrays import BoolArray, FloatArray

SUFFIX = ".capture.mcap"
_ROWS = 5000
"""Of one batch: a chunk of a few hundred kilobytes."""


@dataclass(frozen=True)
class Imported:
    """What came out.

    Attributes:
        source: the log.
        capture: the new capture.
        warnings: what was done to the samples, one sentence each.
    """

    source: Path
    capture: Capture
    warnings: tuple[str, ...]


def import_log(source: Path, robot: Robot, map_path: Path, out: Path, note: str = "") -> Imported:
    """Write a capture from a log and a column map.

    Args:
        source: a file or folder that a column map can describe.
        robot: the arm.
        map_path: the column map.
        out: the new file.
        note: the operator's.

    Raises:
        CaptureError: one line: a missing file or column, values that are not numbers, wrong lengths.
        ident.IdentificationError: time goes back, or there are too few samples.
    """
    if not source.exists():
        raise CaptureError(f"{source}: no such file")
    columns = load_import_map(map_path)
    settings = settings_of(columns, robot, map_path)
    recording, complete, warnings = log_recording(source, robot, columns, settings.cutoff_hz)
    facts = _facts(source, robot, map_path, columns, recording, warnings, note)
    has_reference = recording.reference is not None
    samples = _samples(recording, complete, float(facts[RUN]["period"]))
    beside = _beside(recording)
    with Recorder(out, robot, facts, start_ns=0, reference=has_reference) as recorder:
        for begin in range(0, len(samples), _ROWS):
            rows = slice(begin, begin + _ROWS)
            recorder.write(_part(samples, rows), {kind: values[rows] for kind, values in beside.items()})
        cycles = str(len(samples))
        recorder.finish({"outcome": "completed", "reason": f"imported from {source.name}", "cycles": cycles})
    return Imported(source, read_capture(out), warnings)


def _samples(recording: Recording, complete: BoolArray, period: float) -> Samples:
    rows, joints = recording.position.shape
    reference = recording.reference
    cycle = np.arange(rows, dtype=np.int64)
    return Samples(
        cycle=cycle,
        time=np.asarray(cycle * period, dtype=np.float64),
        reference=np.full((rows, joints), np.nan) if reference is None else reference,
        position=recording.position,
        control_signal=recording.control_signal,
        statusword=np.zeros((rows, joints), dtype=np.uint16),
        complete=complete,
        lateness=np.zeros(rows),
    )


def _beside(recording: Recording) -> dict[str, FloatArray]:
    """Its further channels, samples × joints each."""
    found = {kind: getattr(recording, kind) for kind in KINDS}
    return {kind: values for kind, values in found.items() if values is not None}


def _part(samples: Samples, rows: slice) -> Samples:
    return Samples(**{name: getattr(samples, name)[rows] for name in Samples.__dataclass_fields__})


def _facts(
    source: Path,
    robot: Robot,
    map_path: Path,
    columns: ImportMap,
    recording: Recording,
    warnings: tuple[str, ...],
    note: str,
) -> dict[str, dict[str, str]]:
    # The median of printed time stamps is off in its last digits; twelve of them are the period.
    period = float(f"{recording.sample_time:.12g}")
    run = {
        "period": repr(period),
        "kind": "imported",
        "reference": "absent" if recording.reference is None else "recorded",
        "beside": ", ".join(_beside(recording)),
        "versions": json.dumps({"armhil": version("armhil")}),
    }
    return {
        DESCRIPTION: {
            "name": robot.name,
            "robot.toml": robot.source_text,
            "urdf": robot.urdf_path.read_text(encoding="utf-8"),
            "joints": "\n".join(joint.name for joint in robot.joint),
        },
        RUN: run | ({"note": note} if note else {}),
        TRAJECTORY: {"family": "imported"},
        IMPORT: {
            "source": source.name,
            "source_sha256": file_sha256(source) if source.is_file() else "",
            "map": map_path.read_text(encoding="utf-8-sig"),
            "identification": json.dumps(columns.identification),
            "warnings": "\n".join(warnings),
        },
    }


def import_json(imported: Imported) -> dict[str, Any]:
    """As ``armhil import --json`` prints it."""
    capture = imported.capture
    return {
        "file": str(imported.source),
        "out": str(capture.path),
        "robot": capture.robot_name,
        "cycles": len(capture.samples),
        "seconds": len(capture.samples) * capture.period,
        "period": capture.period,
        "reference": capture.has_reference,
        "warnings": list(imported.warnings),
    }
