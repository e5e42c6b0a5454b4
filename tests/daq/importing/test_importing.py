"""Recordings from captures and logs of others: units, sides, gaps, settings, one line for mistakes."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel
from scipy.io import savemat

import robots
from daq.files.toml_text import toml_text
from daq.importing.captures import capture_recordings
from daq.importing.columns import read_table
from daq.importing.import_map import ControlSignal, ImportMap, Position, Time, Torque, load_import_map
from daq.importing.load import load_recording
from daq.importing.loaded import LoadedRecordings
from daq.recording.capture import CaptureError
from daq.recording.reader import read_capture
from ident import Fitted, identify
from robots import Robot
from robots.allowed import keys_of
from robots.errors import UserError
from tests.daq.captures import record, samples

Map = dict[str, Any]
AXIS: Map = {
    "format": 1,
    "time": {"column": "t"},
    "position": {"columns": ["q"], "unit": "m"},
    "control_signal": {"columns": ["v"]},
}
NAMES = [f"j{k}" for k in range(1, 7)]
RATIO = [32.0, 32.0, 45.0, -48.0, 45.0, 32.0]


def write_map(folder: Path, content: Map) -> Path:
    path = folder / "columns.toml"
    path.write_text(toml_text(content))
    return path


def write_csv(path: Path, columns: dict[str, Any]) -> Path:
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.17g")
    return path


@pytest.fixture
def axis_log(tmp_path: Path) -> Path:
    time = np.arange(100) * 1e-3
    return write_csv(tmp_path / "log.csv", {"t": time, "q": np.sin(time), "v": np.cos(time)})


# Real data


def identified(loaded: LoadedRecordings, robot: Robot) -> Fitted:
    return identify(robot.model_copy(update={"identification": loaded.settings}), loaded.recordings)


def test_the_emps_log(shared_data: Path, emps: Robot) -> None:
    loaded = load_recording(shared_data / "emps" / "DATA_EMPS.mat", emps)
    (recording,) = loaded.recordings
    assert loaded.settings == emps.identification
    assert loaded.capture is None
    assert recording.reference is not None
    assert (
        recording.position.shape == recording.reference.shape == recording.control_signal.shape == (24841, 1)
    )
    assert recording.sample_time == pytest.approx(1e-3)
    # Volts as they stand: within the amplifier's ±10.
    assert 1.0 < np.abs(recording.control_signal).max() <= 10.0
    assert np.abs(recording.reference - recording.position).max() < 2e-3


def test_the_tx40_log(shared_data: Path, tx40: Robot) -> None:
    loaded = load_recording(shared_data / "tx40", tx40)
    (recording,) = loaded.recordings
    assert recording.reference is None
    assert recording.sample_time == pytest.approx(2e-4)
    assert loaded.settings.decimation == 50
    assert loaded.settings.friction_width == 0.02
    assert loaded.settings.offset == tx40.identification.offset
    estimate = identified(loaded, tx40).result.least_squares
    assert round(estimate.relative_error_percent, 3) == 7.331


@pytest.mark.parametrize("name", robots.shipped())
def test_every_shipped_arm_has_a_column_map(name: str) -> None:
    robot = robots.load(name)
    columns = load_import_map(robot.folder / "import.toml")
    assert len(columns.position.columns) == robot.n


# Conversion


@given(
    seed=st.integers(0, 2**32),
    unit=st.sampled_from(["rad", "deg"]),
    side=st.sampled_from(["motor", "drive", "joint"]),
)
@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_positions_and_torques_from_every_side(
    seed: int, unit: str, side: str, tmp_path: Path, tx40: Robot
) -> None:
    generator = np.random.default_rng(seed)
    position = generator.normal(size=(20, 6))
    signal = generator.normal(size=(20, 6))
    drive_torque = signal * tx40.gains
    drive_position = position @ tx40.transmission_matrix.T
    sides = {
        "joint": (position, tx40.joint_torque(signal)),
        "drive": (drive_position, drive_torque),
        "motor": (drive_position * RATIO, drive_torque / RATIO),
    }
    moved, torque = sides[side]
    if unit == "deg":
        moved = np.degrees(moved)
    ratio = {"ratio": RATIO} if side == "motor" else {}
    columns = write_map(
        tmp_path,
        {
            "format": 1,
            "time": {"sample_rate_hz": 1000.0},
            "position": {"file": "q.csv", "columns": NAMES, "unit": unit, "side": side, **ratio},
            "torque": {"file": "t.csv", "columns": NAMES, "unit": "mN*m", "side": side, **ratio},
        },
    )
    write_csv(tmp_path / "q.csv", dict(zip(NAMES, moved.T, strict=True)))
    write_csv(tmp_path / "t.csv", dict(zip(NAMES, torque.T * 1e3, strict=True)))
    (recording,) = load_recording(tmp_path, tx40, columns).recordings
    assert recording.position == pytest.approx(position, rel=1e-9, abs=1e-12)
    assert recording.control_signal == pytest.approx(signal, rel=1e-9, abs=1e-12)


def test_units_scale_and_offset(tmp_path: Path, emps: Robot) -> None:
    log = write_csv(tmp_path / "log.csv", {"t": [0, 1, 2, 3], "q": [1, 2, 3, 4], "v": [5, 6, 7, 8]})
    content = AXIS | {
        "time": {"column": "t", "unit": "ms"},
        "position": {"columns": ["q"], "unit": "mm", "offset": [0.5]},
        "reference": {"columns": ["q"], "unit": "m"},
        "control_signal": {"columns": ["v"], "scale": 0.1},
    }
    (recording,) = load_recording(log, emps, write_map(tmp_path, content)).recordings
    assert recording.time == pytest.approx([0.0, 0.001, 0.002, 0.003])
    assert recording.position[:, 0] == pytest.approx([0.501, 0.502, 0.503, 0.504])
    assert recording.reference == pytest.approx(np.array([[1.0], [2.0], [3.0], [4.0]]))
    assert recording.control_signal[:, 0] == pytest.approx([0.5, 0.6, 0.7, 0.8])


def test_matrices_of_a_mat_file_have_numbered_columns(tmp_path: Path, tx40: Robot) -> None:
    position, signal = samples(0, 50).position, samples(0, 50).control_signal
    savemat(tmp_path / "log.mat", {"q": position, "v": signal, "note": "text is no column"})
    content = {
        "format": 1,
        "time": {"sample_rate_hz": 250.0},
        "position": {"columns": [f"q:{k}" for k in range(1, 7)], "unit": "rad"},
        "control_signal": {"columns": [f"v:{k}" for k in range(1, 7)]},
    }
    (recording,) = load_recording(tmp_path / "log.mat", tx40, write_map(tmp_path, content)).recordings
    assert np.array_equal(recording.position, position)
    assert np.array_equal(recording.control_signal, signal)


# Settings of the column map


def test_settings_of_the_map_take_the_place_of_the_robots(
    axis_log: Path, tmp_path: Path, emps: Robot
) -> None:
    content = AXIS | {"identification": {"cutoff_hz": 30, "trim_samples": [5, 6]}}
    found = load_recording(axis_log, emps, write_map(tmp_path, content)).settings
    assert found == emps.identification.model_copy(update={"cutoff_hz": 30.0, "trim_samples": (5, 6)})


# Mistakes


def change(content: Map, path: str, value: Any) -> Map:
    table, _, key = path.rpartition(".")
    return content | ({table: content.get(table, {}) | {key: value}} if table else {key: value})


@pytest.mark.parametrize(
    ("path", "value", "reason"),
    [
        ("format", 2, "columns.toml:1: format: 2 is not allowed; allowed: 1"),
        (
            "position.unit",
            "grad",
            'position.unit: "grad" is not allowed; allowed: "rad", "deg", "m", "mm" or "deg, mm"',
        ),
        ("position.columns", [], "position.columns: [] is not allowed"),
        ("position.columns", ["q", "v"], "the column map gives 2 position columns; emps has 1 joints"),
        ("position.columns", ["x"], "log.csv: no variable 'x'; present: q, t, v"),
        ("position.colums", ["q"], 'position.colums: ["q"] is given to a key that does not exist'),
        ("position.side", "motor", "position: ratio is needed for side 'motor'"),
        ("position.ratio", [2.0], "position: ratio is needed for side 'motor' and only allowed there"),
        ("position.offset", [1.0, 2.0], "the column map gives 2 offsets"),
        ("position.offset", [float("nan")], "position.offset[1]: nan is not allowed"),
        ("time.sample_rate_hz", 10.0, "time: give either column or sample_rate_hz"),
        ("time.unit", "min", 'time.unit: "min" is not allowed; allowed: "s", "ms", "us" or "ns"'),
        ("torque", {"columns": ["v"], "unit": "N"}, "give either torque or control_signal"),
        ("control_signal.scale", 0.0, "control_signal.scale: 0.0 is not allowed"),
        (
            "identification.cutoff_hz",
            -1.0,
            "identification.cutoff_hz: -1.0 is not allowed; allowed: a number from 0.001 to",
        ),
        ("identification.cutof", 1.0, "identification.cutof: 1.0 is given to a key that does not exist"),
        ("identification.trim_samples", [1], "identification.trim_samples[2]: missing"),
        ("identification.friction_sign", "tanh", 'friction_width: does not go with friction_sign "tanh"'),
        ("identification.derivative_accuracy", 3, "identification.derivative_accuracy: 3 is not allowed"),
    ],
)
def test_a_wrong_map_is_one_line(
    path: str, value: Any, reason: str, axis_log: Path, tmp_path: Path, emps: Robot
) -> None:
    columns = write_map(tmp_path, change(AXIS, path, value))
    with pytest.raises(CaptureError) as caught:
        load_recording(axis_log, emps, columns)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("t,q,v\n0,1\n", "2 columns under 3 names"),
        ("t,q,v\n0,1,2\n0,1,x\n", "is not a table of numbers under one header line"),
        ("t,q,v\n0,1,x\n", "column 'v' holds text; allowed: one of numbers"),
        ("t,q,v\n", "is empty"),
        ("", "is empty"),
        ("t,q,q\n0,1,2\n", "two columns of the header have the same name"),
        ("t,q\n0,1,2\n", "3 columns under 2 names"),
        ("t,q,v\n0,1,2\n1,nan,2\n2,3,4\n", "'q' is not a number at sample 1 (1 in all)"),
    ],
)
def test_a_wrong_table_is_one_line(text: str, reason: str, tmp_path: Path, emps: Robot) -> None:
    log = tmp_path / "log.csv"
    log.write_text(text)
    with pytest.raises(CaptureError) as caught:
        load_recording(log, emps, write_map(tmp_path, AXIS))
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"", b"text", b"MATLAB 5.0 MAT-file" + bytes(200), bytes(300)])
def test_a_wrong_mat_file_is_one_line(content: bytes, tmp_path: Path, emps: Robot) -> None:
    log = tmp_path / "log.mat"
    log.write_bytes(content)
    with pytest.raises(CaptureError) as caught:
        load_recording(log, emps, write_map(tmp_path, AXIS))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "reason"),
    [("none.csv", "no such file"), ("log.xlsx", "cannot be imported; allowed: .csv, .mat")],
)
def test_other_files_are_one_line(name: str, reason: str, tmp_path: Path, emps: Robot) -> None:
    (tmp_path / "log.xlsx").write_bytes(b"PK")
    with pytest.raises(CaptureError, match=reason):
        load_recording(tmp_path / name, emps, write_map(tmp_path, AXIS))


def test_a_map_that_is_not_there(axis_log: Path, tmp_path: Path, emps: Robot) -> None:
    with pytest.raises(CaptureError, match=r"none\.toml: no such file; allowed: a column map"):
        load_recording(axis_log, emps, tmp_path / "none.toml")


# Captures


def test_a_capture_becomes_one_recording(
    tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = record(tmp_path / "run.mcap", tx40, [samples(0, 3000)], monkeypatch)
    loaded = load_recording(path, tx40)
    (recording,) = loaded.recordings
    assert recording.name == "run.mcap"
    assert np.array_equal(recording.position, samples(0, 3000).position)
    assert np.array_equal(recording.reference, samples(0, 3000).reference)
    assert loaded.settings == tx40.identification
    assert loaded.capture is not None
    assert loaded.warnings == ()


def test_limits_that_acted_inside_a_drive_are_told(
    tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    batch = samples(0, 3000)
    batch.statusword[100:117, 3] |= 0x800
    path = record(tmp_path / "run.mcap", tx40, [batch], monkeypatch)
    loaded = load_recording(path, tx40)
    assert loaded.warnings == (f"{path}: a limit inside drive 4 acted in 17 cycles (statusword bit 11)",)


def test_gaps_part_a_capture_and_short_pieces_are_left_out_aloud(
    tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    batches = [samples(0, 2000), samples(2100, 1999), samples(4200, 2500)]
    path = record(tmp_path / "run.mcap", tx40, batches, monkeypatch)
    loaded = load_recording(path, tx40)
    assert [recording.name for recording in loaded.recordings] == ["run.mcap, piece 1", "run.mcap, piece 2"]
    assert [recording.time[0] for recording in loaded.recordings] == [0.0, 4.2]
    assert [len(recording.time) for recording in loaded.recordings] == [2000, 2500]
    assert loaded.warnings == (
        f"{path}: cycles 2000 to 2099 are missing (0.100 s)",
        f"{path}: cycles 4099 to 4199 are missing (0.101 s)",
        f"{path}: pieces between gaps shorter than 2 s were left out: 1 of 3, 2 of 6.5 s",
    )
    assert len(capture_recordings(read_capture(path))) == 2
    assert "were left out: 1 of 3" in caplog.text


def test_a_capture_of_nothing_but_short_pieces_is_refused(
    tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = record(tmp_path / "run.mcap", tx40, [samples(0, 900), samples(1000, 1000)], monkeypatch)
    with pytest.raises(CaptureError, match=r"longest piece without a gap is 1 s long; allowed: pieces of at"):
        load_recording(path, tx40)


def test_drives_that_never_answered(tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    silent = samples(0, 3000)
    silent.complete[:, 2] = False
    path = record(tmp_path / "run.mcap", tx40, [silent], monkeypatch)
    with pytest.raises(CaptureError, match="some drive never answered"):
        load_recording(path, tx40)


def test_a_capture_of_another_arm_is_refused(
    tmp_path: Path, tx40: Robot, emps: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = record(tmp_path / "run.mcap", tx40, [samples(0, 3000)], monkeypatch)
    with pytest.raises(
        CaptureError, match=r"recorded of tx40 with the joints joint_1, .*; emps has carriage"
    ):
        load_recording(path, emps)


# The reference


@pytest.mark.parametrize(
    ("heading", "model"),
    [
        ("## Top level", ImportMap),
        ("## [time]", Time),
        ("## [position]", Position),
        ("## [torque]", Torque),
        ("## [control_signal]", ControlSignal),
    ],
)
def test_the_reference_has_every_key(heading: str, model: type[BaseModel], repository: Path) -> None:
    text = (repository / "docs" / "reference" / "import-toml.md").read_text(encoding="utf-8")
    section = re.split(r"\n## ", text[text.index(f"\n{heading}\n") + 1 :])[0]
    assert sorted(re.findall(r"^\| `(\w+)`", section, re.MULTILINE)) == sorted(keys_of(model))


# TOML text


@given(
    st.dictionaries(
        st.text(st.characters(exclude_categories=["Cs"]), max_size=8),
        st.one_of(
            st.text(st.characters(exclude_categories=["Cs"])),
            st.integers(-(2**63), 2**63 - 1),
            st.floats(allow_nan=False),
            st.booleans(),
            st.lists(st.floats(allow_nan=False), max_size=4),
            st.dictionaries(st.text("abc-1", min_size=1), st.integers(0, 9), max_size=3),
        ),
        max_size=5,
    )
)
def test_toml_text_is_read_back_by_python(content: Map) -> None:
    assert tomllib.loads(toml_text(content)) == content


def test_generated_maps_are_what_the_tests_think(tmp_path: Path) -> None:
    columns = load_import_map(write_map(tmp_path, AXIS))
    assert columns.position.columns == ("q",)
    assert columns.identification == {}


@pytest.mark.parametrize(("key", "value"), [("q", 1e308), ("v", -1e308), ("v", 1e200), ("q", 1e7)])
def test_a_figure_beyond_any_arm_is_one_line(tmp_path: Path, emps: Robot, key: str, value: float) -> None:
    """1e308 is finite, and its square is not: linear algebra ended in a traceback."""
    time = np.arange(3000) * 0.002
    table = {"t": time, "q": 0.1 * np.sin(2 * time), "v": np.cos(2 * time)}
    table[key][1500] = value
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack(list(table.values())), delimiter=",", header="t,q,v", comments="")
    with pytest.raises(UserError, match=r"of joint 1 is \S+ at sample 1500; allowed: up to"):
        load_recording(path, emps, write_map(tmp_path, AXIS))


@pytest.mark.parametrize("suffix", [".npz", ".csv", ".mat"])
def test_a_pointer_of_git_lfs_is_told_from_a_damaged_file(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"log{suffix}"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:55b9\nsize 2012328\n", "utf-8")
    with pytest.raises(CaptureError, match=r"only points to a file that Git LFS keeps.*git lfs pull"):
        read_table(path)
