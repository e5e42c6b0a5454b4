"""A log and a URDF are enough: what is guessed of logs of another engine's arm, and of real ones."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pinocchio
import pytest

import robots
from daq.importing.guess_log import GuessedLog, guess_log
from daq.importing.guess_torque import LogHints
from daq.importing.load import load_recording
from daq.recording.errors import CaptureError
from ident import Options, identify
from robots.arrays import FloatArray
from tests.daq.calls import Call
from tests.daq.importing.published_logs import EMPS_URDF, PUBLISHED, PublishedLog

URDF = Path(__file__).parents[3] / "robots" / "tx40" / "tx40.urdf"
PERIOD, ROWS = 0.004, 2500
NAMES = [f"joint_{k}" for k in range(1, 7)]
RATIO = np.array([100.0, 100.0, 80.0, 80.0, 50.0, 50.0])
Columns = dict[str, FloatArray]


@pytest.fixture(scope="module")
def motion() -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Time, positions, speeds and joint torques of links of the URDF with friction, rotors and noise."""
    model = pinocchio.buildModelFromUrdf(str(URDF))
    data = model.createData()
    t = np.arange(ROWS) * PERIOD
    phases = np.random.default_rng(3).uniform(0, 6, (6, 3))
    tones = (0.3, 0.7, 1.1)
    angle = 2 * np.pi * np.multiply.outer(t, tones)
    q = 0.25 * np.sin(angle[:, np.newaxis] + phases).sum(axis=2) + np.array([0, 0.2, 1.2, 0, 0.5, 0])
    v = np.gradient(q, PERIOD, axis=0)
    a = np.gradient(v, PERIOD, axis=0)
    torque = np.array([pinocchio.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])
    torque += 0.3 * a * (RATIO / 100) ** 2 + 2.0 * v + 3.0 * np.sign(v)
    noise = np.random.default_rng(4)
    return t, q + 1e-6 * noise.standard_normal(q.shape), v, torque + 0.05 * noise.standard_normal(q.shape)


def numbered(stem: str, values: FloatArray, first: int = 0) -> Columns:
    return {f"{stem}{first + k}": column for k, column in enumerate(values.T)}


def written(path: Path, columns: Columns) -> Path:
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="")
    return path


def guessed(tmp_path: Path, columns: Columns, **hints: object) -> GuessedLog:
    folder = tmp_path / "guess"
    folder.mkdir()
    return guess_log(written(tmp_path / "log.csv", columns), URDF, folder, LogHints(**hints))  # type: ignore[arg-type]


def test_the_columns_of_a_ur_are_known(tmp_path: Path, motion: tuple[FloatArray, ...]) -> None:
    t, q, v, torque = motion
    columns = {
        "timestamp": t,
        **numbered("target_q_", q),
        **numbered("target_qd_", v),
        **numbered("actual_q_", q),
    }
    columns |= {**numbered("actual_qd_", v), **numbered("actual_current_", torque / 12.5)}
    found = guessed(tmp_path, columns | numbered("joint_temperatures_", 40 + 0 * q + t[:, np.newaxis]))
    assert found.columns["time"] == {"column": "timestamp", "unit": "s"}
    assert found.columns["position"] == {"columns": [f"actual_q_{k}" for k in range(6)], "unit": "rad"}
    assert found.columns["reference"]["columns"] == [f"target_q_{k}" for k in range(6)]
    assert found.columns["torque"]["columns"] == [f"actual_current_{k}" for k in range(6)]
    # The scale is that of the URDF's masses, which are the arm's own here.
    assert found.columns["torque"]["gain"] == pytest.approx([12.5] * 6, rel=0.1)
    assert found.columns["temperature"]["columns"] == [f"joint_temperatures_{k}" for k in range(6)]


@pytest.mark.parametrize("name", ["q_ref_", "target_q_", "reference_"])
def test_a_velocity_is_never_a_reference(tmp_path: Path, motion: tuple[FloatArray, ...], name: str) -> None:
    t, q, v, torque = motion
    found = guessed(tmp_path, {"t": t, **numbered("q_", q), **numbered(name, v), **numbered("tau_", torque)})
    assert "reference" not in found.columns
    assert any(name in sentence and "proven as the derivative" in sentence for sentence in found.words)


def test_angles_of_motors_pass_for_degrees_and_that_is_said(
    tmp_path: Path, motion: tuple[FloatArray, ...]
) -> None:
    """No column tells them apart; the sentence names the option, and the joints in its numbers' order."""
    t, q, _, torque = motion
    found = guessed(tmp_path, {"t": t, **numbered("pos_", 45.0 * q), **numbered("tau_", torque)})
    said = next(sentence for sentence in found.words if sentence.startswith("unit of the position"))
    assert "if these are angles of the motors, give --ratio, a number each for joint_1, joint_2" in said


def test_degrees_motor_torques_and_a_turned_sign(tmp_path: Path, motion: tuple[FloatArray, ...]) -> None:
    t, q, _, torque = motion
    sign = np.array([1, 1, 1, -1, 1, 1])
    columns = {
        "time_ms": 1e3 * t,
        **numbered("Pos_deg_", np.rad2deg(q), 1),
        **numbered("Torque", torque / RATIO * sign, 1),
    }
    found = guessed(tmp_path, columns, ratio=tuple(RATIO))
    assert found.columns["time"]["unit"] == "ms"
    assert found.columns["position"]["unit"] == "deg"
    assert found.columns["torque"]["side"] == "motor"
    assert found.columns["torque"]["ratio"] == pytest.approx(RATIO * sign)


def test_what_is_saved_is_what_was_used(tmp_path: Path, motion: tuple[FloatArray, ...]) -> None:
    t, q, _, torque = motion
    found = guessed(tmp_path, {"t": t, **numbered("q", q, 1), **numbered("tau", torque, 1)})
    assert "side" not in found.columns["torque"]
    robot = robots.load(tmp_path / "guess")
    assert not robot.has_drives
    recordings = load_recording(tmp_path / "log.csv", robot).recordings
    result = identify(robot, recordings, options=Options()).result
    assert result.test.verdict == "not_testable"
    values = {p.name: p.value for p in result.least_squares.parameters}
    assert values["Fv1"] == pytest.approx(2.0, rel=0.05)
    assert values["Fc2"] == pytest.approx(3.0, rel=0.05)


def test_units_behind_the_number_of_a_joint(tmp_path: Path, motion: tuple[FloatArray, ...]) -> None:
    t, q, _, torque = motion
    columns = {"Time [s]": t}
    columns |= {f"q_{k}_meas [rad]": q[:, k] for k in range(6)}
    columns |= {f"tau_{k} [Nm]": torque[:, k] for k in range(6)}
    found = guessed(tmp_path, columns)
    assert found.columns["position"]["columns"] == [f"q_{k}_meas [rad]" for k in range(6)]
    assert found.columns["torque"]["columns"] == [f"tau_{k} [Nm]" for k in range(6)]


def test_a_torque_against_the_bodies_is_turned_round(tmp_path: Path, motion: tuple[FloatArray, ...]) -> None:
    """Without friction, which alone shows the sign otherwise."""
    t, q, v, torque = motion
    smooth = torque - 2.0 * v - 3.0 * np.sign(v)
    smooth[:, 1] *= -1
    found = guessed(tmp_path, {"t": t, **numbered("q", q, 1), **numbered("tau", smooth, 1)})
    assert found.columns["torque"]["gain"] == pytest.approx([1, -1, 1, 1, 1, 1])
    assert any("torque of joint_2: turned round" in sentence for sentence in found.words)


def test_a_torque_that_brakes_is_not_turned_by_its_bodies(
    tmp_path: Path, motion: tuple[FloatArray, ...]
) -> None:
    """A URDF may be wrong; friction is not."""
    t, q, v, torque = motion
    friction = 2.0 * v + 3.0 * np.sign(v)
    odd = torque.copy()
    odd[:, 1] = friction[:, 1] - (torque - friction)[:, 1]
    found = guessed(tmp_path, {"t": t, **numbered("q", q, 1), **numbered("tau", odd, 1)})
    assert not any("turned round" in sentence for sentence in found.words)


@pytest.mark.parametrize(
    ("joint", "factor", "said"),
    [(4, 1e-3, "joint_5: at most"), (1, 20.0, "joint_2: at least"), (4, 0.5, "")],
)
def test_a_torque_that_cannot_be_that_of_the_bodies_is_said(
    tmp_path: Path, motion: tuple[FloatArray, ...], joint: int, factor: float, said: str
) -> None:
    """Also where no mass is seen in it: a torque that is too small has a deviation that is too small."""
    t, q, _, torque = motion
    odd = torque.copy()
    odd[:, joint] *= factor
    found = guessed(tmp_path, {"t": t, **numbered("q", q, 1), **numbered("tau", odd, 1)})
    words = [sentence for sentence in found.words if "what the URDF's bodies ask for:" in sentence]
    unseen = [sentence for sentence in found.words if sentence.startswith("scale of the torque of")]
    assert len(words) == bool(said)
    assert all(said in sentence for sentence in words)
    assert len(unseen) == 1
    assert "joint_6: by its column's name alone" in unseen[0]


@pytest.mark.parametrize("order", [[0, 1, 2, 3, 4, 5], [0, 1, 2, 3, 5, 4], [1, 2, 0, 3, 4, 5]])
def test_torques_that_stand_in_the_place_of_others_are_said(
    tmp_path: Path, motion: tuple[FloatArray, ...], order: list[int]
) -> None:
    t, q, _, torque = motion
    found = guessed(tmp_path, {"t": t, **numbered("q", q, 1), **numbered("tau", torque[:, order], 1)})
    said = [sentence for sentence in found.words if "exchanged? look it over" in sentence]
    moved = [k for k in range(6) if order[k] != k]
    assert len(said) == bool(moved)
    assert not moved or said[0].startswith(f"torques of {', '.join(NAMES[k] for k in moved)}:")


def test_values_that_are_no_numbers_are_refused(tmp_path: Path, motion: tuple[FloatArray, ...]) -> None:
    t, q, _, torque = motion
    odd = torque.copy()
    odd[300:305, 3] = np.nan
    found = guessed(tmp_path, {"t": t, **numbered("q", q, 1), **numbered("tau", odd, 1)})
    with pytest.raises(CaptureError, match="'tau4' is not a number at sample 300"):
        load_recording(tmp_path / "log.csv", found.robot)


@pytest.mark.parametrize(("factor", "odd"), [(1.0, False), (8.85, True)])
def test_a_ratio_that_the_masses_contradict_is_said(
    tmp_path: Path, motion: tuple[FloatArray, ...], factor: float, odd: bool
) -> None:
    t, q, _, torque = motion
    columns = {"t": t, **numbered("q", q, 1), **numbered("tau", factor * torque / RATIO, 1)}
    found = guessed(tmp_path, columns, ratio=tuple(RATIO))
    said = next(sentence for sentence in found.words if "ratio that was given" in sentence)
    assert said.endswith("look it over") == odd


def test_a_ratio_of_the_positions_is_not_put_on_torques_at_the_joints(
    tmp_path: Path, motion: tuple[FloatArray, ...]
) -> None:
    t, q, _, torque = motion
    columns = {"t": t, **numbered("q", q * RATIO, 1), **numbered("tau", torque, 1)}
    found = guessed(tmp_path, columns, ratio=tuple(RATIO))
    assert found.columns["position"]["side"] == "motor"
    assert "side" not in found.columns["torque"]
    assert any("torque: in N*m at the joints" in sentence for sentence in found.words)


def test_rows_written_twice_and_stuck_samples_change_nothing(
    tmp_path: Path, motion: tuple[FloatArray, ...]
) -> None:
    t, q, _, torque = motion
    q = q.copy()
    q[1200:1206, 2] = q[1200, 2]
    rows = np.sort(np.concatenate([np.arange(ROWS), [40, 400, 1900]]))
    columns = {"t": t, **numbered("q", q, 1), **numbered("tau", torque, 1)}
    found = guessed(tmp_path, {name: values[rows] for name, values in columns.items()})
    loaded = load_recording(tmp_path / "log.csv", found.robot)
    assert "3 rows are written twice (first at 0.16 s), left out" in loaded.warnings[0]
    assert "position of joint 3 is stuck for 6 samples after 4.8 s" in loaded.warnings[1]
    (recording,) = loaded.recordings
    assert recording.time == pytest.approx(t)
    assert recording.position == pytest.approx(motion[1], abs=1e-4)


def test_rows_that_were_read_again_are_left_out_and_the_clock_is_that_of_the_others(
    tmp_path: Path, motion: tuple[FloatArray, ...]
) -> None:
    """A topic at a rate of its own met three samples twice, and stamped them anew."""
    t, q, _, torque = motion
    rows = np.sort(np.concatenate([np.arange(ROWS), [300, 1000, 1700]]))
    columns = {
        "t": t[1] * np.arange(len(rows)),
        **numbered("q", q[rows], 1),
        **numbered("tau", torque[rows], 1),
    }
    found = guessed(tmp_path, columns)
    loaded = load_recording(tmp_path / "log.csv", found.robot)
    assert (
        "3 rows repeat the one before while the arm moves (first at 1.204 s), left out" in loaded.warnings[0]
    )
    (recording,) = loaded.recordings
    assert recording.time.size == ROWS
    assert recording.sample_time == pytest.approx(t[1], rel=2e-3)
    assert recording.position == pytest.approx(q, abs=1e-3)


def test_a_log_that_was_cut_off_ends_with_its_last_whole_row(
    tmp_path: Path, motion: tuple[FloatArray, ...]
) -> None:
    t, q, _, torque = motion
    found = guessed(tmp_path, {"t": t, **numbered("q", q, 1), **numbered("tau", torque, 1)})
    log = tmp_path / "log.csv"
    log.write_bytes(log.read_bytes()[:-200])
    loaded = load_recording(log, found.robot)
    assert loaded.warnings == (
        "log.csv: its last row is cut off and left out; more may be missing behind it",
    )
    assert len(loaded.recordings[0].time) == ROWS - 1


def test_a_joint_at_rest_is_left_out(tmp_path: Path, motion: tuple[FloatArray, ...]) -> None:
    t, q, _, torque = motion
    q = q.copy()
    q[:, 0] = 0.3
    found = guessed(tmp_path, {"t": t, **numbered("q", q, 1), **numbered("tau", torque, 1)})
    assert [joint.name for joint in found.robot.joint] == NAMES[1:]
    assert "left out (at rest, or not in the log): joint_1" in found.words


def test_sensors_at_the_links_do_not_feel_the_rotors(tmp_path: Path, motion: tuple[FloatArray, ...]) -> None:
    t, q, _, torque = motion
    found = guessed(tmp_path, {"t": t, **numbered("q", q), **numbered("tau_J_", torque)}, sensor=True)
    assert not found.robot.identification.rotor_inertia
    assert found.columns["torque"]["side"] == "sensor"
    recordings = load_recording(tmp_path / "log.csv", found.robot).recordings
    result = identify(found.robot, recordings).result
    assert not [p.name for p in result.least_squares.parameters if p.name.startswith("Ia")]


@pytest.mark.parametrize(
    ("without", "message"),
    [
        ("t", "no column looks like time; give --sample-rate"),
        ("q", "no column looks like a measured position; give --columns"),
        ("tau", "no column looks like a torque or a current; give --columns"),
    ],
)
def test_what_is_not_there_is_asked_for(
    tmp_path: Path, motion: tuple[FloatArray, ...], without: str, message: str
) -> None:
    t, q, _, torque = motion
    columns = {"t": t, **numbered("q_", q), **numbered("tau_", torque)}
    left_out = {name for name in columns if without in (name, name.rpartition("_")[0])}
    kept = {name: values for name, values in columns.items() if name not in left_out}
    with pytest.raises(CaptureError, match=message):
        guessed(tmp_path, kept)


@pytest.mark.slow
@pytest.mark.parametrize("log", PUBLISHED, ids=lambda log: log.name)
def test_published_logs_come_out_as_well_as_by_hand(
    armhil: Call, shared_data: Path, log: PublishedLog
) -> None:
    """One command each, nothing written by hand; beside rows of plain slicing as their owners take them."""
    urdf = EMPS_URDF if log.urdf is None else shared_data / log.urdf
    words = [shared_data / log.log, "--urdf", urdf, *log.options]
    _, out, _ = armhil("identify", *words, "--method", "ls", "--no-catalogue", "--json")
    errors = json.loads(out)["estimates"]["ls"]["relative_error_percent"]["per_joint"]
    assert (np.array(errors) <= 1.05 * log.known(shared_data, False)).all()


def test_a_reference_in_another_unit_is_said(tmp_path: Path, motion: tuple[FloatArray, ...]) -> None:
    """A published log of a KUKA LWR has its targets divided by 57.3 once too often, and at other times."""
    t, q, _, torque = motion
    target = np.deg2rad(np.roll(q, 200, axis=0))
    found = guessed(
        tmp_path,
        {"t": t, **numbered("q", q), **numbered("target_q", target), **numbered("tau", torque)},
    )
    assert "reference" not in found.columns
    (words,) = [sentence for sentence in found.words if "named a reference" in sentence]
    assert words.endswith("target_q0 … target_q5")


@pytest.mark.parametrize(("added", "said"), [(0.0, ""), (1.0, "tau_ff"), (2.0, "unknown")])
def test_what_is_added_behind_a_controller_is_said(
    tmp_path: Path, motion: tuple[FloatArray, ...], added: float, said: str
) -> None:
    """The reference is such that error and speed make the torque, or all but the gravity that was added."""
    t, q, v, torque = motion
    forward = 40.0 * np.cos(q) * min(added, 1.0)
    target = q + (torque - forward + 5.0 * v) / 5000.0
    named = forward if added == 1.0 else np.cos(9.0 * q)
    columns = {"t": t, **numbered("q", q), **numbered("q_ref", target), **numbered("tau", torque)}
    found = guessed(tmp_path, {**columns, **numbered("tau_ff", named)})
    assert "reference" in found.columns
    words = [sentence for sentence in found.words if sentence.startswith("controller:")]
    assert len(words) == bool(said)
    assert all(said in sentence for sentence in words)
