"""Files that somebody spliced, flipped bits of, or wrote to hurt: read, or refused with one line."""

from __future__ import annotations

import random
import re
import sqlite3
import zlib
from pathlib import Path

import pytest

from daq.catalogue.identity import identity_of_capture
from daq.catalogue.values import CatalogueError
from daq.importing.load import load_log
from daq.recording.capture import DESCRIPTION, RUN, CaptureError
from daq.recording.described_arm import described
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from daq.recording.recovery import recover
from daq.recording.run_facts import report_facts
from daq.recording.trajectory_file import TrajectoryFileError, read_motion
from robots.errors import UserError
from tests.daq.accepted_meanings import read_catalogue
from tests.daq.captures import facts, outcome, samples
from tests.daq.hostile_files import (
    EMPS,
    KINDS,
    TX40,
    capture_file,
    catalogue_file,
    csv_file,
    judged,
    map_file,
)


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_refused_with_one_line_or_what_it_says(kind: str, tmp_path: Path) -> None:
    chosen = KINDS[kind]
    good = chosen.make(tmp_path)
    chosen.check(good, chosen.read(good))
    data, refused = good.read_bytes(), 0
    for seed in range(40):
        _, refusal = judged(chosen, good, data, seed, random.Random(f"{kind} {seed}"))
        refused += refusal is not None
    assert 0 < refused < 40


def test_a_covariance_of_flipped_bits_is_one_line(tmp_path: Path) -> None:
    """zlib.error is no ValueError."""
    path = catalogue_file(tmp_path)
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE models SET covariance = ? WHERE id = 2", (zlib.compress(b"x" * 64)[:-2],))
    connection.close()
    with pytest.raises(CatalogueError, match=r"^model 2 holds a value that no armhil wrote .*put a backup"):
        read_catalogue(path)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ("UPDATE arms SET serials = '5' WHERE id = 1", r"^catalogue \S+: holds a value that no armhil wrote"),
        ("UPDATE runs SET started = x'ff00'", r"^catalogue \S+: holds a value that no armhil wrote"),
        ("UPDATE schema_version SET version = 'four'", 'has version "four", which no armhil wrote'),
        (f"UPDATE models SET gates = '{'[' * 5000}'", r"^catalogue \S+: holds a value that no armhil wrote"),
        ("UPDATE schema_version SET version = 0", "has version 0, which no armhil wrote"),
        ("ALTER TABLE runs RENAME COLUMN kind TO kinds", "no such column: runs.kind"),
    ],
)
def test_a_catalogue_with_values_of_another_kind_is_one_line(tmp_path: Path, change: str, told: str) -> None:
    path = catalogue_file(tmp_path)
    with sqlite3.connect(path) as connection:
        connection.execute(change)
    connection.close()
    with pytest.raises(CatalogueError, match=told):
        read_catalogue(path)


def test_two_columns_of_one_name_and_numbers_of_other_hands_are_refused(tmp_path: Path) -> None:
    path = csv_file(tmp_path)
    good = path.read_text("utf-8")
    path.write_text(good.replace("joint_2", "joint_1", 1), "utf-8")
    with pytest.raises(TrajectoryFileError, match='more than one column "joint_1"; allowed: one of a name'):
        read_motion(path, TX40)
    for number in ("1_0", "nan", "inf", "٣", "0x10", "1e", "--1"):
        rows = good.splitlines()
        rows[5] = ",".join([*rows[5].split(",")[:-1], number])
        path.write_text("\n".join(rows), "utf-8")
        with pytest.raises(TrajectoryFileError, match=r"row 5: .* is not a number"):
            read_motion(path, TX40)


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
