"""Without a bus: the same bits as cycle by cycle, periods, delays, and what motors and loads do to a run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from drivers import DriveError
from drivers.simulated import PlantTruth, Scenario, draw_truth, nominal_truth, simulate_offline
from drivers.simulated.bench import Bench
from drivers.simulated.drawing import exercise
from drivers.simulated.noise import TorqueNoise, stream
from drivers.simulated.plant import Plant
from drivers.simulated.set_points import AxisMode
from robots import Robot

RICH: dict[str, Any] = {
    "stribeck_friction": [{"drive": 1, "rise": 0.3, "speed": 0.05}],
    "drifting_friction": [{"drive": 2, "start": -10.0}],
    "backlash": [{"drive": 3, "width": 1e-3}],
    "gear_ripple": [{"drive": 4, "amplitude": 1e-4}],
    "current_loop_lag": [{"drive": 5, "time_constant": 0.002}],
    "time_delay": [{"drive": 6, "position": 0.0013, "torque": 0.0021}],
    "torque_bursts": [{"joint": 1, "deviation": 2.0, "rate": 8.0, "duration": 0.1}],
    "missed_samples": [{"drive": 2, "rate": 50.0}],
    "vibration": [{"joint": 4, "amplitude": 0.5, "frequency": 7.7}],
    "dither": [{"joint": 5, "amplitude": 0.2}],
    "noise": {"time_constant": 0.02, "torque": 2.0},
}


FED = {"friction_feed_forward": (0.1,) * 6, "acceleration_feed_forward": (0.002,) * 6}


def controlled(robot: Robot, **changes: Any) -> Robot:
    """The arm with other controller keys."""
    controller = robot.controller.model_copy(update=changes)
    return robot.model_copy(update={"controller": controller})


@pytest.mark.parametrize(
    ("effects", "changes"), [({}, {}), (RICH, {}), ({}, FED)], ids=["empty", "rich", "fed forward"]
)
def test_cycle_by_cycle_gives_the_same_bits(
    tx40: Robot, truth: PlantTruth, effects: dict[str, Any], changes: dict[str, Any]
) -> None:
    """The way of the bus (two calls per SYNC) against whole blocks of SYNCs."""
    tx40 = controlled(tx40, **changes)
    scenario = Scenario.from_dict(effects)
    reference = exercise(tx40, 4.4)
    run = simulate_offline(tx40, truth, reference, scenario=scenario)
    bench = Bench(tx40, truth, scenario)
    bench.compile_ahead()
    braked = np.full(6, AxisMode.BRAKED, dtype=np.int64)
    scale = tx40.counts_per_output_unit
    targets = np.rint(reference @ tx40.transmission_matrix.T * scale)
    for _ in range(3):
        bench.begin_cycle(braked, targets[0])
        bench.finish_cycle()
    tracking = np.full(6, AxisMode.TRACKING, dtype=np.int64)
    to_joint = np.linalg.inv(tx40.transmission_matrix).T
    found, signal, position = [], [], []
    for target in targets:
        position.append(bench.plant.joint_position())
        snapshot = bench.begin_cycle(tracking, target)
        found.append((snapshot.position / scale) @ to_joint)
        signal.append(snapshot.control_signal)
        bench.finish_cycle()
    assert np.array_equal(np.array(position), run.true_position)
    assert np.array_equal(np.array(found), run.position)
    resolution = np.array([drive.control_signal.per_count for drive in tx40.drive])
    assert np.array_equal(np.rint(np.array(signal) / resolution) * resolution, run.control_signal)


def test_what_is_fed_forward_takes_its_part_of_the_following_error(emps: Robot) -> None:
    """Inertia and friction over the gain, fed forward, leave the loop little to do."""
    truth = nominal_truth(emps)
    gain, mass, viscous = truth.gain[0], truth.parameters["M1"], truth.parameters["Fv1"]
    reference = np.array(emps.home) + 0.02 * (1 - np.cos(2 * np.pi * 2.0 * np.arange(1000) * 0.001))[:, None]
    speed = controlled(emps, velocity_feed_forward=(1.0,))
    inertia = controlled(speed, acceleration_feed_forward=(mass / gain,))
    both = controlled(inertia, friction_feed_forward=(viscous / gain,))

    def error(robot: Robot) -> float:
        run = simulate_offline(robot, truth, reference)
        return float(np.abs(run.true_position - reference)[300:].max())

    assert error(inertia) < 0.3 * error(speed)
    assert error(both) < 0.7 * error(inertia)


def test_periods_follow_one_another(tx40: Robot, truth: PlantTruth) -> None:
    reference = exercise(tx40, 2.0)
    whole = simulate_offline(tx40, truth, np.tile(reference, (3, 1)))
    parts = simulate_offline(tx40, truth, reference, periods=2, warm_up=1)
    assert np.array_equal(parts.position, whole.position[len(reference) :])
    assert parts.cycle[0] == len(reference)
    assert np.array_equal(parts.time, whole.time[len(reference) :])
    with pytest.raises(DriveError, match="periods 0"):
        simulate_offline(tx40, truth, reference, periods=0)


def test_samples_are_what_a_master_records(tx40: Robot, truth: PlantTruth) -> None:
    run = simulate_offline(tx40, truth, exercise(tx40, 0.4), warm_up=1)
    samples = run.samples()
    for name in ("cycle", "time", "reference", "position", "control_signal"):
        assert np.array_equal(getattr(samples, name), getattr(run, name))
    assert samples.cycle[0] == 100
    enabled = samples.statusword & 0x6F == 0x27  # CiA 402: operation enabled
    assert enabled.shape == samples.complete.shape == run.position.shape
    assert enabled.all() and samples.complete.all() and not samples.lateness.any()
    assert np.isnan(samples.velocity).all()


def test_a_seed_changes_the_noise_and_not_the_arm(tx40: Robot, truth: PlantTruth) -> None:
    reference = exercise(tx40, 1.0)
    one, same, other = (simulate_offline(tx40, truth, reference, seed=s) for s in (1, 1, 2))
    assert np.array_equal(one.position, same.position)
    assert not np.array_equal(one.position, other.position)
    assert np.abs(one.true_position - other.true_position).max() < 1e-3


def test_it_may_start_elsewhere(tx40: Robot, truth: PlantTruth) -> None:
    start = np.array([0.3, -0.4, 1.2, 0.5, 0.2, -0.7])
    run = simulate_offline(tx40, truth, np.tile(start, (50, 1)), start=start)
    assert run.true_position[0] == pytest.approx(start, abs=1e-12)
    assert np.abs(run.true_position - start).max() < 1e-4


def test_channels_show_the_past_and_the_loop_the_present(tx40: Robot) -> None:
    quiet = nominal_truth(tx40)
    reference = exercise(tx40, 4.0)
    late = Scenario.from_dict(
        {"time_delay": [{"drive": d, "position": 0.004, "torque": 0.008} for d in range(1, 7)]}
    )
    plain = simulate_offline(tx40, quiet, reference)
    delayed = simulate_offline(tx40, quiet, reference, scenario=late)
    assert np.array_equal(delayed.true_position, plain.true_position)
    assert delayed.position[5:] == pytest.approx(plain.position[4:-1], abs=5e-6)
    assert delayed.control_signal[5:] == pytest.approx(plain.control_signal[3:-2], abs=1e-3)


def difference(robot: Robot, scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """Torque at the drive outputs without a scenario, and what it changes; both (N, n)."""
    quiet, reference = nominal_truth(robot), exercise(robot, 5.0)
    plain = simulate_offline(robot, quiet, reference).control_signal * robot.gains
    with_it = simulate_offline(robot, quiet, reference, scenario=scenario).control_signal * robot.gains
    return plain, with_it - plain


def test_a_weaker_drive_asks_for_more(tx40: Robot) -> None:
    plain, more = difference(tx40, Scenario.from_dict({"drive_gain_error": [{"drive": 2, "change": -0.2}]}))
    share = (plain[:, 1] @ more[:, 1]) / (plain[:, 1] @ plain[:, 1])
    assert share == pytest.approx(1 / 0.8 - 1, rel=0.02)


def test_an_unreported_current_is_made_up_for(tx40: Robot) -> None:
    _, more = difference(tx40, Scenario.from_dict({"current_offset": [{"drive": 3, "torque": 4.0}]}))
    assert more[250:, 2].mean() == pytest.approx(-4.0, rel=0.02)


def test_the_torque_stops_at_the_lower_limit_and_the_signal_does_not(tx40: Robot) -> None:
    quiet, reference = nominal_truth(tx40), exercise(tx40, 5.0)
    plain = simulate_offline(tx40, quiet, reference)
    limit = 0.6 * float(np.abs(plain.control_signal[:, 0]).max())
    scenario = Scenario.from_dict({"saturation": [{"drive": 1, "limit": limit}]})
    limited = simulate_offline(tx40, quiet, reference, scenario=scenario)
    assert np.abs(limited.control_signal[:, 0]).max() > 1.2 * limit
    assert np.abs(limited.true_position - plain.true_position)[:, 0].max() > 1e-3
    never = Scenario.from_dict({"saturation": [{"drive": 1, "limit": 100.0}]})
    assert np.array_equal(simulate_offline(tx40, quiet, reference, scenario=never).position, plain.position)


def test_cogging_has_its_waves_per_motor_turn(tx40: Robot) -> None:
    """At a steady 0.3 rad/s of drive 1 the signal swings at order · gear · speed."""
    truth = nominal_truth(tx40)
    time = np.arange(1500) * tx40.bus.cycle_time
    reference = np.tile(tx40.home, (1500, 1))
    reference[:, 0] += 0.3 * np.maximum(time - 0.5, 0.0)
    ripple = Scenario.from_dict({"torque_ripple": [{"drive": 1, "amplitude": 1.0, "order": 2.0}]})
    run = simulate_offline(tx40, truth, reference, scenario=ripple)
    steady = run.control_signal[500:, 0] * tx40.gains[0]
    spectrum = np.abs(np.fft.rfft((steady - steady.mean()) * np.hanning(1000)))
    peak = np.fft.rfftfreq(1000, tx40.bus.cycle_time)[spectrum.argmax()]
    assert peak == pytest.approx(2.0 * 32.0 * 0.3 / (2 * np.pi), abs=0.25)
    assert np.ptp(steady) == pytest.approx(2.0, rel=0.2)


def held(robot: Robot, position: Any = None, **effects: Any) -> np.ndarray:
    """Joint torques that hold the nominal arm still at a posture."""
    plant = Plant(robot, nominal_truth(robot), scenario=Scenario.from_dict(effects))
    plant.stand(np.array(robot.home if position is None else position))
    return plant.arm.transmission[: robot.n].T @ plant.holding_torque()


def test_a_payload_weighs_what_pin_says(tx40: Robot) -> None:
    plant = Plant(tx40, nominal_truth(tx40))
    model = plant.model.copy()
    model.inertias[6] += pin.Inertia(2.0, np.array([0.01, 0.02, 0.1]), np.diag([0.01, 0.02, 0.03]))
    expected = pin.computeGeneralizedGravity(model, model.createData(), np.array(tx40.home))
    body = {"mass": 2.0, "centre": [0.01, 0.02, 0.1], "inertia": [0.01, 0.02, 0.03]}
    assert held(tx40, payload=body) == pytest.approx(expected, abs=1e-9)
    loaded = Plant(tx40, nominal_truth(tx40), scenario=Scenario.from_dict({"payload": body}))
    links = pin.crba(model, model.createData(), np.array(tx40.home))
    rotors = Plant(tx40, nominal_truth(tx40)).mass_matrix() - pin.crba(
        plant.model, plant.model.createData(), np.array(tx40.home)
    )
    assert loaded.mass_matrix() == pytest.approx(links + rotors, abs=1e-9)


def test_a_tilted_base_is_a_turned_gravity(tx40: Robot) -> None:
    """On a tilted base the first joint, too, feels the arm's weight."""
    model = Plant(tx40, nominal_truth(tx40)).model.copy()
    roll, pitch = 0.3, -0.2
    turn = pin.rpy.rpyToMatrix(roll, pitch, 0.0)
    model.gravity.linear = turn.T @ np.array(tx40.gravity)
    expected = pin.computeGeneralizedGravity(model, model.createData(), np.array(tx40.home))
    assert held(tx40, base_tilt={"roll": roll, "pitch": pitch}) == pytest.approx(expected, abs=1e-9)
    assert abs(expected[0]) > 0.2


@pytest.mark.parametrize("angle", [-0.7, 0.2, 1.4])
def test_a_spring_between_anchors_pulls_along_itself(tx40: Robot, angle: float) -> None:
    """Force times lever from the anchors' coordinates, and not from the law of cosines."""
    position = list(tx40.home)
    position[1] = angle
    entry = {
        "joint": 2,
        "stiffness": 900.0,
        "length": 0.1,
        "fixed_radius": 0.25,
        "moving_radius": 0.08,
        "angle": 0.1,
    }
    fixed = np.array([0.25, 0.0])
    moving = 0.08 * np.array([np.cos(angle - 0.1), np.sin(angle - 0.1)])
    along = fixed - moving
    pull = 900.0 * (np.linalg.norm(along) - 0.1) * along / np.linalg.norm(along)
    turning = moving[0] * pull[1] - moving[1] * pull[0]
    added = held(tx40, position, gravity_spring=[entry]) - held(tx40, position)
    assert added == pytest.approx([0, -turning, 0, 0, 0, 0], abs=1e-6)


def test_a_cable_stiffens_and_a_wall_only_pushes(tx40: Robot) -> None:
    cable = {"joint": 4, "stiffness": 2.0, "cubic": 5.0, "centre": 0.1}
    position = [0.0, 0.0, 1.5, 0.9, 0.5, 0.0]
    added = held(tx40, position, cable_spring=[cable]) - held(tx40, position)
    assert added[3] == pytest.approx(2.0 * 0.8 + 5.0 * 0.8**3)
    for upper, expected in ((0.8, 300.0 * 0.1), (1.0, 0.0)):
        wall = {"joint": 4, "upper": upper}
        added = held(tx40, position, contact=[wall]) - held(tx40, position)
        assert added[3] == pytest.approx(expected)


def test_the_tool_on_a_plane_feels_the_force_through_its_jacobian(tx40: Robot) -> None:
    point = [0.02, -0.01, 0.12]
    plant = Plant(tx40, nominal_truth(tx40))
    data = plant.model.createData()
    home = np.array(tx40.home)
    pin.computeJointJacobians(plant.model, data, home)
    place = data.oMi[6].act(np.array(point))
    frame = plant.model.addFrame(
        pin.Frame("tool", 6, 0, pin.SE3(np.eye(3), np.array(point)), pin.FrameType.OP_FRAME)
    )
    data = plant.model.createData()
    jacobian = pin.computeFrameJacobian(
        plant.model, data, home, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    )[:3]
    normal = np.array([0.6, 0.0, 0.8])
    depth = 0.003
    obstacle = {
        "normal": (2 * normal).tolist(),
        "distance": float(normal @ place + depth),
        "stiffness": 4000.0,
        "point": point,
    }
    added = held(tx40, tool_contact=obstacle) - held(tx40)
    assert added == pytest.approx(-jacobian.T @ normal * 4000.0 * depth, abs=1e-9)
    assert np.abs(added).max() > 1.0


def test_a_shaft_inside_the_wrist_couples_two_joints(tx40: Robot) -> None:
    shaft = {"joints": [4, 5], "ratios": [0.5, -1.0], "inertia": 0.04}
    scenario = Scenario.from_dict({"wrist_coupling": [shaft]})
    added = (
        Plant(tx40, nominal_truth(tx40), scenario=scenario).mass_matrix()
        - Plant(tx40, nominal_truth(tx40)).mass_matrix()
    )
    expected = np.zeros((6, 6))
    expected[3:5, 3:5] = 0.04 * np.array([[0.25, -0.5], [-0.5, 1.0]])
    assert added == pytest.approx(expected, abs=1e-12)


def test_another_ratio_than_described_moves_another_joint(tx40: Robot) -> None:
    ratio = Scenario.from_dict({"transmission": [{"drive": 6, "joint": 5, "ratio": 0.9}]})
    run = simulate_offline(tx40, nominal_truth(tx40), exercise(tx40, 3.0), scenario=ratio)
    read, true = run.position, run.true_position
    assert read[:, :5] == pytest.approx(true[:, :5], abs=1e-5)
    assert read[:, 5] == pytest.approx(true[:, 5] - 0.1 * true[:, 4], abs=1e-5)


def test_a_weakening_magnet_and_crosstalk_change_the_torque(tx40: Robot) -> None:
    drift = {"drive": 2, "per_kelvin": -0.01, "heating": 30.0, "time_constant": 1.0}
    plain, more = difference(tx40, Scenario.from_dict({"thermal_gain_drift": [drift]}))
    early, late = (
        (plain[rows, 1] @ more[rows, 1]) / (plain[rows, 1] @ plain[rows, 1])
        for rows in (slice(0, 200), slice(750, None))
    )
    assert late > 0.05
    assert abs(early) < 0.3 * late
    leak = {"drive": 4, "source": 2, "share": 0.1}
    plain, more = difference(tx40, Scenario.from_dict({"torque_crosstalk": [leak]}))
    share = (plain[:, 1] @ more[:, 3]) / (plain[:, 1] @ plain[:, 1])
    assert share == pytest.approx(-0.1, rel=0.02)


def test_coloured_noise_is_first_order_and_the_same_in_any_blocks() -> None:
    level, tau, step = np.array([2.0, 0.5]), 0.01, 0.00025
    whole = TorqueNoise(level, tau, step).block(stream(1, 0, 1), 40000)
    parted = TorqueNoise(level, tau, step)
    source = stream(1, 0, 1)
    parts = np.vstack([parted.block(source, size) for size in (1, 16, 39983)])
    assert np.array_equal(whole, parts)
    assert whole.std(axis=0) == pytest.approx(level, rel=0.1)
    correlation = np.mean(whole[:-40, 0] * whole[40:, 0]) / whole[:, 0].var()
    assert correlation == pytest.approx(np.exp(-1.0), abs=0.08)


def test_frozen_encoders_repeat_their_last_reading(tx40: Robot, truth: PlantTruth) -> None:
    bench = Bench(tx40, truth)
    tracking = np.full(6, AxisMode.TRACKING, dtype=np.int64)
    targets = np.rint(exercise(tx40, 2.0) @ tx40.transmission_matrix.T * tx40.counts_per_output_unit)
    found = []
    for k, target in enumerate(targets[:300]):
        bench.freeze_encoders(np.array([False, k > 200, False, False, False, False]))
        found.append(bench.begin_cycle(tracking, target).position)
        bench.finish_cycle()
    counts = np.array(found)
    assert len(np.unique(counts[202:, 1])) == 1
    assert len(np.unique(counts[202:, 0])) > 50


def test_the_empty_scenario_is_the_arm_as_drawn(tx40: Robot) -> None:
    """A scenario that changes nothing gives the same bits as none."""
    truth = draw_truth(tx40, 2)
    reference = exercise(tx40, 1.0)
    nothing = Scenario.from_dict(
        {
            "asymmetric_friction": [{"drive": 1}],
            "drive_gain_error": [{"drive": 2, "change": 0.0}],
            "nonlinear_viscous_friction": [{"drive": 3}],
            "position_dependent_friction": [{"drive": 4}],
            "cable_spring": [{"joint": 5}],
        }
    )
    plain = simulate_offline(tx40, truth, reference)
    same = simulate_offline(tx40, truth, reference, scenario=nothing)
    assert np.array_equal(plain.true_position, same.true_position)
    assert not np.array_equal(
        plain.position, simulate_offline(tx40, replace(truth, seed=3), reference).position
    )
