"""Exports: what other programs read is what was recorded, and it comes back through the import."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import can
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import loadmat

from daq.exporting.export import FORMATS, export_capture, export_json
from daq.importing.load import load_recording
from daq.importing.log_import import import_log
from daq.recording.capture import CaptureError, select
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from drivers import Samples
from robots import Robot
from tests.daq.captures import facts, outcome, record, samples, traffic

ROWS = 60


@pytest.fixture
def capture(tmp_path: Path, tx40: Robot) -> Path:
    path = tmp_path / "run.mcap"
    with Recorder(path, tx40, facts(tx40)) as recorder:
        recorder.write(samples(0, ROWS))
        recorder.write_frames(traffic(tx40, 30))
        recorder.finish(outcome(ROWS))
    return path


def noisy(seed: int, joints: int) -> Samples:
    """Samples with numbers of every size."""
    generator = np.random.default_rng(seed)

    def numbers() -> np.ndarray:
        return generator.normal(size=(ROWS, joints)) * 10.0 ** generator.integers(-12, 3, (ROWS, joints))

    plain = samples(0, ROWS, joints)
    return Samples(
        cycle=plain.cycle,
        time=plain.time,
        reference=numbers(),
        position=numbers(),
        control_signal=numbers(),
        statusword=plain.statusword,
        complete=generator.random((ROWS, joints)) < 0.9,
        lateness=plain.lateness,
    )


@given(seed=st.integers(0, 2**32), kind=st.sampled_from(["csv", "parquet", "mat"]), six=st.booleans())
@settings(max_examples=6, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_samples_come_back_bit_for_bit(
    seed: int,
    kind: str,
    six: bool,
    tmp_path_factory: pytest.TempPathFactory,
    tx40: Robot,
    emps: Robot,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder = tmp_path_factory.mktemp("round")
    robot = tx40 if six else emps
    made = noisy(seed, robot.n)
    source = record(folder / "run.mcap", robot, [made], monkeypatch)
    exported = export_capture(source, kind)
    assert exported.map is not None
    assert exported.rows == ROWS
    found = import_log(exported.path, robot, exported.map, folder / "back.mcap").capture
    for field in ("cycle", "reference", "position", "control_signal", "complete"):
        assert np.array_equal(getattr(found.samples, field), getattr(made, field)), field
    assert found.period == 0.001
    assert found.has_reference
    assert not found.damage


def test_what_no_drive_answered_is_no_data_in_an_exported_table_either(
    tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Straight from the table, with the map that the export wrote; nor is a short gap filled."""
    made = samples(0, 9000)
    made.complete[2500, 3] = False
    kept = np.concatenate([np.arange(5000), np.arange(5003, 9000)])
    source = record(tmp_path / "run.mcap", tx40, [select(made, kept)], monkeypatch)
    exported = export_capture(source, "csv")
    loaded = load_recording(exported.path, tx40, exported.map)
    assert [len(piece.time) for piece in loaded.recordings] == [2500, 2499, 3997]
    own = load_recording(source, tx40).recordings
    for found, wanted in zip(loaded.recordings, own, strict=True):
        assert np.allclose(found.time, wanted.time, atol=1e-9)
        assert np.allclose(found.position, wanted.position, atol=1e-9)


def test_matlab_reads_matrices(capture: Path, tx40: Robot) -> None:
    content = loadmat(export_capture(capture, "mat").path)
    made = samples(0, ROWS)
    assert np.array_equal(content["t"][:, 0], made.time)
    assert np.array_equal(content["q"], made.position)
    assert np.array_equal(content["tau"], tx40.joint_torque(made.control_signal))
    assert np.array_equal(content["e"], made.reference - made.position)
    assert np.array_equal(content["statusword"], made.statusword)


def test_csv_has_a_column_for_each_joint(capture: Path) -> None:
    header, first, *_ = export_capture(capture, "csv").path.read_text().splitlines()
    names = header.split(",")
    assert names[:4] == ["t", "cycle", "q_ref_joint_1", "q_ref_joint_2"]
    row = dict(zip(names, first.split(","), strict=True))
    assert float(row["q_joint_3"]) == samples(0, 1).position[0, 2]


def test_gaps_stay_gaps(tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    source = record(tmp_path / "run.mcap", tx40, [samples(0, 500), samples(520, 500)], monkeypatch)
    exported = export_capture(source, "csv")
    assert exported.warnings == ("cycles 500 to 519 are missing (0.020 s)",)
    assert exported.map is not None
    found = import_log(exported.path, tx40, exported.map, tmp_path / "back.mcap").capture.samples
    known = np.ones(1020, dtype=bool)
    known[500:520] = False
    assert np.array_equal(found.complete.all(axis=1), known)
    assert np.array_equal(found.complete.any(axis=1), known)


def test_the_urdf_is_the_recorded_one(capture: Path, tx40: Robot) -> None:
    exported = export_capture(capture, "urdf")
    assert exported.path.read_text(encoding="utf-8") == tx40.urdf_path.read_text(encoding="utf-8")
    assert (exported.rows, exported.map) == (None, None)


@pytest.mark.parametrize("kind", ["blf", "asc"])
def test_can_tools_read_the_frames(kind: str, capture: Path, tx40: Robot) -> None:
    exported = export_capture(capture, kind)
    sent = traffic(tx40, 30)
    assert exported.rows == len(sent)
    with can.LogReader(exported.path) as reader:
        found = list(reader)
    data = ~sent.is_error
    frames = [message for message in found if not message.is_error_frame]
    assert len(found) == len(sent)
    assert [m.arbitration_id for m in frames] == sent.can_id[data].tolist()
    assert [bytes(m.data) for m in frames] == [
        row[:n].tobytes() for row, n in zip(sent.data[data], sent.dlc[data], strict=True)
    ]
    times = np.array([m.timestamp for m in frames])
    steps = np.diff(sent.stamp[data]) * 1e-9
    assert np.abs(np.diff(times) - steps).max() < 2e-6


def test_nothing_is_overwritten(capture: Path) -> None:
    export_capture(capture, "csv")
    with pytest.raises(CaptureError, match=r"run\.csv: exists already; choose another --out"):
        export_capture(capture, "csv")
    capture.with_name("run.mat.import.toml").write_text("mine")
    with pytest.raises(CaptureError, match=r"run\.mat\.import\.toml: exists already"):
        export_capture(capture, "mat")


def test_refusals_are_one_line(tmp_path: Path, tx40: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    source = record(tmp_path / "run.mcap", tx40, [samples(0, 50)], monkeypatch)
    with pytest.raises(CaptureError, match="holds no raw frames"):
        export_capture(source, "blf")
    assert not (tmp_path / "run.blf").exists()
    with pytest.raises(CaptureError, match="--format 'xls' is not known; allowed: csv, parquet, mat, ros"):
        export_capture(source, "xls")
    with pytest.raises(CaptureError, match="cannot be written"):
        export_capture(source, "csv", tmp_path / "none" / "x.csv")


def test_the_json_names_all(capture: Path) -> None:
    answer = export_json(capture, "csv", export_capture(capture, "csv"))
    json.dumps(answer, allow_nan=False)
    assert answer["rows"] == ROWS
    assert answer["missing"] == []
    assert set(FORMATS) == {"csv", "parquet", "mat", "rosbag2", "urdf", "blf", "asc"}


def test_without_pyarrow_it_says_what_to_install(capture: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    with pytest.raises(CaptureError, match=r"Parquet needs pyarrow; install it with: .* -m pip"):
        export_capture(capture, "parquet")
    assert read_capture(capture).path == capture


def test_a_failed_export_leaves_no_empty_file(
    capture: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(CaptureError, match=r"-m pip install 'armhil\[parquet\]'"):
        export_capture(capture, "parquet", tmp_path / "out.parquet")
    assert list(tmp_path.glob("out*")) == []


def test_two_formats_go_into_one_folder(capture: Path, tmp_path: Path) -> None:
    written = [export_capture(capture, kind, tmp_path / f"arm.{kind}") for kind in ("csv", "mat")]
    assert len({one.map for one in written}) == 2
    assert all(one.map is not None and one.map.is_file() for one in written)
