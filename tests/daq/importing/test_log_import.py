"""Logs as captures: every kind of file, the shipped maps, ROS 2 bags, guessed maps."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer
from pyarrow import parquet
from scipy.io import savemat

from daq.files.toml_text import toml_text
from daq.importing.guess import guess_map, write_map
from daq.importing.joint_states import read_bag
from daq.importing.load import load_recording
from daq.importing.log_import import import_json, import_log
from daq.importing.table_process import TableProcess
from daq.recording.capture import CaptureError
from daq.recording.messages import joint_state_layout
from daq.recording.topics import JOINT_STATE, JOINT_STATE_DEFINITION
from ident import identify
from robots import Robot

ROWS = 300
STEP = 0.002


def motion(joints: int) -> dict[str, np.ndarray]:
    time = np.arange(ROWS) * STEP
    phase = time[:, np.newaxis] * 3 + np.arange(joints)
    return {"t": time, "q": np.sin(phase), "qr": np.sin(phase + 0.01), "tau": np.cos(phase)}


def write_map_file(folder: Path, content: dict[str, Any]) -> Path:
    path = folder / "map.toml"
    path.write_text(toml_text(content))
    return path


# The shipped maps


def test_the_emps_log_becomes_a_capture(shared_data: Path, emps: Robot, tmp_path: Path) -> None:
    log = shared_data / "emps" / "DATA_EMPS.mat"
    imported = import_log(log, emps, emps.folder / "import.toml", tmp_path / "emps.mcap", "from the web")
    (direct,) = load_recording(log, emps).recordings
    loaded = load_recording(imported.capture.path, emps)
    (recording,) = loaded.recordings
    assert np.array_equal(recording.position, direct.position)
    assert np.array_equal(recording.control_signal, direct.control_signal)
    assert np.array_equal(recording.reference, direct.reference)
    assert imported.capture.run["note"] == "from the web"
    assert imported.capture.records["armhil.import"]["source"] == "DATA_EMPS.mat"
    assert import_json(imported)["period"] == 0.001


def test_the_tx40_log_becomes_a_capture_with_its_settings(
    shared_data: Path, tx40: Robot, tmp_path: Path
) -> None:
    log = shared_data / "tx40"
    imported = import_log(log, tx40, tx40.folder / "import.toml", tmp_path / "tx40.mcap")
    loaded = load_recording(imported.capture.path, tx40)
    assert not imported.capture.has_reference
    assert loaded.recordings[0].reference is None
    assert loaded.settings == load_recording(log, tx40).settings != tx40.identification
    fitted = identify(tx40.model_copy(update={"identification": loaded.settings}), loaded.recordings)
    assert round(fitted.result.least_squares.relative_error_percent, 3) == 7.331


# Files of others


def write_parquet(path: Path, made: dict[str, np.ndarray]) -> Path:
    """A column per joint, another with lists, times as time stamps."""
    joints = made["q"].shape[1]
    columns = {f"q{k}": made["q"][:, k] for k in range(joints)}
    columns["stamp"] = pa.array((made["t"] * 1e9).astype("int64"), pa.timestamp("ns"))
    columns["tau"] = pa.FixedSizeListArray.from_arrays(pa.array(made["tau"].ravel()), joints)
    columns["name"] = ["text is no column"] * ROWS
    parquet.write_table(pa.table(columns), path)
    return path


def test_parquet(tmp_path: Path, tx40: Robot) -> None:
    made = motion(6)
    log = write_parquet(tmp_path / "log.parquet", made)
    content = {
        "format": 1,
        "time": {"column": "stamp", "unit": "ns"},
        "position": {"columns": [f"q{k}" for k in range(6)], "unit": "rad"},
        "torque": {"columns": [f"tau:{k + 1}" for k in range(6)], "unit": "N*m"},
    }
    capture = import_log(log, tx40, write_map_file(tmp_path, content), tmp_path / "out.mcap").capture
    assert np.array_equal(capture.samples.position, made["q"])
    assert tx40.joint_torque(capture.samples.control_signal) == pytest.approx(made["tau"])
    assert capture.period == STEP


def messages(robot: Robot, made: dict[str, np.ndarray], shuffled: bool = False) -> list[tuple[int, bytes]]:
    """Time of recording and JointState of each row, with stamps of an ordinary day."""
    names = [joint.name for joint in robot.joint]
    order = np.arange(robot.n)[::-1] if shuffled else np.arange(robot.n)
    layout = joint_state_layout([names[k] for k in order], effort=True)
    stamps = 1_700_000_000 * 10**9 + np.round(made["t"] * 1e9).astype(np.int64)
    rows = layout.rows(stamps, {"position": made["q"][:, order], "effort": made["tau"][:, order]})
    return [(int(stamp) + 150_000, row.tobytes()) for stamp, row in zip(stamps, rows, strict=True)]


def write_mcap(path: Path, rows: list[tuple[int, bytes]], compression: CompressionType) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, compression=compression)
        writer.start(profile="ros2", library="test")
        schema = writer.register_schema(JOINT_STATE, "ros2msg", JOINT_STATE_DEFINITION.encode())
        channel = writer.register_channel("/joint_states", "cdr", schema)
        other = writer.register_channel("/rosout", "json", 0)
        for number, (time, data) in enumerate(rows):
            writer.add_message(channel, time, data, time, number)
            writer.add_message(other, time, b"{}", time, number)
        writer.finish()
    return path


def write_db3(path: Path, rows: list[tuple[int, bytes]]) -> Path:
    connection = sqlite3.connect(path)
    connection.executescript(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT,"
        " offered_qos_profiles TEXT);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
        "INSERT INTO topics VALUES (1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr', '');"
        "INSERT INTO topics VALUES (2, '/rosout', 'rcl_interfaces/msg/Log', 'cdr', '');"
    )
    insert = "INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)"
    connection.executemany(insert, [(1, time, data) for time, data in rows])
    connection.execute(insert, (2, 1, b"other"))
    connection.commit()
    connection.close()
    return path


def as_folder(write: Callable[[Path, list[tuple[int, bytes]]], Path]) -> Callable[..., Path]:
    def written(folder: Path, rows: list[tuple[int, bytes]]) -> Path:
        bag = folder / "bag"
        bag.mkdir()
        (bag / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
        half = len(rows) // 2
        write(bag / "bag_0.db3", rows[:half])
        write(bag / "bag_1.db3", rows[half:])
        return bag

    return written


BAGS = {
    "mcap with zstd": lambda folder, rows: write_mcap(folder / "b.mcap", rows, CompressionType.ZSTD),
    "mcap with lz4": lambda folder, rows: write_mcap(folder / "b.mcap", rows, CompressionType.LZ4),
    "plain mcap": lambda folder, rows: write_mcap(folder / "b.mcap", rows, CompressionType.NONE),
    "sqlite": lambda folder, rows: write_db3(folder / "b.db3", rows),
    "a folder of two files": as_folder(write_db3),
}


@pytest.mark.parametrize("kind", list(BAGS))
def test_bags_of_joint_states(kind: str, tmp_path: Path, tx40: Robot) -> None:
    made = motion(6)
    half = {name: values[: ROWS // 2] for name, values in made.items()}
    rest = {name: values[ROWS // 2 :] for name, values in made.items()}
    # The joints may change their order from message to message; names say which is which.
    bag = BAGS[kind](tmp_path, messages(tx40, half) + messages(tx40, rest, shuffled=True))
    found = guess_map(bag, tx40)
    assert found["time"] == {"column": "/joint_states/stamp", "unit": "s"}
    assert found["position"]["columns"][2] == "/joint_states/position/joint_3"
    assert found["torque"]["columns"][5] == "/joint_states/effort/joint_6"
    capture = import_log(bag, tx40, write_map_file(tmp_path, found), tmp_path / "out.mcap").capture
    assert np.array_equal(capture.samples.position, made["q"])
    assert tx40.joint_torque(capture.samples.control_signal) == pytest.approx(made["tau"])
    assert capture.period == pytest.approx(STEP)


def test_messages_of_other_joints_are_left_out_aloud(tmp_path: Path, tx40: Robot, emps: Robot) -> None:
    rows = messages(tx40, motion(6)) + messages(emps, motion(1))[:20]
    bag = write_db3(tmp_path / "b.db3", sorted(rows))
    with TableProcess() as process:
        columns = process.read(bag)
    assert len(columns["/joint_states/stamp"]) == ROWS
    assert "/joint_states/position/carriage" not in columns
    assert set(read_bag(bag)) == set(columns)


def test_our_own_captures_are_bags_too(tmp_path: Path, tx40: Robot) -> None:
    made = motion(6)
    log = tmp_path / "log.mat"
    savemat(log, made)
    first = import_log(log, tx40, write_map_file(tmp_path, guess_map(log, tx40)), tmp_path / "a.mcap").capture
    columns = read_bag(first.path)
    assert np.array_equal(columns["/joint_reference/position/joint_1"], made["qr"][:, 0])
    assert np.array_equal(columns["/joint_states/position/joint_1"], made["q"][:, 0])


# Guessed maps

NAMES = {
    "numbers": ("t", "q{}", "qr{}", "tau{}"),
    "underscores": ("time", "q_{}", "q_ref_{}", "torque_{}"),
    "words": ("timestamp", "position_{}", "reference_position_{}", "effort_{}"),
    "brackets": ("Time [s]", "joint_position[{}]", "q_cmd[{}]", "joint_torque[{}]"),
    "capitals": ("TIME", "Q{}", "Q_REF{}", "TAU_{}"),
}


@given(
    names=st.sampled_from(sorted(NAMES)),
    degrees=st.booleans(),
    unit=st.sampled_from(["s", "ms", "us", "ns"]),
    order=st.randoms(use_true_random=False),
)
@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_map_is_guessed_from_names_and_sizes(
    names: str, degrees: bool, unit: str, order: Any, tmp_path_factory: pytest.TempPathFactory, tx40: Robot
) -> None:
    made = motion(6)
    made["q"] *= 2.0
    time, position, reference, torque = NAMES[names]
    scale = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[unit]
    columns = [(time, made["t"] * scale)]
    for pattern, key in ((position, "q"), (reference, "qr"), (torque, "tau")):
        values = np.degrees(made[key]) if degrees and key != "tau" else made[key]
        columns += [(pattern.format(k + 1), values[:, k]) for k in range(6)]
    order.shuffle(columns)
    log = tmp_path_factory.mktemp("guess") / "log.csv"
    header = ",".join(name for name, _ in columns)
    table = np.column_stack([v for _, v in columns])
    np.savetxt(log, table, delimiter=",", header=header, comments="", fmt="%.17g")
    found = guess_map(log, tx40)
    assert found["time"] == {"column": time, "unit": unit}
    assert found["position"] == {
        "columns": [position.format(k) for k in range(1, 7)],
        "unit": "deg" if degrees else "rad",
    }
    assert found["reference"]["columns"] == [reference.format(k) for k in range(1, 7)]
    assert found["torque"] == {"columns": [torque.format(k) for k in range(1, 7)], "unit": "N*m"}


def test_the_map_of_the_emps_log_is_guessed(shared_data: Path, emps: Robot) -> None:
    found = guess_map(shared_data / "emps" / "DATA_EMPS.mat", emps)
    assert found["time"]["column"] == "t"
    assert found["position"] == {"columns": ["qm"], "unit": "m"}
    assert found["control_signal"] == {"columns": ["vir"]}


@pytest.mark.parametrize(
    ("header", "reason"),
    [
        ("q,tau,dq", "no column looks like time"),
        ("t,b,c", "no column looks like a measured position"),
        ("t,q,c", "no column looks like a torque or a current"),
    ],
)
def test_what_cannot_be_guessed_is_said(header: str, reason: str, tmp_path: Path, emps: Robot) -> None:
    log = tmp_path / "log.csv"
    log.write_text(header + "\n0,1,2\n1,2,3\n2,3,4\n")
    with pytest.raises(CaptureError, match=reason) as caught:
        guess_map(log, emps)
    assert "present:" in str(caught.value)


def test_a_map_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "map.toml"
    write_map(path, {"format": 1}, Path("log.csv"))
    with pytest.raises(CaptureError, match="exists already; use it with --columns"):
        write_map(path, {"format": 1}, Path("log.csv"))


# Damaged files end in one line


@pytest.mark.parametrize("suffix", [".mat", ".parquet", ".mcap", ".db3"])
def test_a_file_that_is_something_else(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"log{suffix}"
    path.write_bytes(b"this is text\n" * 40)
    with TableProcess() as process, pytest.raises(CaptureError) as caught:
        process.read(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_kills_its_reader_is_one_line_and_the_next_is_read(
    tmp_path: Path,
) -> None:
    # A FIFO never ends: the reader waits on it until its time is over, and is killed.
    os.mkfifo(tmp_path / "slow.mat")
    good = tmp_path / "good.mat"
    savemat(good, {"a": np.arange(3.0)})
    with TableProcess(timeout=0.5) as process:
        with pytest.raises(CaptureError, match=r"took longer than 0\.5 s"):
            process.read(tmp_path / "slow.mat")
        assert process._process is None
        process._timeout = 60.0
        assert process.read(good)["a"].tolist() == [0.0, 1.0, 2.0]
        assert process._process is not None
        process._process.kill()
        assert process._process.wait() == -9
        assert process.read(good)["a"].tolist() == [0.0, 1.0, 2.0]
