"""Good files of the kinds that commands read, how they are hurt, and what reads them."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import robots
from daq.files.found_model import read_found_model
from daq.files.model_file import write_model
from daq.files.toml_text import toml_text
from daq.importing.load import load_log
from daq.recording.capture import Capture
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from daq.recording.recovery import recover
from daq.recording.trajectory_file import read_motion, write_trajectory
from daq.session.cell import cell_of
from robots.errors import UserError
from tests.daq.accepted_meanings import (
    fill_catalogue,
    read_body,
    read_catalogue,
    said_by_catalogue,
    said_by_cell,
    said_by_payload,
)
from tests.daq.captures import facts, outcome, samples
from tests.daq.damaged_files import damaged
from tests.daq.models import carriage
from tests.daq.structural_mutations import (
    Structure,
    mutated_database,
    mutated_json,
    mutated_map,
    mutated_mcap,
    mutated_table,
    rows_of,
    said_by_capture,
    said_by_json,
    said_by_map,
    said_by_model,
    said_by_table,
)
from trajectories import approach

TX40, EMPS = robots.load("tx40"), robots.load("emps")
HOSTILE = (
    b"1e308",
    b"-1e308",
    b"1e-320",
    b"9" * 400,
    b"nan",
    b'"' + b"x" * 140_000 + b'"',
    b"[]",
    b"{}",
    b"null",
    b"-1",
)
_NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")


def hostile(data: bytes, generator: random.Random) -> bytes:
    """One number of a text is another, or the bytes are damaged at random."""
    if generator.random() < 0.5:
        return damaged(data, generator)
    place = generator.choice(list(_NUMBER.finditer(data)))
    return data[: place.start()] + generator.choice(HOSTILE) + data[place.end() :]


def spliced(data: bytes, generator: random.Random) -> bytes:
    """Pieces of one capture in another order."""
    a, b = sorted(generator.randrange(len(data)) for _ in range(2))
    c, d = sorted(generator.randrange(len(data)) for _ in range(2))
    return data[:a] + data[c:d] + data[b:] if generator.random() < 0.5 else data[:b] + data[a:]


def csv_file(folder: Path) -> Path:
    path = folder / "motion.csv"
    time = np.arange(100) * 0.004
    rows = np.column_stack([time, *(0.1 * np.sin(time + k) for k in range(6))])
    names = ",".join(["time", *(joint.name for joint in TX40.joint)])
    path.write_text(
        names + "\n" + "\n".join(",".join(map(repr, row)) for row in rows.tolist()) + "\n", "utf-8"
    )
    return path


def json_file(folder: Path) -> Path:
    path = folder / "motion.trajectory.json"
    write_trajectory(path, approach(TX40, list(TX40.home), [0.1] * 6, 0.004), TX40)
    return path


def catalogue_file(folder: Path) -> Path:
    path = folder / "catalogue.db"
    fill_catalogue(path)
    return path


def capture_file(folder: Path) -> Path:
    path = folder / "capture.mcap"
    with Recorder(path, TX40, facts(TX40), start_ns=10**18) as recorder:
        for begin in range(0, 960, 240):
            recorder.write(samples(begin, 240))
            recorder._flush()
        recorder.finish(outcome(960))
    return path


def model_file(folder: Path) -> Path:
    path = folder / "emps.model.toml"
    (folder / "log.csv").write_text("t,q,v\n", "utf-8")
    write_model(path, carriage(EMPS), [folder / "log.csv"], EMPS)
    return path


def map_file(folder: Path) -> Path:
    time = np.arange(2000) * 0.001
    rows = np.column_stack([time, 0.1 * np.sin(6 * time), np.cos(6 * time)])
    np.savetxt(folder / "log.csv", rows, delimiter=",", header="t,q,v", comments="")
    path = folder / "import.toml"
    path.write_text(
        toml_text(
            {
                "format": 1,
                "time": {"column": "t"},
                "position": {"columns": ["q"], "unit": "m", "side": "motor", "ratio": [1.5]},
                "control_signal": {"columns": ["v"]},
                "identification": {"cutoff_hz": 30.0, "trim_samples": [5, 6]},
            }
        ),
        "utf-8",
    )
    return path


def cell_file(folder: Path) -> Path:
    path = folder / "cell.toml"
    box = {"name": "table", "centre": [0.5, 0.0, 0.2], "size": [0.3, 0.4, 0.2], "turn": 0.1}
    cell = {"format": 1, "floor": -0.05, "tool": {"offset": [0.0, 0.0, 0.1], "speed": 0.5}, "obstacle": [box]}
    path.write_text(toml_text(cell), "utf-8")
    return path


def payload_file(folder: Path) -> Path:
    path = folder / "payload.toml"
    inertia = [0.01, 0.0, 0.01, 0.0, 0.0, 0.01]
    payload = {"format": 1, "mass": 1.5, "center": [0.01, 0.0, 0.05], "inertia": inertia}
    path.write_text(toml_text(payload), "utf-8")
    return path


def read_and_recover(path: Path) -> Capture:
    out = path.with_name("out.mcap")
    out.unlink(missing_ok=True)
    try:
        recover(path, out)
    finally:
        found = read_capture(path)
    return found


def recorded_in(path: Path, found: Capture) -> None:
    """The good capture stands beside it."""
    said_by_capture(rows_of(read_capture(path.with_name("capture.mcap"))), found)


@dataclass(frozen=True)
class Kind:
    """How files of a kind are made, read, hurt and looked at again.

    Attributes:
        make: a good one in a folder.
        read: as commands read it.
        damage: of its bytes or numbers.
        mutate: well formed, and something else.
        check: what was accepted beside a second reading of the file.
    """

    make: Callable[[Path], Path]
    read: Callable[[Path], Any]
    damage: Structure
    mutate: Structure
    check: Callable[[Path, Any], None]


KINDS: dict[str, Kind] = {
    "csv": Kind(csv_file, lambda path: read_motion(path, TX40), hostile, mutated_table, said_by_table),
    "json": Kind(json_file, lambda path: read_motion(path, TX40), hostile, mutated_json, said_by_json),
    "catalogue": Kind(catalogue_file, read_catalogue, damaged, mutated_database, said_by_catalogue),
    "capture": Kind(capture_file, read_and_recover, spliced, mutated_mcap, recorded_in),
    "model": Kind(model_file, lambda path: read_found_model(path, EMPS), hostile, mutated_map, said_by_model),
    "map": Kind(
        map_file,
        lambda path: load_log(path.with_name("log.csv"), EMPS, path),
        hostile,
        mutated_map,
        said_by_map,
    ),
    "cell": Kind(cell_file, cell_of, hostile, mutated_map, said_by_cell),
    "payload": Kind(payload_file, read_body, hostile, mutated_map, said_by_payload),
}


def judged(
    kind: Kind, good: Path, data: bytes, number: int, generator: random.Random
) -> tuple[str, str | None]:
    """Hurt a file, read it; how it was hurt, and the refusal, None where it was accepted.

    Raises:
        AssertionError: the refusal is no line, or it was accepted and something else was read.
    """
    way, change = ("mutated", kind.mutate) if number % 2 else ("damaged", kind.damage)
    path = good.with_name("damaged" + "".join(good.suffixes))
    for left in good.parent.glob("damaged.*"):
        left.unlink()
    path.write_bytes(change(data, generator))
    try:
        found = kind.read(path)
    except UserError as error:
        assert "\n" not in str(error), number  # noqa: PT017 - both outcomes are allowed
        assert len(str(error)) < 1000, "a line, not a page"  # noqa: PT017
        return way, str(error)
    kind.check(path, found)
    return way, None
