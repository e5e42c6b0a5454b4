"""Several torques that are named equally, a damaged column beside them, and joints that never turn back."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pinocchio
import pytest

from daq.importing.guess_log import GuessedLog, guess_log
from daq.importing.guess_torque import LogHints
from daq.importing.load import load_recording
from daq.importing.proof import slope_between
from ident import Options, identify
from robots.arrays import FloatArray
from tests.daq.importing.made_arms import seven_axes

PERIOD, ROWS, DRY = 0.004, 2500, 2.0
ONE_WAY = [1, 4]
"""Joints, from 0, that never turn back."""


@pytest.fixture(scope="module")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("seven") / "seven.urdf"
    path.write_text(seven_axes(), "utf-8")
    return path


def moved(one_way: list[int]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Positions, speeds and accelerations of seven joints, samples × 7; some only go forwards."""
    generator = np.random.default_rng(5)
    t = np.arange(ROWS) * PERIOD
    q, v, a = (np.zeros((ROWS, 7)) for _ in range(3))
    for joint in range(7):
        for tone in (0.25, 0.6, 1.0):
            w, phase, size = 2 * np.pi * tone, generator.uniform(0, 6), 0.05 / tone
            q[:, joint] += size * np.sin(w * t + phase)
            v[:, joint] += size * w * np.cos(w * t + phase)
            a[:, joint] -= size * w**2 * np.sin(w * t + phase)
    slow = 1.02 * -v[:, one_way].min(axis=0, initial=0.0)
    v[:, one_way] += slow
    q[:, one_way] += slow * (t[:, np.newaxis] - t[-1] / 2)
    return 0.5 * q, 0.5 * v, 0.5 * a


def columns_of(urdf: Path, one_way: list[int]) -> dict[str, FloatArray]:
    """Time in ms, positions, and two torques: what the bodies ask for, and what the drives give for it."""
    q, v, a = moved(one_way)
    model = pinocchio.buildReducedModel(
        pinocchio.buildModelFromUrdf(str(urdf)), [8, 9], np.zeros(9)
    )  # its fingers rest
    data = model.createData()
    bodies = np.array([pinocchio.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])
    noise = np.random.default_rng(6).standard_normal((2, ROWS, 7))
    given = bodies + 0.1 * a + 1.5 * v + DRY * np.sign(v) + 0.1 * noise[0]
    groups = {"Position": q + 1e-6 * noise[1], "Torque": bodies, "TorqueCur": given}
    found = {"Time": 1e3 * PERIOD * np.arange(ROWS)}
    for stem, values in groups.items():
        found |= {f"{stem}{k + 1}": values[:, k] for k in range(7)}
    return found


def guessed(tmp_path: Path, urdf: Path, columns: dict[str, FloatArray]) -> tuple[Path, GuessedLog]:
    log, folder = tmp_path / "log.csv", tmp_path / "guess"
    folder.mkdir()
    table = np.column_stack(list(columns.values()))
    np.savetxt(log, table, fmt="%.9g", delimiter=",", header=",".join(columns), comments="")
    return log, guess_log(log, urdf, folder, LogHints())


def torques(found: GuessedLog) -> str:
    return str(found.columns["torque"]["columns"][0])


def test_friction_tells_a_measured_torque_from_a_computed_one(tmp_path: Path, urdf: Path) -> None:
    columns = columns_of(urdf, [])
    _, found = guessed(tmp_path, urdf, columns)
    assert torques(found) == "TorqueCur1"
    (said,) = [words for words in found.words if "of several" in words]
    assert said == ("torque, of several: TorqueCur1 … TorqueCur7; in Torque1 … Torque7 no friction brakes")


def test_a_computed_torque_may_be_the_rougher_one(tmp_path: Path, urdf: Path) -> None:
    """A controller that differentiates measured positions makes noise, but no friction."""
    columns, lot = columns_of(urdf, []), np.random.default_rng(7)
    for k in range(1, 8):
        columns[f"Torque{k}"] = columns[f"Torque{k}"] + 0.5 * lot.standard_normal(ROWS)
    _, found = guessed(tmp_path, urdf, columns)
    assert torques(found) == "TorqueCur1"


def test_of_two_with_friction_the_rougher_one_was_measured(tmp_path: Path, urdf: Path) -> None:
    columns = columns_of(urdf, [])
    clean = np.convolve(np.arange(5.0), np.ones(5))  # a window without corners
    for k in range(1, 8):
        columns[f"Torque{k}"] = np.convolve(columns[f"TorqueCur{k}"], clean / clean.sum(), "same")
    _, found = guessed(tmp_path, urdf, columns)
    assert torques(found) == "TorqueCur1"
    assert any("Torque1 … Torque7 are smoother" in words for words in found.words)


def test_a_torque_that_never_changes_is_none(tmp_path: Path, urdf: Path) -> None:
    columns = columns_of(urdf, [])
    for k in range(1, 8):
        columns[f"Torque{k}"] = np.zeros(ROWS)
    _, found = guessed(tmp_path, urdf, columns)
    assert torques(found) == "TorqueCur1"
    assert not any("of several" in words for words in found.words)


def test_values_whose_squares_are_too_large_are_compared_all_the_same() -> None:
    small = np.random.default_rng(0).standard_normal((100, 3))
    large = small * np.array([1e160, 2e160, 1e160])
    large[7, 2] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        slope, correlation = slope_between(small, large)
    assert correlation == pytest.approx(1.0)
    assert slope == pytest.approx(1.5e160)


def test_joints_that_never_turn_back_have_no_offset(tmp_path: Path, urdf: Path) -> None:
    """Dry friction of such a joint is a constant torque, and so is an offset: the log was refused."""
    log, found = guessed(tmp_path, urdf, columns_of(urdf, ONE_WAY))
    assert found.robot.identification.offset == tuple(k not in ONE_WAY for k in range(7))
    assert "j2, j5 move one way only: their dry friction holds what is constant of the torque" in found.words
    recordings = load_recording(log, found.robot, tmp_path / "guess" / "import.toml").recordings
    result = identify(found.robot, recordings, options=Options(method="ls")).result
    assert any("one way only: dry friction of joint 2, 5 holds" in words for words in result.warnings)
    estimate = result.least_squares
    value = {p.name: p for p in estimate.parameters}
    assert {"off1", "off3"} <= set(value) and not {"off2", "off5"} & set(value)
    for joint in range(1, 8):
        dry = value[f"Fc{joint}"]
        assert dry.value == pytest.approx(DRY, abs=max(5 * dry.sigma, 0.1))


def test_joints_that_turn_have_one_each(tmp_path: Path, urdf: Path) -> None:
    _, found = guessed(tmp_path, urdf, columns_of(urdf, []))
    assert found.robot.identification.offset is True
