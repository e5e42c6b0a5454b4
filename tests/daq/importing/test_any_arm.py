"""Arms of seven axes, with sliding joints, with grippers: from log and URDF alone the truth comes out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from daq.importing.guess_log import GuessedLog, guess_log
from daq.importing.guess_torque import LogHints
from daq.importing.load import load_recording
from ident import Fitted, Options, identify
from robots.arrays import FloatArray
from robots.urdf_pose import exact_angle
from tests.daq.importing.made_arms import ROTOR, VISCOUS, gantry, motion_of, scara, seven_axes

Columns = dict[str, FloatArray]


def numbered(stem: str, values: FloatArray) -> Columns:
    return {f"{stem}{k}": column for k, column in enumerate(values.T, start=1)}


def guessed(tmp_path: Path, urdf: Path, columns: Columns) -> GuessedLog:
    table = np.column_stack(list(columns.values()))
    np.savetxt(tmp_path / "log.csv", table, delimiter=",", header=",".join(columns), comments="")
    (tmp_path / "guess").mkdir()
    return guess_log(tmp_path / "log.csv", urdf, tmp_path / "guess", LogHints())


def fitted(tmp_path: Path, found: GuessedLog) -> Fitted:
    """At 20 Hz: the products of speeds are faster than the motion, which alone says the guessed cut-off."""
    changes = {"cutoff_hz": 20.0, "decimation": 12}
    settings = found.robot.identification.model_copy(update=changes)
    robot = found.robot.model_copy(update={"identification": settings})
    return identify(robot, load_recording(tmp_path / "log.csv", robot).recordings, options=Options())


def deviations(fit: Fitted) -> FloatArray:
    """(b,) how far the estimate is from what the log was made of, in σ.

    Without dry friction: the low-pass rounds its steps, which takes half a percent off it.
    """
    model = fit.base.model
    truth = model.prior().copy()
    for k, name in enumerate(model.names):
        for stem, value in (("Ia", ROTOR), ("Fv", VISCOUS), ("Fc", 0.0), ("off", 0.0)):
            if name.startswith(stem):
                truth[k] = value
    estimate = fit.result.least_squares
    sigma = np.array([parameter.sigma for parameter in estimate.parameters])
    return np.asarray((estimate.values - fit.base.regroup(truth)) / sigma)


def test_seven_axes_with_a_gripper_that_the_log_does_not_have(tmp_path: Path) -> None:
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(seven_axes())
    t, q, v, torque = motion_of(urdf, [0.5] * 7, dry=0.0)
    found = guessed(
        tmp_path, urdf, {"time": t, **numbered("q", q), **numbered("dq", v), **numbered("tau_J", torque)}
    )
    assert [joint.name for joint in found.robot.joint] == [f"j{k}" for k in range(1, 8)]
    assert "left out (at rest, or not in the log): finger1" in found.words
    off = deviations(fitted(tmp_path, found))
    assert np.sqrt(np.mean(off**2)) < 1.5
    assert np.abs(off).max() < 5.0


@pytest.mark.parametrize(
    ("text", "sizes", "units"),
    [(scara, [0.7, 0.7, 0.08, 1.5], ("N*m", "N*m", "N", "N*m")), (gantry, [0.4, 0.3, 0.15], ("N", "N", "N"))],
)
def test_joints_that_slide_are_in_metres_and_newtons(
    tmp_path: Path, text: object, sizes: list[float], units: tuple[str, ...]
) -> None:
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(text())  # type: ignore[operator]
    t, q, _, torque = motion_of(urdf, sizes, dry=0.0)
    found = guessed(tmp_path, urdf, {"t": t, **numbered("q", q), **numbered("force", torque)})
    fit = fitted(tmp_path, found)
    dry = {p.name: p.unit for p in fit.result.least_squares.parameters if p.name.startswith("Fc")}
    assert [dry[f"Fc{k}"].replace("·", "*") for k in range(1, len(sizes) + 1)] == list(units)
    off = deviations(fit)
    assert np.sqrt(np.mean(off**2)) < 1.5
    assert np.abs(off).max() < 5.0


def test_degrees_and_millimetres_beside_each_other(tmp_path: Path) -> None:
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(scara())
    t, q, _, torque = motion_of(urdf, [0.7, 0.7, 0.08, 1.5], 4.0)
    scale = np.array([180 / np.pi, 180 / np.pi, 1e3, 180 / np.pi])
    columns = {"t": t, **numbered("pos", q * scale), **numbered("pos_ref", q), **numbered("tau", torque)}
    found = guessed(tmp_path, urdf, columns)
    assert found.columns["position"]["unit"] == "deg, mm"
    assert found.columns["reference"]["unit"] == "rad"
    (recording,) = load_recording(tmp_path / "log.csv", found.robot).recordings
    assert recording.position == pytest.approx(q, abs=1e-9)
    assert recording.reference == pytest.approx(q, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "quarters"),
    [
        ("1.57", 1),
        ("-1.5708", -1),
        ("3.1415", 2),
        ("3.1416", 2),
        ("-1.571", -1),
        *((text, None) for text in ("1.58", "1.6", "0.01", "0.00", "1.5757", "2")),
    ],
)
def test_a_rounded_right_angle_is_one(text: str, quarters: int | None) -> None:
    assert exact_angle(text) == (float(text) if quarters is None else quarters * np.pi / 2)


def test_a_cut_off_that_takes_torque_is_raised(tmp_path: Path) -> None:
    """Four axes that move at 1 Hz: their bodies make torque that is faster, which 5 Hz would not foretell."""
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(scara())
    t, q, _, torque = motion_of(urdf, [0.7, 0.7, 0.08, 1.5], 20.0)
    found = guessed(tmp_path, urdf, {"t": t, **numbered("q", q), **numbered("tau", torque)})
    settings = found.robot.identification
    assert settings.cutoff_hz == 20.0
    assert settings.decimation == 12
    assert any(words.startswith("cut-off: 20 Hz") for words in found.words)
    recordings = load_recording(tmp_path / "log.csv", found.robot).recordings
    result = identify(found.robot, recordings).result
    assert result.least_squares.relative_error_percent < 0.3
