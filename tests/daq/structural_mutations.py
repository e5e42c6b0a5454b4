"""Files that are well formed and say something else: entries lost, doubled, renamed, of another kind.

Random bytes seldom get past a parser; these do. What is accepted is compared with a second reading of the
same file by nothing of armhil.
"""

from __future__ import annotations

import csv
import json
import random
import sqlite3
import struct
import tempfile
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from daq.importing.loaded import LoadedRecordings
from daq.recording.capture import Capture
from daq.recording.trajectory_file import FoundMotion
from ident.identification.found_effects import FoundModel
from tests.robots.toml_mutations import mutated_toml
from trajectories.motion_data import motion_data

Structure = Callable[[bytes, random.Random], bytes]

VALUES = (
    None, True, -1, 0, 1, 2**63, 10**400, 1e308, -1e308, 1e-320, 0.5, "", "nan", "1", "x" * 100_000, [], {},
    [[]], [None], {"kind": "jerk"}, [1, 2, 3],
)  # fmt: skip
CELLS = (None, -1, 2**62, 1e308, "", "nan", "{", "[" * 5000, b"\xff\x00", "x" * 9000)
FIELDS = ("", "nan", "inf", "1e308", "-1e308", "1e-320", "1_0", "٣", "0x10", "1,5", '"', "joint_1", "time")


def mutated_json(data: bytes, generator: random.Random) -> bytes:
    """One or two entries of a JSON text are lost, doubled, renamed, swapped or something else."""
    content = json.loads(data)
    for _ in range(generator.choice((1, 1, 2))):
        places = list(_places(content))
        holder, key = generator.choice(places)
        kind = generator.randrange(5)
        if kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(holder, list):
            holder.insert(key, holder[key])
        elif kind == 1:
            holder[f"{key}s"] = holder.pop(key)
        elif kind == 2:
            other, other_key = generator.choice(places)
            holder[key], other[other_key] = other[other_key], holder[key]
        elif kind == 3 and isinstance(holder[key], int | float):
            holder[key] *= generator.choice((-1, 2, 1000, 1e-3, 1e6))
        else:
            holder[key] = generator.choice(VALUES)
        try:
            json.dumps(content)
        except (ValueError, RecursionError):  # an entry was swapped into itself
            return data[: generator.randrange(len(data))]
    return json.dumps(content).encode()


def _places(node: Any) -> list[tuple[Any, Any]]:
    """Holder and key of every entry; of long lists a few."""
    found = []
    keys = list(node) if isinstance(node, dict) else list(range(len(node)))[:4]
    for key in keys:
        found.append((node, key))
        if isinstance(node[key], dict | list):
            found += _places(node[key])
    return found


def mutated_table(data: bytes, generator: random.Random) -> bytes:
    """One to three changes of the rows, columns and fields of a CSV text."""
    rows = [line.split(",") for line in data.decode().splitlines()]
    for _ in range(generator.choice((1, 1, 2, 3))):
        if not rows or not rows[0]:
            break
        rows = generator.choice(_TABLE_CHANGES)(rows, generator)
    return "\n".join(map(",".join, rows)).encode() + b"\n"


Rows = list[list[str]]


def _row_changed(rows: Rows, generator: random.Random) -> Rows:
    """One is lost, there again elsewhere, or where another was."""
    k, m = generator.randrange(len(rows)), generator.randrange(len(rows))
    return generator.choice(
        (
            rows[:k] + rows[k + 1 :],
            [*rows[:k], list(rows[m]), *rows[k:]],
            [rows[m] if i == k else rows[k] if i == m else row for i, row in enumerate(rows)],
        )
    )


def _column_changed(rows: Rows, generator: random.Random) -> Rows:
    """One is lost, there twice, another's by name, or a word throughout."""
    k, m = generator.randrange(len(rows[0])), generator.randrange(len(rows[0]))
    names = list(rows[0])
    names[k], names[m] = names[m], names[k]
    word = generator.choice(FIELDS)
    return generator.choice(
        (
            [row[:k] + row[k + 1 :] for row in rows],
            [[*row, *row[k : k + 1]] for row in rows],
            [names, *rows[1:]],
            [[word if i == k else field for i, field in enumerate(row)] for row in rows],
        )
    )


def _field_changed(rows: Rows, generator: random.Random) -> Rows:
    k, column = generator.randrange(len(rows)), generator.randrange(len(rows[0]))
    row = [generator.choice(FIELDS) if i == column else field for i, field in enumerate(rows[k])]
    return [row if i == k else other for i, other in enumerate(rows)]


_TABLE_CHANGES = (_row_changed, _column_changed, _field_changed, _field_changed)


def mutated_map(data: bytes, generator: random.Random) -> bytes:
    """Slips of the pen in a TOML text, as in a robot.toml."""
    while True:
        try:
            return mutated_toml(data.decode(), generator.randrange(1 << 60)).text.encode()
        except IndexError:  # a change of something that this file does not have
            continue


def mutated_mcap(data: bytes, generator: random.Random) -> bytes:
    """Whole records of an MCAP file are lost, doubled, swapped, or get another opcode."""
    head, tail = data[:8], data[-8:]
    records, at = [], 8
    while at + 9 <= len(data) - 8:
        (length,) = struct.unpack_from("<Q", data, at + 1)
        records.append(data[at : at + 9 + length])
        at += 9 + length
    for _ in range(generator.choice((1, 1, 2, 4))):
        k, m = generator.randrange(len(records)), generator.randrange(len(records))
        kind = generator.randrange(5)
        if kind == 0 and len(records) > 1:
            del records[k]
        elif kind == 1:
            records.insert(k, records[m])
        elif kind == 2:
            records[k], records[m] = records[m], records[k]
        elif kind == 3:
            records[k] = bytes([generator.randrange(1, 20)]) + records[k][1:]
        else:
            body = bytearray(records[k])
            if len(body) > 9:
                place = generator.randrange(9, len(body))
                body[place] ^= 1 << generator.randrange(8)
            records[k] = bytes(body)
    return head + b"".join(records) + tail


def mutated_database(data: bytes, generator: random.Random) -> bytes:
    """Values, rows, columns, indices and tables of an SQLite file are others, or gone."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "c.db"
        path.write_bytes(data)
        connection = sqlite3.connect(path, isolation_level=None)
        connection.execute("PRAGMA foreign_keys = OFF")
        connection.execute("PRAGMA ignore_check_constraints = ON")
        for _ in range(generator.choice((1, 1, 2, 3))):
            tables = connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()
            table = generator.choice([one for (one,) in tables if not one.startswith("sqlite_")])
            columns = [row[1] for row in connection.execute(f'PRAGMA table_info("{table}")')]
            column, other = generator.choice(columns), generator.choice(columns)
            value = generator.choice(CELLS)
            change: tuple[str, tuple[object, ...]] = generator.choice(
                (
                    *[(f'UPDATE OR REPLACE "{table}" SET "{column}" = ?', (value,))] * 5,
                    (f'UPDATE OR REPLACE "{table}" SET "{column}" = "{other}"', ()),
                    (f'DELETE FROM "{table}" WHERE rowid % 2', ()),
                    (f'DROP TABLE "{table}"', ()),
                    (f'ALTER TABLE "{table}" RENAME COLUMN "{column}" TO "{column}_"', ()),
                    (f'ALTER TABLE "{table}" RENAME TO "{table}s"', ()),
                    (f'ALTER TABLE "{table}" ADD COLUMN more INTEGER', ()),
                )
            )
            try:
                connection.execute(*change)
            except sqlite3.Error:
                continue  # not with this column
        connection.close()
        return path.read_bytes()


# What was accepted, beside a second reading ----------------------------------------------------------


def said_by_json(path: Path, found: FoundMotion) -> None:
    content = json.loads(path.read_text("utf-8"))
    assert (found.cycle_time, found.speed) == (content["cycle_time"], content["speed"])
    _assert_numbers(motion_data(found.motion), content["motion"])


def _assert_numbers(built: Any, wanted: Any) -> None:
    """Every entry of what is built stands in the file."""
    if isinstance(built, dict):
        assert set(built) <= set(wanted)
        for key, value in built.items():
            _assert_numbers(value, wanted[key])
    elif isinstance(built, list):
        assert len(built) == len(wanted)
        for one, other in zip(built, wanted, strict=True):
            _assert_numbers(one, other)
    else:
        assert built == wanted, (built, wanted)


def said_by_table(path: Path, found: FoundMotion) -> None:
    lines = path.read_text("utf-8-sig").splitlines()
    header, *rows = csv.reader(line for line in lines if line.strip() and line.strip()[0] != "#")
    assert len(set(header)) == len(header), "which of two columns of one name is meant?"
    assert all(len(row) == len(header) for row in rows)
    assert all(field.isascii() and "_" not in field for row in rows for field in row)
    values = np.array([[float(field) for field in row] for row in rows])
    assert np.isfinite(values).all()
    names = [name.strip() for name in header]
    chosen = [names.index(f"joint_{k}") for k in range(1, 7)]
    time = values[:, next(k for k, name in enumerate(names) if name.lower() in ("time", "t"))]
    state = found.motion.at(time[:-1] - time[0])
    np.testing.assert_allclose(state.position, values[:-1, chosen], atol=1e-6)


def said_by_model(path: Path, found: FoundModel) -> None:
    wanted = tomllib.loads(path.read_text("utf-8"))["parameter"]
    assert dict(found.values) == {one["name"]: float(one["value"]) for one in wanted}
    assert len(found.values) == len(wanted)


def said_by_map(path: Path, found: LoadedRecordings) -> None:
    said = tomllib.loads(path.read_text("utf-8"))
    with path.with_name("log.csv").open() as file:
        log = {name: [] for name in next(csv.reader(file))}  # type: ignore[var-annotated]
        for row in csv.reader(file):
            for column, field in zip(log.values(), row, strict=True):
                column.append(float(field))
    wanted = said["position"]
    (ratio,) = wanted.get("ratio", [1.0])
    (offset,) = wanted.get("offset", [0.0])
    scale = {"rad": 1.0, "deg": np.pi / 180, "m": 1.0, "mm": 1e-3}[wanted["unit"]]
    position = np.array(log[wanted["columns"][0]]) * scale / ratio + offset
    (piece,) = found.recordings
    assert len(piece.position) == len(position)
    np.testing.assert_allclose(piece.position[:, 0], position, rtol=1e-9, atol=1e-12)


def rows_of(capture: Capture) -> dict[int, tuple[float, ...]]:
    """What was recorded, by cycle."""
    samples = capture.samples
    rows = np.column_stack([samples.reference, samples.position, samples.control_signal, samples.statusword])
    return {int(cycle): tuple(row) for cycle, row in zip(samples.cycle, rows.tolist(), strict=True)}


def said_by_capture(original: dict[int, tuple[float, ...]], found: Capture) -> None:
    """Nothing is in it that was not recorded, and what it lacks is told."""
    rows = rows_of(found)
    assert len(rows) == len(found.samples)
    for cycle, row in rows.items():
        assert row == original[cycle], cycle
    if set(rows) != set(original):
        assert found.damage, "rows are missing, and nothing is said of it"
