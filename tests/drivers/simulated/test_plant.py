"""The plant obeys mechanics: energy, gravity, stiction, and a step that is fine enough."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from drivers.simulated import PlantTruth, draw_truth, nominal_truth
from drivers.simulated.physics.assemble import true_model
from drivers.simulated.plant import Plant
from robots import Robot

RELEASED = np.zeros(6, dtype=np.bool_)


def released(robot: Robot, truth: PlantTruth, step: float = 1 / 4000) -> Plant:
    plant = Plant(robot, truth, step)
    plant.engage(RELEASED)
    return plant


def swing(plant: Plant, duration: float) -> None:
    for _ in range(round(duration / plant.step_time)):
        plant.step(np.zeros(6))


@pytest.mark.parametrize(("step", "share"), [(1 / 4000, 2e-3), (1 / 16000, 5e-4)])
def test_free_fall_without_friction_keeps_its_energy(
    tx40: Robot, frictionless: PlantTruth, step: float, share: float
) -> None:
    plant = released(tx40, frictionless, step)
    start, largest = plant.energy(), 0.0
    for _ in range(round(0.6 / step)):
        plant.step(np.zeros(6))
        kinetic = 0.5 * plant.velocity @ plant.mass_matrix() @ plant.velocity
        largest = max(largest, float(kinetic))
    assert largest > 5.0
    assert abs(plant.energy() - start) < share * largest


def test_friction_takes_energy(tx40: Robot) -> None:
    plant = released(tx40, nominal_truth(tx40))
    plant.velocity[:] = [2.0, -1.0, 3.0, 2.0, -3.0, 4.0]
    before = plant.energy()
    for _ in range(40):
        swing(plant, 0.005)
        assert plant.energy() < before + 1e-6
        before = plant.energy()


def test_acceleration_is_the_inverse_of_the_inverse_dynamics(tx40: Robot, frictionless: PlantTruth) -> None:
    rng = np.random.default_rng(3)
    step = 1e-7
    plant = released(tx40, frictionless, step)
    matrix = tx40.transmission_matrix
    rotors = matrix.T @ np.diag(frictionless.per_drive("Ia")) @ matrix
    for _ in range(10):
        q, v, torque = rng.uniform(-1, 1, 6), rng.uniform(-2, 2, 6), rng.uniform(-20, 20, 6)
        plant.position[:], plant.velocity[:] = q, v
        plant.step(torque)
        acceleration = (plant.velocity - v) / step
        model = true_model(tx40, frictionless)
        inverse = pin.rnea(model, model.createData(), q, v, acceleration) + rotors @ acceleration
        assert inverse == pytest.approx(matrix.T @ torque, abs=1e-4)


def test_wrist_coupling_puts_rotor_six_on_joint_five(tx40: Robot, frictionless: PlantTruth) -> None:
    heavier = replace(frictionless, parameters=frictionless.parameters | {"Ia6": 1.0})
    added = Plant(tx40, heavier).mass_matrix() - Plant(tx40, frictionless).mass_matrix()
    rotor = 1.0 - frictionless.parameters["Ia6"]
    expected = np.zeros((6, 6))
    expected[4:, 4:] = rotor
    assert added == pytest.approx(expected, abs=1e-12)


def test_holding_torque_is_gravity_and_offset(tx40: Robot, truth: PlantTruth) -> None:
    plant = Plant(tx40, truth)
    model = true_model(tx40, truth)
    still = np.zeros(6)
    gravity = pin.rnea(model, model.createData(), plant.position, still, still)
    joint_torque = tx40.transmission_matrix.T @ plant.holding_torque()
    assert joint_torque == pytest.approx(gravity + truth.per_drive("off"), abs=1e-10)
    assert np.abs(gravity).max() > 3.0


def test_dry_friction_holds_a_load_for_ever(tx40: Robot) -> None:
    truth = nominal_truth(tx40)
    plant = released(tx40, truth)
    start = plant.drive_position()
    holding = plant.holding_torque()
    torque = holding + 0.8 * truth.per_drive("Fc") * [1, -1, 1, -1, 1, -1]
    for _ in range(2000):
        plant.step(torque)
    bent = plant.drive_position()
    assert np.abs(bent - start).max() < 10 * truth.bristle_width[0]
    for _ in range(8000):
        plant.step(torque)
    assert np.abs(plant.drive_position() - bent).max() < 1e-12


def test_a_load_above_coulomb_friction_moves(tx40: Robot) -> None:
    truth = nominal_truth(tx40)
    plant = released(tx40, truth)
    start = plant.drive_position()
    torque = plant.holding_torque() + 1.2 * truth.per_drive("Fc")
    for _ in range(400):
        plant.step(torque)
    assert (plant.drive_position() - start > 20 * truth.bristle_width[0]).all()


def test_sliding_friction_is_coulomb_and_viscous(emps: Robot) -> None:
    """One axis at constant speed: the torque that keeps it there is Fc + Fv·v."""
    truth = nominal_truth(emps)
    plant = Plant(emps, truth)
    plant.engage(np.zeros(1, dtype=np.bool_))
    speed = 0.1
    plant.velocity[:] = speed
    needed = truth.parameters["Fc1"] + truth.parameters["Fv1"] * speed
    for _ in range(4000):
        plant.step(np.array([needed]))
    assert plant.velocity == pytest.approx([speed], rel=1e-3)


def test_brakes_hold_a_fixed_posture(tx40: Robot, truth: PlantTruth) -> None:
    plant = Plant(tx40, truth)
    start = plant.position.copy()
    for _ in range(100):
        plant.step(np.full(6, 50.0))
    assert np.array_equal(plant.position, start)


def test_brakes_stop_a_moving_arm_and_then_hold_it_exactly(tx40: Robot, truth: PlantTruth) -> None:
    plant = released(tx40, truth)
    plant.velocity[:] = [1.0, 0.5, -1.0, 2.0, 1.0, -3.0]
    plant.engage(np.ones(6, dtype=np.bool_))
    swing(plant, 0.5)
    assert plant.at_rest
    assert np.abs(plant.position - tx40.home).max() < 0.1


def test_one_brake_holds_its_axis_while_the_others_move(tx40: Robot, truth: PlantTruth) -> None:
    plant = Plant(tx40, truth)
    only_three = np.array([False, False, True, False, False, False])
    plant.engage(only_three)
    start = plant.position.copy()
    for _ in range(400):
        plant.step(np.array([0.0, 20.0, 40.0, 0.0, 0.0, 0.0]))
    moved = np.abs(plant.position - start)
    assert moved[2] < 1e-6
    assert moved[1] > 0.01


def motion(robot: Robot, truth: PlantTruth, step: float) -> np.ndarray:
    """Joint positions every 10 ms under smooth torques that reverse each axis several times."""
    plant = released(robot, truth, step)
    holding = plant.holding_torque()
    amplitude = np.array([40.0, 30.0, 25.0, 8.0, 10.0, 5.0])
    frequency = np.array([1.1, 1.7, 1.3, 2.1, 1.9, 2.3])
    held = round(0.001 / step)
    samples = []
    for k in range(500):
        if k % 10 == 0:
            samples.append(plant.position.copy())
        torque = holding + amplitude * np.sin(2 * np.pi * frequency * k * 0.001)
        for _ in range(held):
            plant.step(torque)
    return np.array(samples)


def test_the_step_is_fine_enough(tx40: Robot) -> None:
    """The error against a 16 times finer step is small beside the motion, and shrinks with the step."""
    truth = nominal_truth(tx40)
    fine = motion(tx40, truth, 1 / 64000)
    used = np.abs(motion(tx40, truth, 1 / 4000) - fine).max(axis=0)
    half = np.abs(motion(tx40, truth, 1 / 8000) - fine).max(axis=0)
    travel = np.ptp(fine, axis=0)
    assert (travel > 0.05).all()
    assert (used < 3e-3 * travel).all()
    assert (half < 0.75 * used).all()


@pytest.mark.parametrize("seed", range(5))
def test_drawn_links_are_bodies(tx40: Robot, seed: int) -> None:
    """Positive mass and positive definite inertia with the triangle inequality, as the nominal links have."""
    drawn = draw_truth(tx40, seed)
    for j in range(1, 7):
        inertia = pin.Inertia.FromDynamicParameters(drawn.link(j))
        moments = np.linalg.eigvalsh(inertia.inertia)
        assert inertia.mass > 0
        assert moments[0] > 0
        assert moments[0] + moments[1] > moments[2] * (1 - 1e-9)
