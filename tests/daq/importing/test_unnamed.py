"""Logs without a header, or whose header says nothing: columns are told apart on the data, or refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.io

from daq.importing.guess_log import GuessedLog, guess_log
from daq.importing.guess_torque import LogHints
from daq.recording.errors import CaptureError
from robots.arrays import FloatArray
from tests.daq.importing.made_arms import DRY, VISCOUS, motion_of, scara

SIZES = [0.7, 0.7, 0.08, 1.5]
Signals = tuple[Path, FloatArray, FloatArray, FloatArray, FloatArray]


@pytest.fixture(scope="module")
def signals(tmp_path_factory: pytest.TempPathFactory) -> Signals:
    urdf = tmp_path_factory.mktemp("arm") / "arm.urdf"
    urdf.write_text(scara())
    return urdf, *motion_of(urdf, SIZES, 8.0)


def guessed(
    tmp_path: Path, urdf: Path, parts: list[FloatArray], header: str = "", **hints: object
) -> GuessedLog:
    np.savetxt(tmp_path / "log.csv", np.column_stack(parts), delimiter=",", header=header, comments="")
    (tmp_path / "guess").mkdir()
    return guess_log(tmp_path / "log.csv", urdf, tmp_path / "guess", LogHints(**hints))  # type: ignore[arg-type]


def names(first: int, step: int = 1) -> list[str]:
    return [f"c{first + step * k}" for k in range(4)]


def test_time_position_velocity_and_torque_in_any_order(tmp_path: Path, signals: Signals) -> None:
    urdf, t, q, v, torque = signals
    found = guessed(tmp_path, urdf, [torque, v, t, q]).columns
    assert found["time"]["column"] == "c9"
    assert found["position"]["columns"] == names(10)
    assert found["torque"]["columns"] == names(1)
    assert "reference" not in found


def test_names_that_say_nothing_are_none(tmp_path: Path, signals: Signals) -> None:
    urdf, t, q, _, torque = signals
    header = ",".join(f"Var{k}" for k in range(1, 10))
    found = guessed(tmp_path, urdf, [t, q, torque], header)
    assert found.columns["position"]["columns"] == [f"Var{k}" for k in range(2, 6)]
    assert any("whose motion foretells the torque" in sentence for sentence in found.words)


def test_joint_by_joint_and_a_sampling_rate(tmp_path: Path, signals: Signals) -> None:
    urdf, t, q, v, torque = signals
    parts = [np.column_stack([q[:, k], v[:, k], torque[:, k]]) for k in range(4)]
    found = guessed(tmp_path, urdf, [np.arange(t.size), *parts], sample_rate=500.0).columns
    assert found["time"] == {"sample_rate_hz": 500.0}
    assert found["position"]["columns"] == names(2, 3)
    assert found["torque"]["columns"] == names(4, 3)


def test_what_was_asked_for_is_never_what_was_measured(tmp_path: Path, signals: Signals) -> None:
    """References stand first, and so do the torques that a controller computed, with and without friction."""
    urdf, t, q, v, torque = signals
    target = q - 1e-6 * np.random.default_rng(1).standard_normal(q.shape)
    smooth = torque - 0.02 * np.std(torque, axis=0) * np.random.default_rng(1).standard_normal(q.shape)
    kernel = np.ones(25) / 25
    asked = np.column_stack([np.convolve(column, kernel, "same") for column in torque.T])
    without = np.column_stack(
        [np.convolve(column, kernel, "same") for column in (smooth - VISCOUS * v - DRY * np.sign(v)).T]
    )
    target = np.column_stack([np.convolve(column, kernel, "same") for column in target.T])
    found = guessed(tmp_path, urdf, [t, target, asked, without, q, v, torque])
    assert found.columns["position"]["columns"] == names(14)
    assert found.columns["torque"]["columns"] == names(22)
    assert found.columns["reference"]["columns"] == names(2)
    said = " ".join(found.words)
    assert "c6 … c9, smoother" in said
    assert "c10 … c13, without friction" in said


def test_two_readings_that_fit_equally_are_refused(tmp_path: Path, signals: Signals) -> None:
    urdf, t, q, v, torque = signals
    other = torque + 0.02 * np.std(torque, axis=0) * np.random.default_rng(5).standard_normal(q.shape)
    with pytest.raises(CaptureError, match=r"c\d+ … c\d+ and c\d+ … c\d+ fit equally as the torque"):
        guessed(tmp_path, urdf, [t, q, v, torque, other])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("count", "c1 may be times or counts"),
        ("no torque", "foretells a torque"),
        ("two clocks", "c1, c2 may be"),
    ],
)
def test_what_cannot_be_told_is_refused(tmp_path: Path, signals: Signals, change: str, message: str) -> None:
    urdf, t, q, v, torque = signals
    noise = np.random.default_rng(6).standard_normal(q.shape)
    parts = {
        "count": [np.arange(t.size), q, v, torque],
        "no torque": [t, q, v, noise],
        "two clocks": [t, 1.01 * t + 5, q, v, torque],
    }[change]
    with pytest.raises(CaptureError, match=message):
        guessed(tmp_path, urdf, parts)


def test_a_recorded_log_without_a_header_and_its_ratios(tmp_path: Path, shared_data: Path) -> None:
    """Every second column, positions and torques in turns, foretells the others too, and less."""
    rec = scipy.io.loadmat(shared_data / "kr300/A/data.mat", struct_as_record=False, squeeze_me=True)["rec"]
    ratio = (1798 / 7, 1872 / 7, 757 / 3, 221, 5032 / 21, 206793 / 1340)
    parts = [rec.time_cont, np.deg2rad(rec.act_pos_mot_deg.T), rec.act_torque_abs_nm.T]
    found = guessed(tmp_path, shared_data / "kr300/kr300.urdf", parts, ratio=ratio).columns
    assert found["position"]["columns"] == [f"c{k}" for k in range(2, 8)]
    assert found["torque"]["columns"] == [f"c{k}" for k in range(8, 14)]
    assert found["torque"]["side"] == "motor"
