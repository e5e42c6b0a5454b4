"""Write what a capture holds in the form of other programs."""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from daq.exporting.raw_frames import write_frames
from daq.exporting.rosbag2 import write_rosbag2
from daq.exporting.tables import (
    flat_name,
    import_map,
    matlab_name,
    quantities,
    write_csv,
    write_mat,
    write_parquet,
)
from daq.files.toml_text import toml_text
from daq.recording.capture import Capture, CaptureError
from daq.recording.described_arm import described
from daq.recording.reader import read_capture

Format = Literal["csv", "parquet", "mat", "rosbag2", "urdf", "blf", "asc"]
FORMATS = get_args(Format)
_TABLES = ("csv", "parquet", "mat")
_FRAMES = ("blf", "asc")
BAG = "rosbag2"
MAP_SUFFIX = ".import.toml"


@dataclass(frozen=True)
class Exported:
    """What was written.

    Attributes:
        path: the file; the folder of a rosbag2.
        rows: samples or frames in it; None for a URDF.
        map: the column map that reads it back; None where there is none.
        warnings: what the capture lacks, one sentence each.
    """

    path: Path
    rows: int | None
    map: Path | None
    warnings: tuple[str, ...]


def export_capture(source: Path, kind: str, out: Path | None = None) -> Exported:
    """Export one capture.

    Args:
        source: the capture.
        kind: one of FORMATS.
        out: the new file; beside the capture where None.

    Raises:
        CaptureError: no such format, not a capture, nothing of that kind in it, or ``out`` exists or cannot
            be written.
    """
    if kind not in FORMATS:
        raise CaptureError(f"--format {kind!r} is not known; allowed: {', '.join(FORMATS)}")
    capture = read_capture(source, allow_empty=kind not in (*_TABLES, BAG))
    path = out if out is not None else source.with_suffix("" if kind == BAG else f".{kind}")
    if kind == BAG and out is None:
        path = path.with_name(f"{path.name}-{BAG}")
    _refuse_overwriting(path)
    rows, map_path = None, None
    try:
        if kind in _TABLES:
            rows, map_path = _write_table(capture, kind, path)
        elif kind == BAG:
            with described(None, capture.path) as (robot, _):
                rows = write_rosbag2(path, capture, robot)
        elif kind in _FRAMES:
            rows = _write_raw_frames(capture, kind, path)
        else:
            path.write_text(capture.urdf_text, encoding="utf-8")
    except BaseException as error:
        # Neither was there before: see above.
        if path.is_dir():
            shutil.rmtree(path)
        path.unlink(missing_ok=True)
        map_of(path).unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise CaptureError(f"{path}: cannot be written: {error.strerror or error}") from error
        raise
    return Exported(path, rows, map_path, capture.damage.sentences(capture.period))


def map_of(path: Path) -> Path:
    """The column map of a table: one for each format, so that several go into one folder."""
    return path.with_name(path.name + MAP_SUFFIX)


def _refuse_overwriting(path: Path) -> None:
    for taken in (path, map_of(path)):
        if taken.exists():
            raise CaptureError(f"{taken}: exists already; choose another --out")


def _write_table(capture: Capture, kind: str, path: Path) -> tuple[int, Path]:
    with described(None, capture.path) as (robot, _):
        table = quantities(capture, robot)
    name = matlab_name(capture.joints) if kind == "mat" else flat_name(capture.joints)
    with path.open("xb") as file:
        if kind == "csv":
            write_csv(file, table, capture.joints)
        elif kind == "parquet":
            write_parquet(path, file, table, capture.joints)
        else:
            write_mat(path, table)
    map_path = map_of(path)
    comment = f"# Reads {path.name} back: armhil import {path.name} --robot ARM --columns {map_path.name}\n"
    map_path.write_text(comment + toml_text(import_map(capture, robot, name)), encoding="utf-8")
    return len(capture.samples), map_path


def _write_raw_frames(capture: Capture, kind: str, path: Path) -> int:
    if not capture.frames:
        raise CaptureError(f"{capture.path}: holds no raw frames, so there is nothing for .{kind}")
    # python-can takes the kind from the end of the name, and writes in place.
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        made = Path(folder) / f"frames.{kind}"
        count = write_frames(capture.path, made, kind)
        made.rename(path)
    return count


def export_json(source: Path, kind: str, exported: Exported) -> dict[str, Any]:
    """As ``armhil export --json`` prints it."""
    return {
        "file": str(source),
        "format": kind,
        "out": str(exported.path),
        "rows": exported.rows,
        "map": None if exported.map is None else str(exported.map),
        "missing": list(exported.warnings),
    }
