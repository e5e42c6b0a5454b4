"""Velocities and forces in a log: torques by pin, velocities that are exact but for their own noise."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
import pytest

from daq.files.toml_text import toml_text
from daq.importing.load import load_recording
from daq.recording.capture import CaptureError
from ident import IdentificationError, Options, identify
from ident.preparation.velocities import with_velocities
from ident.results import Estimate
from robots.arrays import FloatArray
from tests.ident.pinocchio_arm import STEP, course, links_of, record, tx40

SECONDS, ENCODER, SEED = 8.0, 2e-4, 7
NAMES = [f"{{}}{k}" for k in range(1, 7)]


def columns(letter: str) -> list[str]:
    return [name.format(letter) for name in NAMES]


def wrench(time: FloatArray) -> FloatArray:
    """samples × 6: a tool that is pressed and twisted, N and N·m."""
    phase = np.outer(time, [1.1, 1.7, 2.3, 3.1, 0.7, 2.9])
    return np.sin(2 * np.pi * phase) * [20.0, 15.0, 25.0, 2.0, 3.0, 1.5]


def pressed(q: FloatArray, forces: FloatArray, frame: str) -> FloatArray:
    """Joint torques that the drives make against a wrench, by pin's external forces."""
    model = links_of(tx40())
    data = model.createData()
    torque = np.empty_like(q)
    number = model.getFrameId(frame)
    joint, at = model.frames[number].parentJoint, model.frames[number].placement
    still = np.zeros(model.nv)
    for k in range(len(q)):
        outside = pinocchio.StdVec_Force()
        outside.extend(pinocchio.Force.Zero() for _ in range(model.njoints))
        outside[joint] = at.act(pinocchio.Force(forces[k]))
        torque[k] = pinocchio.rnea(model, data, q[k], still, still, outside) - pinocchio.rnea(
            model, data, q[k], still, still
        )
    return torque


def log_of(folder: Path, more: dict[str, FloatArray], torque: FloatArray | None = None) -> Path:
    recording = record(SEED, encoder=ENCODER, seconds=SECONDS)
    signal = recording.control_signal
    if torque is not None:
        signal = signal + tx40().control_signal(torque)
    parts = {"q": recording.position, "v": signal, **more}
    header = ["t", *(name for letter in parts for name in columns(letter))]
    path = folder / "log.csv"
    table = np.column_stack([recording.time, *parts.values()])
    np.savetxt(path, table, delimiter=",", header=",".join(header), comments="", fmt="%.12g")
    return path


def loaded(folder: Path, log: Path, **tables: dict[str, Any]) -> Any:
    settings = {"cutoff_hz": 20.0, "decimation": 10, "control_signal_lag": 0.0, "covariance": "hac"}
    content = {
        "format": 1,
        "time": {"column": "t"},
        "position": {"columns": columns("q"), "unit": "rad"},
        "control_signal": {"columns": columns("v")},
        **tables,
        "identification": settings,
    }
    path = folder / "columns.toml"
    path.write_text(toml_text(content), "utf-8")
    return load_recording(log, tx40(), path)


def estimate_of(part: Any) -> Estimate:
    robot = tx40().model_copy(update={"identification": part.settings})
    return identify(robot, part.recordings, options=Options(method="ls")).result.least_squares


def error_of(estimate: Estimate) -> float:
    """Mean distance from what exact positions give, in what those have for σ."""
    exact = identify(tx40(), (record(SEED, encoder=0.0, noise=0.3, seconds=SECONDS),), options=Options("ls"))
    best = exact.result.least_squares
    return float(np.median(np.abs(estimate.values - best.values) / np.sqrt(np.diag(best.covariance))))


def test_velocities_that_are_better_than_differences_are_used(tmp_path: Path) -> None:
    _, v, _ = course(tx40(), SEED, SECONDS)
    shaken = v + 1e-4 * np.random.default_rng(1).standard_normal(v.shape)
    log = log_of(tmp_path, {"w": shaken})
    table = {"columns": columns("w"), "unit": "rad/s"}
    plain, used = loaded(tmp_path, log), loaded(tmp_path, log, velocity=table)
    assert any("better than differentiated positions at joint 1, 2, 3, 4, 5, 6" in w for w in used.warnings)
    q, _, _ = course(tx40(), SEED, SECONDS)
    rates = [np.diff(part.recordings[0].position, axis=0) - np.diff(q, axis=0) for part in (plain, used)]
    assert np.std(rates[1]) < 0.05 * np.std(rates[0])
    assert error_of(estimate_of(used)) < 0.7 * error_of(estimate_of(plain))


def test_velocities_that_are_worse_are_left_alone(tmp_path: Path) -> None:
    _, v, _ = course(tx40(), SEED, SECONDS)
    log = log_of(tmp_path, {"w": v + 0.5 * np.random.default_rng(1).standard_normal(v.shape)})
    plain = loaded(tmp_path, log)
    used = loaded(tmp_path, log, velocity={"columns": columns("w"), "unit": "rad/s"})
    assert any("no better than these" in words for words in used.warnings)
    np.testing.assert_array_equal(plain.recordings[0].position, used.recordings[0].position)


def test_a_late_velocity_is_taken_at_its_time() -> None:
    time = STEP * np.arange(3000)
    q = np.sin(2 * np.pi * 0.7 * time)[:, None]
    late = 2 * np.pi * 0.7 * np.cos(2 * np.pi * 0.7 * (time - 0.004))[:, None]
    generator = np.random.default_rng(0)
    shaken = q + 1e-4 * generator.standard_normal(q.shape)
    both = with_velocities("x", time, shaken, late + 1e-4 * generator.standard_normal(q.shape), 30.0)
    lag = float(both.words[0].split("velocities, ")[1].split(" ms late")[0])
    assert lag == pytest.approx(4.0, abs=0.1)
    middle = slice(50, -50)
    assert np.std((both.position - q)[middle]) < 0.5e-4


@pytest.mark.parametrize(("factor", "said"), [(57.3, "is 57.[23]"), (-1.0, "is -(1|0.99)")])
def test_a_velocity_that_is_no_derivative_is_refused(tmp_path: Path, factor: float, said: str) -> None:
    _, v, _ = course(tx40(), SEED, SECONDS)
    log = log_of(tmp_path, {"w": factor * v})
    with pytest.raises(IdentificationError, match=said):
        loaded(tmp_path, log, velocity={"columns": columns("w"), "unit": "rad/s"})


def test_a_measured_force_is_no_torque_of_the_arm(tmp_path: Path) -> None:
    q, _, _ = course(tx40(), SEED, SECONDS)
    time = STEP * np.arange(len(q))
    forces = wrench(time)
    last = [f.name for f in links_of(tx40()).frames if "BODY" in str(f.type)][-1]
    log = log_of(tmp_path, {"f": forces}, pressed(q, forces, last))
    told = loaded(tmp_path, log, force={"columns": columns("f"), "frame": last})
    turned = loaded(tmp_path, log, force={"columns": columns("f"), "acts": "by_arm"})
    np.testing.assert_array_equal(turned.recordings[0].outside, -told.recordings[0].outside)
    untold = loaded(tmp_path, log)
    left = [estimate_of(part).relative_error_percent for part in (told, untold)]
    assert left[0] < 0.4 * left[1]
    free = estimate_of(loaded(tmp_path, log_of(tmp_path, {})))
    assert left[0] < 1.05 * free.relative_error_percent


def test_a_frame_that_is_none_is_refused(tmp_path: Path) -> None:
    log = log_of(tmp_path, {"f": np.zeros((int(SECONDS / STEP), 6))})
    with pytest.raises(CaptureError, match='"hand" is no moving link; allowed: '):
        loaded(tmp_path, log, force={"columns": columns("f"), "frame": "hand"})
    with pytest.raises(CaptureError, match="gives 3 columns of force; allowed: 6"):
        loaded(tmp_path, log, force={"columns": columns("f")[:3]})
    with pytest.raises(CaptureError, match="added: 2 columns of"):
        loaded(tmp_path, log, added={"columns": columns("f")[:2]})


def test_what_was_added_is_a_channel_of_the_recording(tmp_path: Path) -> None:
    fed = np.random.default_rng(0).normal(size=(int(SECONDS / STEP), 6))
    part = loaded(tmp_path, log_of(tmp_path, {"a": fed}), added={"columns": columns("a"), "scale": 2.0})
    added = part.recordings[0].added
    assert added is not None
    np.testing.assert_allclose(added, 2.0 * fed, atol=1e-9)
