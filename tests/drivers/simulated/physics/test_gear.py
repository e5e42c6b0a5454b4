"""Gears that give way: frequencies, limits, loops, and no energy from nowhere."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from drivers import DriveError
from drivers.simulated import Scenario
from drivers.simulated.plant import Plant
from robots import Robot
from tests.drivers.simulated.rigs import axis_truth, released

ROTOR, LOAD = 20.0, 95.1


def stretches(plant: Plant, duration: float, force: float = 0.0) -> np.ndarray:
    """Rotor minus output at each step."""
    found = np.empty(round(duration / plant.step_time))
    for k in range(len(found)):
        plant.step(np.array([force]))
        found[k] = plant.drive_position()[0] - plant.joint_position()[0]
    return found


@pytest.mark.parametrize("stiffness", [1e5, 4e6])
def test_two_masses_swing_at_their_frequency(emps: Robot, stiffness: float) -> None:
    entry = {"drive": 1, "stiffness": stiffness, "damping": 0.0}
    plant = released(emps, axis_truth(emps), joint_elasticity=[entry])
    plant.motion.motors["velocity"][0] = 0.1
    swing = stretches(plant, 1.0)
    crossings = np.flatnonzero((swing[:-1] < 0) & (swing[1:] >= 0))
    period = (crossings[-1] - crossings[0]) / (len(crossings) - 1) * plant.step_time
    expected = 2 * math.pi * math.sqrt(1 / (stiffness * (1 / ROTOR + 1 / LOAD)))
    assert period == pytest.approx(expected, rel=5e-3)
    # Undamped: the last swing is as wide as the first.
    assert np.abs(swing[-len(swing) // 4 :]).max() == pytest.approx(np.abs(swing).max(), rel=0.01)


def test_damping_is_the_share_of_critical_damping_that_was_asked_for(emps: Robot) -> None:
    stiffness, reduced = 1e5, ROTOR * LOAD / (ROTOR + LOAD)
    damping = 2 * 0.05 * math.sqrt(stiffness * reduced)
    entry = {"drive": 1, "stiffness": stiffness, "damping": damping}
    plant = released(emps, axis_truth(emps), joint_elasticity=[entry])
    plant.motion.motors["velocity"][0] = 0.1
    swing = stretches(plant, 1.0)
    peaks = np.flatnonzero((swing[1:-1] > swing[:-2]) & (swing[1:-1] >= swing[2:])) + 1
    decrement = np.log(swing[peaks[0]] / swing[peaks[4]]) / 4
    assert decrement == pytest.approx(2 * math.pi * 0.05 / math.sqrt(1 - 0.05**2), rel=0.05)


def test_a_constant_torque_winds_the_gear_up_by_the_springs_law(emps: Robot) -> None:
    """Both masses accelerate together; the spring carries the load's share."""
    entry = {"drive": 1, "stiffness": 1e5, "cubic": 4e12, "damping": 800.0}
    plant = released(emps, axis_truth(emps), joint_elasticity=[entry])
    wound = stretches(plant, 1.0, force=50.0)[-1]
    carried = 50.0 * LOAD / (ROTOR + LOAD)
    assert 1e5 * wound + 4e12 * wound**3 == pytest.approx(carried, rel=5e-3)


def test_in_the_dead_zone_the_masses_do_not_know_of_each_other(emps: Robot) -> None:
    width = 2e-3
    plant = released(emps, axis_truth(emps), backlash=[{"drive": 1, "width": width}])
    plant.motion.motors["velocity"][0] = 0.05
    limit = round(0.8 * 0.5 * width / 0.05 / plant.step_time)
    for _ in range(limit):
        plant.step(np.zeros(1))
    assert plant.velocity[0] == 0.0
    assert plant.drive_velocity()[0] == pytest.approx(0.05, abs=1e-12)


def test_play_ends_at_its_width(emps: Robot) -> None:
    """Pushed to and fro slowly, the rotor runs ahead and behind by half the width and the contact's give."""
    width = 2e-3
    entry = {"drive": 1, "width": width, "stiffness": 1e7}
    truth = axis_truth(emps, Fv1=2000.0)
    plant = released(emps, truth, backlash=[entry])
    ahead = stretches(plant, 0.6, force=100.0)
    behind = stretches(plant, 0.6, force=-100.0)
    assert ahead[-1] == pytest.approx(width / 2, rel=0.02)
    assert behind[-1] == pytest.approx(-width / 2, rel=0.02)
    assert np.abs(np.concatenate([ahead, behind])).max() < 0.75 * width


def test_elements_on_the_housing_build_torque_over_the_way_and_keep_it(emps: Robot) -> None:
    """Masing's loop: from a reversal the torque changes twice as far over twice the way."""
    entry = {"drive": 1, "torque": 10.0, "displacement": 0.01}
    plant = released(emps, axis_truth(emps), hysteresis=[entry])
    drag, place = [], []
    for direction in (1.0, -1.0):
        for _ in range(1600):
            plant.velocity[0] = 0.05 * direction
            plant.step(np.zeros(1))
            drag.append(float(plant.motion.motors["drag"][0]))
            place.append(float(plant.position[0]))
    up, down = np.array(drag[:1600]), np.array(drag[1600:])
    way = np.array(place[:1600])
    assert up[-1] == pytest.approx(10.0, rel=1e-9)
    assert down[-1] == pytest.approx(-10.0, rel=1e-3)
    # Four elements that slide at 1/4 … 4/4 of the displacement: slope falls in four equal parts.
    before, after = np.argmin(np.abs(way - 0.002)), np.argmin(np.abs(way - 0.009))
    first, last = np.gradient(up, way)[before], np.gradient(up, way)[after]
    assert first == pytest.approx(4 * last, rel=0.01)
    way_back = way[-1] - np.array(place[1600:])
    half = np.argmin(np.abs(way_back - 0.01))
    at_half = up[np.argmin(np.abs(way - 0.005))]
    assert down[half] == pytest.approx(10.0 - 2 * at_half, abs=0.05)


def test_wind_up_lags_where_elements_join_rotor_and_output(emps: Robot) -> None:
    entry = {
        "drive": 1,
        "torque": 60.0,
        "displacement": 2e-4,
        "between": "rotor_and_output",
        "stiffness": 4e5,
    }
    plant = released(
        emps,
        axis_truth(emps, Fv1=5e3),
        hysteresis=[entry],
        contact=[{"joint": 1, "upper": 0.0, "lower": 0.0, "stiffness": 3e5, "damping": 3e3}],
    )
    steps = 8000
    force = 150.0 * np.sin(2 * np.pi * np.arange(2 * steps) / steps)
    found = np.empty(len(force))
    for k, f in enumerate(force):
        plant.step(np.array([f]))
        found[k] = plant.drive_position()[0] - plant.joint_position()[0]
    falling, rising = found[steps + steps // 2], found[2 * steps - 1]
    assert falling > 2e-5
    assert rising < -2e-5


def test_transmission_error_moves_the_output(emps: Robot) -> None:
    entry = {"drive": 1, "amplitude": 1e-5, "order": 0.05, "phase": 0.4}
    plant = released(emps, axis_truth(emps), gear_ripple=[entry])
    rad_per_metre = 0.05 * emps.drive[0].gear * 2 * math.pi
    plant.motion.motors["velocity"][0] = 0.02
    plant.velocity[0] = 0.02
    for _ in range(2000):
        plant.step(np.zeros(1))
        rotor = plant.drive_position()[0]
        error = 1e-5 * math.sin(rad_per_metre * rotor + 0.4)
        assert plant.joint_position()[0] == pytest.approx(rotor - error, abs=1e-6)
    travelled = np.arange(0, 0.01, 1e-4)
    assert np.ptp(np.sin(rad_per_metre * travelled + 0.4)) > 0.5


PASSIVE: dict[str, dict[str, Any]] = {
    "elastic": {"joint_elasticity": [{"drive": d, "stiffness": 4e3 / d} for d in range(1, 7)]},
    "stiffening": {"joint_elasticity": [{"drive": 2, "stiffness": 2e3, "cubic": 1e7, "damping": 0.0}]},
    "play": {"backlash": [{"drive": d, "width": 2e-3} for d in range(1, 7)]},
    "lagging": {
        "hysteresis": [
            {"drive": 2, "torque": 20.0, "displacement": 0.002, "between": "rotor_and_output"},
            {"drive": 3, "torque": 5.0, "displacement": 0.05},
        ]
    },
    "inexact": {"gear_ripple": [{"drive": 2, "amplitude": 1e-3, "order": 2.0}]},
    "springs": {
        "gravity_spring": [{"joint": 2, "stiffness": 3000.0, "length": 0.1, "torsion": 20.0}],
        "cable_spring": [{"joint": 4, "stiffness": 2.0, "cubic": 5.0}],
        "contact": [{"joint": 3, "upper": 1.7, "stiffness": 500.0, "damping": 2.0}],
        "slosh": [{"joint": 2, "inertia": 0.2, "frequency": 2.0}],
        "payload": {"mass": 2.0, "centre": [0.0, 0.05, 0.1]},
        "base_tilt": {"roll": 0.2, "pitch": -0.1},
    },
    "shafts": {"wrist_coupling": [{"joints": [4, 5], "inertia": 0.02, "viscous": 0.2, "coulomb": 0.5}]},
}


@pytest.mark.parametrize("name", PASSIVE)
def test_nothing_passive_makes_energy(tx40: Robot, frictionless: Any, name: str) -> None:
    plant = released(tx40, frictionless, 1 / 16000, **PASSIVE[name])
    start = highest = plant.energy()
    largest = 0.0
    for k in range(round(0.5 / plant.step_time)):
        plant.step(np.zeros(6))
        if k % 200 == 0:
            energy = plant.energy()
            highest = max(highest, energy)
            largest = max(largest, 0.5 * plant.velocity @ plant.mass_matrix() @ plant.velocity)
    assert largest > 2.0
    assert highest - start < 5e-3 * largest
    if name in ("stiffening", "inexact"):
        assert plant.energy() - start > -0.02 * largest


def test_an_elastic_arm_stands_still_when_its_brakes_open(tx40: Robot, frictionless: Any) -> None:
    """Gravity has wound the gears up before: holding torques keep everything where it is."""
    elastic = {"joint_elasticity": [{"drive": d, "stiffness": 5e3} for d in range(1, 7)]}
    plant = released(tx40, frictionless, **elastic)
    assert plant.drive_position() == pytest.approx(tx40.transmission_matrix @ np.array(tx40.home), abs=1e-12)
    before, holding = plant.position.copy(), plant.holding_torque()
    assert np.abs(plant.drive_position() - tx40.transmission_matrix @ before).max() > 5e-4
    for _ in range(400):
        plant.step(holding)
    assert plant.position == pytest.approx(before, abs=1e-8)


def test_a_gear_that_swings_too_fast_is_refused_in_one_line(emps: Robot) -> None:
    with pytest.raises(
        DriveError, match=r"gear of drive 1 swings at \d+ Hz; allowed: at most \d+ Hz"
    ) as refusal:
        released(emps, axis_truth(emps), joint_elasticity=[{"drive": 1, "stiffness": 1e12}])
    assert "\n" not in str(refusal.value)


def test_a_gear_between_one_mass_is_refused(emps: Robot) -> None:
    with pytest.raises(DriveError, match="rotor of drive 1 has no inertia"):
        Plant(
            emps,
            axis_truth(emps, Ia1=0.0),
            scenario=Scenario.from_dict({"backlash": [{"drive": 1, "width": 1e-3}]}),
        )
