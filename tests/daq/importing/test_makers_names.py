"""Logs with the columns of Universal Robots' RTDE and of Franka's interfaces map themselves.

The names are those of their own programs: ``record.py`` of the RTDE client and ``startFileRecording`` of
ur_rtde; ``logToCSV`` of libfranka, ``rostopic echo -p`` of franka_states, the message FrankaRobotState, and
joint states of the robot and of its set-points. The numbers are of simulated arms.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from daq.importing.guess_log import GuessedLog, guess_log
from daq.importing.guess_torque import LogHints
from daq.importing.load import load_recording
from daq.recording.errors import CaptureError
from robots.arrays import FloatArray
from tests.daq.importing.made_arms import ROTOR, motion_of, seven_axes
from tests.daq.importing.test_guess_log import URDF, motion

__all__ = ["motion"]
Columns = dict[str, FloatArray]
STIFFNESS = 4000.0
"""Of the position loop, N·m/rad: how far the set-points are ahead."""


class Arm(NamedTuple):
    """A simulated arm: samples of time, position, set-points, speed, torque and what a model says of it."""

    urdf: Path
    time: FloatArray
    position: FloatArray
    target: FloatArray
    speed: FloatArray
    torque: FloatArray
    computed: FloatArray


@pytest.fixture(scope="module")
def ur(motion: tuple[FloatArray, ...]) -> Arm:
    t, q, v, torque = motion
    noise = 0.05 * np.random.default_rng(1).standard_normal(q.shape)
    return Arm(URDF, t, q, q + torque / STIFFNESS, v, torque, torque - 2.0 * v - 3.0 * np.sign(v) + noise)


@pytest.fixture(scope="module")
def franka(tmp_path_factory: pytest.TempPathFactory) -> Arm:
    """Seven joints of ROS's names; the sensors at the links do not feel the rotors."""
    urdf = tmp_path_factory.mktemp("franka") / "panda.urdf"
    urdf.write_text(seven_axes().replace('name="j', 'name="panda_joint'), encoding="utf-8")
    t, q, v, torque = motion_of(urdf, [0.5] * 7, seconds=10.0)
    sensed = torque - ROTOR * np.gradient(v, t, axis=0)
    return Arm(urdf, t, q, q + torque / STIFFNESS, v, sensed, 0.2 * sensed)


def each(pattern: str, values: FloatArray) -> Columns:
    return {pattern.format(k): column for k, column in enumerate(values.T)}


def rtde(arm: Arm) -> Columns:
    """All outputs of the RTDE client's example, in its order."""
    noise, still = np.random.default_rng(2), np.zeros_like(arm.time)
    pose = noise.standard_normal(arm.position.shape).cumsum(axis=0) / 100.0
    return {
        "timestamp": 1234.5 + arm.time,
        **each("target_q_{}", arm.target),
        **each("target_qd_{}", arm.speed),
        **each("target_qdd_{}", np.gradient(arm.speed, arm.time, axis=0)),
        **each("target_current_{}", arm.computed / 11.0),
        **each("target_moment_{}", arm.computed),
        **each("actual_q_{}", arm.position),
        **each("actual_qd_{}", arm.speed + 1e-3 * noise.standard_normal(arm.speed.shape)),
        **each("actual_current_{}", arm.torque / 12.0),
        **each("joint_control_output_{}", arm.computed / 12.0),
        **each("actual_TCP_pose_{}", pose),
        **each("actual_TCP_speed_{}", np.gradient(pose, arm.time, axis=0)),
        **each("actual_TCP_force_{}", noise.standard_normal(pose.shape)),
        **each("target_TCP_pose_{}", pose),
        **each("target_TCP_speed_{}", np.gradient(pose, arm.time, axis=0)),
        "actual_digital_input_bits": still,
        **each("joint_temperatures_{}", 30.0 + np.round(arm.time[:, np.newaxis] + 0.0 * arm.position)),
        "actual_execution_time": 0.1 + 0.01 * np.abs(noise.standard_normal(len(arm.time))),
        "robot_mode": still + 7.0,
        **each("joint_mode_{}", 253.0 + 0.0 * arm.position),
        "safety_mode": still + 1.0,
        **each("actual_tool_accelerometer_{}", noise.standard_normal((len(arm.time), 3))),
        "speed_scaling": still + 1.0,
        "actual_momentum": np.abs(arm.speed).sum(axis=1),
        "actual_main_voltage": still + 48.0,
        "actual_robot_current": np.abs(arm.torque).sum(axis=1) / 48.0,
        **each("actual_joint_voltage_{}", 47.0 + 0.1 * noise.standard_normal(arm.position.shape)),
        "runtime_state": still + 2.0,
    }


def libfranka(arm: Arm) -> Columns:
    """What a control exception keeps; the commanded positions of a torque controller are 0."""
    nothing = np.zeros_like(arm.position)
    return {
        "time": np.round(1e3 * arm.time),
        "success_rate": np.ones_like(arm.time),
        **each("state.q[{}]", arm.position),
        **each("state.q_d[{}]", arm.target),
        **each("state.dq[{}]", arm.speed),
        **each("state.dq_d[{}]", arm.speed),
        **each("state.tau_J[{}]", arm.torque),
        **each("state.tau_ext_hat_filtered[{}]", 0.02 * arm.torque),
        **each("cmd.q_d[{}]", nothing),
        **each("cmd.dq_d[{}]", nothing),
        **each("cmd.O_T_EE_d[{}]", np.tile(np.eye(4).ravel(), (len(arm.time), 1))),
        **each("cmd.O_dP_EE_d[{}]", nothing[:, :6]),
        **each("cmd.tau_J_d[{}]", arm.computed),
    }


def franka_states(arm: Arm) -> Columns:
    """The message's fields; ``theta`` is at the motors, ahead by the torque through the gear."""
    stamp = 1.6e9 + arm.time
    return {
        "%time": 1e9 * stamp,
        "field.header.seq": np.arange(len(stamp), dtype=float),
        "field.header.stamp": 1e9 * (stamp - 1e-3),
        **each("field.cartesian_collision{}", np.zeros((len(stamp), 6))),
        **each("field.q{}", arm.position),
        **each("field.q_d{}", arm.target),
        **each("field.dq{}", arm.speed),
        **each("field.dq_d{}", arm.speed),
        **each("field.ddq_d{}", np.gradient(arm.speed, arm.time, axis=0)),
        **each("field.theta{}", arm.position + arm.torque / 1e4),
        **each("field.dtheta{}", arm.speed),
        **each("field.tau_J{}", arm.torque),
        **each("field.dtau_J{}", np.gradient(arm.torque, arm.time, axis=0)),
        **each("field.tau_J_d{}", arm.computed),
        **each("field.K_F_ext_hat_K{}", arm.torque[:, :6]),
        **each("field.tau_ext_hat_filtered{}", 0.02 * arm.torque),
    }


def robot_state(arm: Arm) -> Columns:
    """FrankaRobotState of franka_ros2, flattened."""
    found = {"timestamp": arm.time}
    motors = arm.position + arm.torque / 1e4
    for name, position, effort in (
        ("measured_joint_state", arm.position, arm.torque),
        ("desired_joint_state", arm.target, arm.computed),
        ("measured_joint_motor_state", motors, 0.0 * arm.torque),
    ):
        found |= each(f"{name}.position[{{}}]", position) | each(f"{name}.velocity[{{}}]", arm.speed)
        found |= each(f"{name}.effort[{{}}]", effort)
    return found | each("tau_ext_hat_filtered.effort[{}]", 0.02 * arm.torque)


def joint_states(arm: Arm) -> Columns:
    """Two topics of a bag of franka_ros, as the columns that a bag is read into."""
    found = {"/franka_state_controller/joint_states/stamp": arm.time}
    for topic, position, effort in (
        ("joint_states", arm.position, arm.torque),
        ("joint_states_desired", arm.target, arm.computed),
    ):
        for field, values in (("position", position), ("velocity", arm.speed), ("effort", effort)):
            name = f"/franka_state_controller/{topic}/{field}/panda_joint"
            found |= {f"{name}{k + 1}": column for k, column in enumerate(values.T)}
    return found


def written(path: Path, columns: Columns, mark: str = ",", text: str = "") -> Path:
    """A table; ``text`` is the name of a column of words in the second place."""
    names = [*columns]
    rows = [[repr(float(value)) for value in row] for row in zip(*columns.values(), strict=True)]
    if text:
        names.insert(1, text)
        rows = [[row[0], "panda_link0", *row[1:]] for row in rows]
    lines = [mark.join(names), *((mark.strip() or mark).join(row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def guessed(folder: Path, arm: Arm, columns: Columns, mark: str = ",", text: str = "") -> GuessedLog:
    return guess_log(written(folder / "log.csv", columns, mark, text), arm.urdf, folder, LogHints())


def columns_of(guess: GuessedLog) -> Iterator[tuple[str, str]]:
    """The first column of each quantity."""
    for kind, table in guess.columns.items():
        if kind != "format":
            yield kind, table["columns"][0] if "columns" in table else table["column"]


@pytest.mark.parametrize("mark", [" ", ","], ids=["record.py", "ur_rtde"])
def test_a_recording_of_rtde_maps_itself(tmp_path: Path, ur: Arm, mark: str) -> None:
    found = guessed(tmp_path, ur, rtde(ur), mark)
    assert dict(columns_of(found)) == {
        "time": "timestamp",
        "position": "actual_q_0",
        "reference": "target_q_0",
        "torque": "actual_current_0",
        "temperature": "joint_temperatures_0",
    }
    assert found.columns["torque"]["side"] == "current"
    assert found.columns["torque"]["gain"] == pytest.approx([12.0] * 6, rel=0.15)
    (recording,) = load_recording(tmp_path / "log.csv", found.robot).recordings
    assert recording.position == pytest.approx(ur.position, abs=1e-12)


@pytest.mark.parametrize("without", ["target_q_", "target_q_ target_moment_ target_current_"])
def test_the_speed_that_is_asked_for_is_no_reference(tmp_path: Path, ur: Arm, without: str) -> None:
    left = {name: v for name, v in rtde(ur).items() if not name.startswith(tuple(without.split()))}
    found = guessed(tmp_path, ur, left)
    assert "reference" not in found.columns
    (words,) = [sentence for sentence in found.words if "proven as the derivative" in sentence]
    assert "target_qd_0 … target_qd_5" in words


def test_what_only_the_model_of_the_arm_says_is_no_measured_torque(tmp_path: Path, ur: Arm) -> None:
    """Without currents a voltage of the supply is left, which shows no mass: refused, not fitted."""
    gone = ("actual_current_", "joint_control_output_", "target_current_")
    left = {name: v for name, v in rtde(ur).items() if not name.startswith(gone)}
    with pytest.raises(CaptureError, match="no mass of the URDF is seen in actual_joint_voltage_0"):
        guessed(tmp_path, ur, left)


@pytest.mark.parametrize("mark", [",", ", "], ids=["today's", "until 0.13"])
def test_a_log_of_libfranka_maps_itself(tmp_path: Path, franka: Arm, mark: str) -> None:
    found = guessed(tmp_path, franka, libfranka(franka), mark)
    assert dict(columns_of(found)) == {
        "time": "time",
        "position": "state.q[0]",
        "reference": "state.q_d[0]",
        "torque": "state.tau_J[0]",
    }
    assert found.columns["time"]["unit"] == "ms"
    assert found.columns["torque"] == {
        "columns": [f"state.tau_J[{k}]" for k in range(7)],
        "unit": "N*m",
        "side": "sensor",
    }
    assert not found.robot.identification.rotor_inertia
    assert any("of sensors at the links, so without the rotors' inertia" in w for w in found.words)
    assert "position: state.q[0] … state.q[6]" in found.words


@pytest.mark.parametrize("text", ["", "field.header.frame_id"])
def test_franka_states_of_ros_map_themselves(tmp_path: Path, franka: Arm, text: str) -> None:
    found = guessed(tmp_path, franka, franka_states(franka), text=text)
    assert dict(columns_of(found)) == {
        "time": "time",
        "position": "field.q0",
        "reference": "field.q_d0",
        "torque": "field.tau_J0",
    }
    assert found.columns["time"]["unit"] == "ns"
    assert found.columns["torque"]["side"] == "sensor"
    loaded = load_recording(tmp_path / "log.csv", found.robot)
    said = [words for words in loaded.warnings if "columns of text are left out" in words]
    assert said == ([f"log.csv: columns of text are left out: {text}"] if text else [])
    assert len(loaded.recordings[0].time) == pytest.approx(len(franka.time), abs=1)


def test_a_robot_state_of_ros_2_maps_itself(tmp_path: Path, franka: Arm) -> None:
    """The positions beside the torques, not those of the motors behind the gears."""
    found = guessed(tmp_path, franka, robot_state(franka))
    assert dict(columns_of(found)) == {
        "time": "timestamp",
        "position": "measured_joint_state.position[0]",
        "reference": "desired_joint_state.position[0]",
        "torque": "measured_joint_state.effort[0]",
    }
    assert "position: measured_joint_state.position[0] … [6]" in found.words
    assert found.columns["torque"]["side"] == "sensor"


def test_joint_states_and_those_that_are_desired_map_themselves(tmp_path: Path, franka: Arm) -> None:
    found = guessed(tmp_path, franka, joint_states(franka))
    topic = "/franka_state_controller/joint_states"
    assert dict(columns_of(found)) == {
        "time": f"{topic}/stamp",
        "position": f"{topic}/position/panda_joint1",
        "reference": f"{topic}_desired/position/panda_joint1",
        "torque": f"{topic}/effort/panda_joint1",
    }


def test_columns_by_the_joints_names_map_themselves(tmp_path: Path, franka: Arm) -> None:
    fields = {"position": franka.position, "velocity": franka.speed, "effort": franka.torque}
    columns = {"timestamp": franka.time}
    for field, values in {**fields, "position_target": franka.target}.items():
        columns |= {f"panda_joint{k + 1}_{field}": column for k, column in enumerate(values.T)}
    found = guessed(tmp_path, franka, columns)
    assert dict(columns_of(found)) == {
        "time": "timestamp",
        "position": "panda_joint1_position",
        "reference": "panda_joint1_position_target",
        "torque": "panda_joint1_effort",
    }
    assert "side" not in found.columns["torque"]  # nothing says here that these are sensors at the links


def test_sensors_that_count_the_other_way_are_turned_round(tmp_path: Path, franka: Arm) -> None:
    turned = franka.torque * np.array([1, -1, 1, 1, 1, 1, 1])
    columns = {**libfranka(franka), **each("state.tau_J[{}]", turned)}
    found = guessed(tmp_path, franka, columns)
    assert found.columns["torque"]["gain"] == [1, -1, 1, 1, 1, 1, 1]
    assert not found.robot.identification.rotor_inertia
