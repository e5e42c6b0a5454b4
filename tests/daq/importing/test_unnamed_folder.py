"""A folder of tables without a header: time, states and inputs, of which there is one row less."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from daq.importing.guess_log import GuessedLog, guess_log
from daq.importing.guess_torque import LogHints
from daq.importing.load import load_recording
from daq.recording.errors import CaptureError
from robots.arrays import FloatArray
from tests.daq.importing.made_arms import motion_of, scara

SIZES = [0.7, 0.7, 0.08, 1.5]
COLUMNS = [f"c{k}" for k in range(1, 9)]
Signals = tuple[Path, FloatArray, FloatArray, FloatArray, FloatArray]


@pytest.fixture(scope="module")
def signals(tmp_path_factory: pytest.TempPathFactory) -> Signals:
    urdf = tmp_path_factory.mktemp("arm") / "arm.urdf"
    urdf.write_text(scara())
    return urdf, *motion_of(urdf, SIZES, 8.0)


def written(folder: Path, **tables: FloatArray) -> Path:
    folder.mkdir()
    for name, values in tables.items():
        np.savetxt(folder / f"{name}.csv", values, delimiter=",")
    return folder


def guessed(tmp_path: Path, urdf: Path, log: Path) -> GuessedLog:
    (tmp_path / "guess").mkdir()
    return guess_log(log, urdf, tmp_path / "guess", LogHints())


def test_each_quantity_is_found_in_its_table(tmp_path: Path, signals: Signals) -> None:
    urdf, t, q, v, torque = signals
    log = written(tmp_path / "log", a=np.column_stack([q, v]), b=torque[:-1], c=t)
    found = guessed(tmp_path, urdf, log)
    places = {
        key: (found.columns[key]["file"], found.columns[key]["columns"]) for key in ("position", "torque")
    }
    assert places == {"position": ("a.csv", COLUMNS[:4]), "torque": ("b.csv", COLUMNS[:4])}
    assert found.columns["time"] == {"column": "c1", "unit": "s", "file": "c.csv"}
    loaded = load_recording(log, found.robot, tmp_path / "guess" / "import.toml")
    assert "log: control signal: one row less than the rest, whose last one is left out" in loaded.warnings
    (recording,) = loaded.recordings
    # What was read stands beside each other as it was recorded.
    assert recording.position == pytest.approx(q[:-1], abs=1e-9)
    assert recording.control_signal == pytest.approx(found.robot.control_signal(torque[:-1]), abs=1e-6)


def test_two_rows_less_are_no_log(tmp_path: Path, signals: Signals) -> None:
    urdf, t, q, v, torque = signals
    log = written(tmp_path / "log", a=np.column_stack([q, v]), b=torque[:-1], c=t)
    found = guessed(tmp_path, urdf, log)
    np.savetxt(log / "b.csv", torque[:-2], delimiter=",")
    with pytest.raises(CaptureError, match=r"quantities differ in length: position .*, control signal"):
        load_recording(log, found.robot, tmp_path / "guess" / "import.toml")


def test_a_quantity_in_two_tables_is_refused(tmp_path: Path, signals: Signals) -> None:
    urdf, t, q, v, torque = signals
    log = written(tmp_path / "log", a=q[:, :2], b=np.column_stack([q[:, 2:], v, torque]), c=t)
    with pytest.raises(CaptureError, match="stand in several files; write them into one"):
        guessed(tmp_path, urdf, log)
