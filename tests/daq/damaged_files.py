"""Good files of every kind that is read, random damage to them, and what reads them."""

from __future__ import annotations

import random
import sqlite3
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
from mcap.writer import Writer
from pyarrow import parquet
from scipy.io import savemat

import robots
from daq.files.toml_text import toml_text
from daq.importing.captures import load_capture
from daq.importing.columns import read_table
from daq.importing.import_map import load_import_map
from daq.importing.table_process import TableProcess
from daq.recording.capture import CaptureError
from daq.recording.messages import joint_state_layout
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from daq.recording.recovery import recover
from daq.recording.topics import JOINT_STATE, JOINT_STATE_DEFINITION
from ident import IdentificationError
from robots import RobotFileError
from tests.daq.captures import facts, outcome, samples, traffic

ALLOWED = (CaptureError, RobotFileError, IdentificationError)
WORDS = (
    b"nan",
    b"1e999",
    b"-0",
    b'"""',
    b"[[",
    b"\xff\xfe",
    b"\x00",
    b"armhil.",
    b"9" * 40,
    b"\xf0\x9f\xa6\xbe",
)


def damaged(data: bytes, generator: random.Random) -> bytes:
    """One to six changes of a file."""
    found = bytearray(data)
    for _ in range(generator.choice((1, 1, 2, 3, 6))):
        if not found:
            break
        at = generator.randrange(len(found))
        size = generator.choice((1, 1, 2, 4, 8, 40, 400))
        kind = generator.randrange(8)
        if kind <= 1:
            found[at] ^= 1 << generator.randrange(8)
        elif kind == 2:
            found[at : at + size] = generator.randbytes(size)
        elif kind == 3:
            del found[at : at + size]
        elif kind == 4:
            found[at:at] = found[at : at + size]
        elif kind == 5:
            found[at:at] = generator.choice(WORDS)
        elif kind == 6:
            found[at : at + size] = bytes([generator.choice((0, 0x7F, 0xFF))]) * size
        else:
            del found[generator.randrange(len(found)) :]
    return bytes(found)


def good_files(folder: Path) -> dict[str, Path]:
    """A good file of each kind."""
    robot = robots.load("tx40")
    files: dict[str, Path] = {}
    time_stamps = np.arange(400) * 0.002
    table = {"t": time_stamps, "q": np.sin(time_stamps), "v": np.cos(time_stamps)}

    files["capture"] = folder / "capture.mcap"
    with Recorder(files["capture"], robot, facts(robot), start_ns=10**18) as recorder:
        for begin in range(0, 2400, 240):
            recorder.write(samples(begin, 240))
            recorder.write_frames(traffic(robot, 22, 10**18))
            recorder._flush()
        recorder.finish(outcome(2400))

    files["csv"] = folder / "log.csv"
    rows = np.column_stack(list(table.values()))
    np.savetxt(files["csv"], rows, delimiter=",", header="t,q,v", comments="")
    files["mat"] = folder / "log.mat"
    savemat(files["mat"], table | {"m": np.ones((40, 6)), "s": {"a": 1.0}, "c": np.array(["x", 2], object)})
    files["compressed mat"] = folder / "small.mat"
    savemat(files["compressed mat"], table, do_compression=True)
    files["mat 4"] = folder / "four.mat"
    savemat(files["mat 4"], table, format="4")
    files["parquet"] = folder / "log.parquet"
    parquet.write_table(pa.table(table), files["parquet"])

    layout = joint_state_layout([joint.name for joint in robot.joint], effort=True)
    stamps = 10**18 + np.arange(100) * 1_000_000
    messages = layout.rows(stamps, {"position": np.ones((100, 6)), "effort": np.ones((100, 6))})
    files["bag"] = folder / "bag.mcap"
    with files["bag"].open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="fuzz")
        schema = writer.register_schema(JOINT_STATE, "ros2msg", JOINT_STATE_DEFINITION.encode())
        channel = writer.register_channel("/joint_states", "cdr", schema)
        for stamp, row in zip(stamps.tolist(), messages, strict=True):
            writer.add_message(channel, stamp, row.tobytes(), stamp)
        writer.finish()
    files["db3"] = folder / "bag.db3"
    connection = sqlite3.connect(files["db3"])
    connection.executescript(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
        "INSERT INTO topics VALUES (1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr');"
    )
    insert = "INSERT INTO messages(topic_id, timestamp, data) VALUES (1, ?, ?)"
    pairs = zip(stamps.tolist(), messages, strict=True)
    connection.executemany(insert, [(stamp, row.tobytes()) for stamp, row in pairs])
    connection.commit()
    connection.close()

    files["robot.toml"] = folder / "robot.toml"
    files["robot.toml"].write_text(robot.source_text, encoding="utf-8")
    (folder / robot.urdf).write_bytes(robot.urdf_path.read_bytes())
    files["import.toml"] = folder / "import.toml"
    map_text = toml_text(
        {
            "format": 1,
            "time": {"column": "t"},
            "position": {"columns": ["q"], "unit": "rad", "side": "motor", "ratio": [32.0]},
            "control_signal": {"columns": ["v"]},
            "identification": {"cutoff_hz": 30.0, "trim_samples": [5, 6]},
        }
    )
    files["import.toml"].write_text(map_text, encoding="utf-8")
    return files


class Readers:
    """What reads each kind, the way a command does."""

    def __init__(self, folder: Path) -> None:
        self.process = TableProcess(timeout=60.0)
        self.robot = robots.load("tx40")
        self.folder = folder

    def of(self, kind: str) -> Callable[[Path], object]:
        readers: dict[str, Callable[[Path], object]] = {
            "capture": self.capture,
            "csv": read_table,
            "robot.toml": robots.load,
            "import.toml": load_import_map,
        }
        return readers.get(kind, self.process.read)

    def capture(self, path: Path) -> None:
        """Read, identify from, and recover."""
        out = self.folder / "recovered.mcap"
        out.unlink(missing_ok=True)
        try:
            read_capture(path)
            load_capture(path, self.robot)
        finally:
            recover(path, out)
