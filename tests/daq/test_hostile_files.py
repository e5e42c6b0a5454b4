"""Files that somebody spliced, flipped bits of, or wrote to hurt: read, or refused with one line."""

from __future__ import annotations

import random
import re
import sqlite3
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import robots
from daq.catalogue import arms, models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import identity_of_capture
from daq.catalogue.values import CatalogueError
from daq.files.cell_file import read_cell
from daq.files.found_model import read_found_model
from daq.files.model_file import write_model
from daq.files.payload_file import read_payload
from daq.files.toml_text import toml_text
from daq.importing.load import load_log
from daq.recording.capture import DESCRIPTION, RUN, CaptureError
from daq.recording.described_arm import described
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from daq.recording.recovery import recover
from daq.recording.run_facts import report_facts
from daq.recording.trajectory_file import TrajectoryFileError, read_motion, write_trajectory
from robots.errors import UserError
from tests.daq.captures import facts, outcome, samples
from tests.daq.catalogue.entries import identity, model
from tests.daq.damaged_files import damaged
from tests.daq.models import carriage
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
    with Catalogue(f"sqlite:///{path}") as catalogue:
        for k in range(4):
            run = runs.begin(catalogue, identity(first=k), "run", facts={"channel": "can0"})
            runs.finish(catalogue, run.id, "completed")
            models.add(catalogue, run.id, model(k))
    return path


def read_catalogue(path: Path) -> None:
    with Catalogue(f"sqlite:///{path}") as catalogue:
        arms.every(catalogue)
        runs.every(catalogue)
        for number in range(1, 5):
            models.get(catalogue, number)
        runs.finish(catalogue, runs.begin(catalogue, identity(first=77), "run").id, "completed")


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


def read_and_recover(path: Path) -> None:
    out = path.with_name("out.mcap")
    out.unlink(missing_ok=True)
    try:
        recover(path, out)
    finally:
        read_capture(path)


Kind = tuple[Callable[[Path], Path], Callable[[Path], object], Callable[[bytes, random.Random], bytes]]
KINDS: dict[str, Kind] = {
    "csv": (csv_file, lambda path: read_motion(path, TX40), hostile),
    "json": (json_file, lambda path: read_motion(path, TX40), hostile),
    "catalogue": (catalogue_file, read_catalogue, damaged),
    "capture": (capture_file, read_and_recover, spliced),
    "model": (model_file, lambda path: read_found_model(path, EMPS), hostile),
    "map": (map_file, lambda path: load_log(path.with_name("log.csv"), EMPS, path), hostile),
    "cell": (cell_file, read_cell, hostile),
    "payload": (payload_file, read_payload, hostile),
}


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_read_or_refused_with_one_line(kind: str, tmp_path: Path) -> None:
    make, read, change = KINDS[kind]
    good = make(tmp_path)
    read(good)
    data, refused = good.read_bytes(), 0
    path = tmp_path / ("damaged" + "".join(good.suffixes))
    for seed in range(40):
        path.write_bytes(change(data, random.Random(f"{kind} {seed}")))
        for left in tmp_path.glob("damaged.db-*"):
            left.unlink()
        try:
            read(path)
        except UserError as error:
            refused += 1
            assert "\n" not in str(error)  # noqa: PT017 - both outcomes are allowed
            assert len(str(error)) < 1000, "a line, not a page"  # noqa: PT017
    assert 0 < refused < 40


def test_a_covariance_of_flipped_bits_is_one_line(tmp_path: Path) -> None:
    """zlib.error is no ValueError."""
    path = catalogue_file(tmp_path)
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE models SET covariance = ? WHERE id = 2", (zlib.compress(b"x" * 64)[:-2],))
    connection.close()
    with pytest.raises(CatalogueError, match=r"^model 2 holds a value that no armhil wrote .*put a backup"):
        read_catalogue(path)


@pytest.mark.parametrize("ratio", ["[1e-320]", "[0.0]", "[1e308]"])
def test_a_ratio_of_no_gear_is_refused_where_it_stands(tmp_path: Path, ratio: str) -> None:
    path = map_file(tmp_path)
    path.write_text(path.read_text("utf-8").replace("[1.5]", ratio), "utf-8")
    with pytest.raises(UserError, match=r"import\.toml:\d+: position"):
        load_log(tmp_path / "log.csv", EMPS, path)


def test_a_spliced_chunk_of_a_length_beyond_all_is_skipped(tmp_path: Path) -> None:
    """Its length was read as a size, which has 63 bits: OverflowError."""
    good = capture_file(tmp_path)
    data = bytearray(good.read_bytes())
    at = data.index(b"\x04\x00\x00\x00zstd") + 8
    data[at : at + 8] = b"\xff" * 8
    path = tmp_path / "spliced.mcap"
    path.write_bytes(bytes(data))
    found = recover(path, tmp_path / "out.mcap")
    assert found.capture.damage and len(found.capture.samples) > 0


@pytest.mark.parametrize("value", ["1e308", "-1e308", "1e7"])
def test_a_figure_beyond_any_motion_is_named_with_its_row(tmp_path: Path, value: str) -> None:
    path = csv_file(tmp_path)
    rows = path.read_text("utf-8").splitlines()
    rows[5] = ",".join([rows[5].split(",")[0], value, *rows[5].split(",")[2:]])
    path.write_text("\n".join(rows), "utf-8")
    with pytest.raises(
        TrajectoryFileError, match=rf"motion\.csv: row 5: {re.escape(value)} is beyond any motion"
    ):
        read_motion(path, TX40)


def test_a_field_of_128_kb_is_one_line(tmp_path: Path) -> None:
    path = csv_file(tmp_path)
    path.write_text(path.read_text("utf-8") + '"' + "x" * 140_000 + '"', "utf-8")
    with pytest.raises(TrajectoryFileError, match=r"motion\.csv: not CSV: field larger than field limit"):
        read_motion(path, TX40)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('urdf = "tx40.urdf"', 'urdf = "../../tx40.urdf"'),
        ('urdf = "tx40.urdf"', 'urdf = ""'),
        ('urdf = "tx40.urdf"', 'urdf = "robot.toml"'),
        ('urdf = "tx40.urdf"', 'urdf = "a\\u0000b"'),
        ('urdf = "tx40.urdf"', f'urdf = "{"a" * 300}"'),
        ('urdf = "tx40.urdf"', "urdf = 5"),
        ('urdf = "tx40.urdf"', 'urdf = "tx40.urdf'),
        ("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, 1e308]"),
        ("gravity = ", "gravity = " + "[" * 3000),
    ],
)
def test_a_capture_with_a_hostile_description_is_one_line(tmp_path: Path, old: str, new: str) -> None:
    path = with_records(tmp_path, DESCRIPTION, "robot.toml", TX40.source_text.replace(old, new))
    with pytest.raises(UserError) as caught, described(None, path):
        pass
    assert "\n" not in str(caught.value)
    identity_of_capture(read_capture(path))


@pytest.mark.parametrize("drives", ["5", "[", '[{"serial": "x"}]', "[1]", "[" * 5000])
def test_a_capture_with_a_hostile_record_of_its_drives_is_one_line(tmp_path: Path, drives: str) -> None:
    capture = read_capture(with_records(tmp_path, RUN, "drives", drives))
    with pytest.raises(CaptureError, match=r"hostile\.mcap: its record of the drives is none"):
        identity_of_capture(capture)
    for versions in ("[", "5", "[" * 5000):
        capture = read_capture(with_records(tmp_path, RUN, "versions", versions))
        assert report_facts(capture)["armhil"] == "unknown"


def with_records(folder: Path, record: str, key: str, value: str) -> Path:
    path = folder / "hostile.mcap"
    path.unlink(missing_ok=True)
    known = facts(TX40)
    known[record] = {**known[record], key: value}
    with Recorder(path, TX40, known, start_ns=10**18) as recorder:
        recorder.write(samples(0, 240))
        recorder.finish(outcome(240))
    return path
