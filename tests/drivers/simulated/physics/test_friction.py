"""Friction has the shapes of the literature: breakaway, pre-sliding loops, Stribeck's curve."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from drivers.simulated import nominal_truth
from drivers.simulated.plant import Plant
from robots import Robot
from tests.drivers.simulated.rigs import axis_truth, carried, released

FC = 20.0
OF_LOAD = {"drive": 2, "coefficient": 0.2, "time_constant": 0.002}
EFFICIENCY = {"drive": 2, "driving": 0.3, "driven": 0.1, "time_constant": 0.002}
HEAVY = 1e7
"""kg: an axis this heavy keeps the speed that it was given."""


def steady_force(robot: Robot, speed: float, **effects: Any) -> float:
    """Friction force at a constant speed, once it has settled."""
    truth = axis_truth(robot, Fc1=FC, Ia1=HEAVY, Fv1=effects.pop("viscous", 0.0))
    plant = released(robot, truth, **effects)
    _, forces = carried(plant, lambda t: speed, 0.1)
    return float(forces[-20:].mean())


@pytest.mark.parametrize("speed", [-0.2, -0.01, -0.002, 0.002, 0.005, 0.02, 0.3])
@pytest.mark.parametrize("exponent", [1.0, 2.0])
def test_sliding_follows_stribecks_curve(emps: Robot, speed: float, exponent: float) -> None:
    entry = {"drive": 1, "rise": 0.4, "speed": 0.01, "exponent": exponent}
    expected = math.copysign(FC * (1 + 0.4 * math.exp(-((abs(speed) / 0.01) ** exponent))), speed)
    assert steady_force(emps, speed, stribeck_friction=[entry]) == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("speed", [-0.1, 0.1])
def test_levels_depend_on_the_direction(emps: Robot, speed: float) -> None:
    entry = {"drive": 1, "coulomb": 0.2, "viscous": -0.3}
    found = steady_force(emps, speed, viscous=100.0, asymmetric_friction=[entry])
    side = math.copysign(1, speed)
    assert found == pytest.approx(side * FC * (1 + 0.2 * side) + 100.0 * speed * (1 - 0.3 * side), rel=2e-3)


@pytest.mark.parametrize("speed", [0.02, 0.1, 0.25])
def test_viscous_friction_follows_its_power_and_cubic_law(emps: Robot, speed: float) -> None:
    entry = {"drive": 1, "share": 0.6, "exponent": 0.5, "reference": 0.1, "cubic": 300.0}
    linear = 100.0 * speed
    expected = FC + 0.4 * linear + 0.6 * linear * (speed / 0.1) ** -0.5 + 300.0 * speed**3
    found = steady_force(emps, speed, viscous=100.0, nonlinear_viscous_friction=[entry])
    assert found == pytest.approx(expected, rel=2e-3)


def breakaway(robot: Robot, rate: float, **effects: Any) -> float:
    """Force, rising at a rate in N/s, at which the axis begins to slide."""
    plant = released(robot, axis_truth(robot, Fc1=FC, M1=95.0), **effects)
    force = 0.0
    while plant.velocity[0] < 2e-3:
        force += rate * plant.step_time
        plant.step(np.array([force]))
        assert force < 5 * FC
    return force


def test_stiction_breaks_away_above_coulomb_friction(emps: Robot) -> None:
    entry = {"drive": 1, "rise": 0.5, "speed": 0.002, "displacement": 1e-4}
    plain = breakaway(emps, 4.0)
    sticky = breakaway(emps, 4.0, static_friction=[entry])
    assert plain == pytest.approx(FC, rel=0.1)
    assert sticky == pytest.approx(1.5 * FC, rel=0.1)


def test_below_breakaway_the_bristle_is_a_hysteretic_spring(emps: Robot) -> None:
    """Slow loops of force within pre-sliding: it moves by microns, comes back, and each loop loses energy."""
    entry = {"drive": 1, "rise": 0.0, "displacement": 1e-4}
    plant = released(emps, axis_truth(emps, Fc1=FC), static_friction=[entry])
    steps = 8000
    force = 0.7 * FC * np.sin(2 * np.pi * np.arange(3 * steps) / steps)
    place = np.empty(len(force))
    for k, f in enumerate(force):
        plant.step(np.array([f]))
        place[k] = plant.position[0]
    loop_force, loop_place = force[steps:], place[steps:]
    assert 0.3e-4 < np.ptp(loop_place) < 4e-4
    lost = np.trapezoid(loop_force, loop_place) / 2
    assert lost > 0.05 * 0.7 * FC * np.ptp(loop_place)
    # Repeated loops lie on one another: the elastic part comes back.
    assert place[3 * steps - 1] == pytest.approx(place[2 * steps - 1], abs=0.02 * np.ptp(loop_place))


def test_friction_lags_behind_the_speed(emps: Robot) -> None:
    """In pure sliding with a changing speed, friction is higher when the speed grows than when it falls."""
    entry = {"drive": 1, "rise": 1.0, "speed": 0.01}
    wide = {"drive": 1, "rise": 0.0, "displacement": 2e-4}
    plant = released(emps, axis_truth(emps, Fc1=FC), stribeck_friction=[entry], static_friction=[wide])
    speeds, forces = carried(plant, lambda t: 0.02 + 0.015 * math.sin(2 * math.pi * 10 * t), 0.3)
    last = slice(len(speeds) * 2 // 3, None)
    rising = np.gradient(speeds[last]) > 0
    middle = np.abs(speeds[last] - 0.02) < 0.003
    up = forces[last][middle & rising].mean()
    down = forces[last][middle & ~rising].mean()
    assert up > down + 0.02 * FC


def test_a_spot_and_a_wave_sit_where_they_should(emps: Robot) -> None:
    truth = axis_truth(emps, Fc1=FC, Ia1=HEAVY)
    spot = {"drive": 1, "spot": 0.5, "spot_centre": 0.05, "spot_width": 0.01}
    plant = released(emps, truth, position_dependent_friction=[spot])
    _, forces = carried(plant, lambda t: 0.1, 1.0)
    place = 0.1 * np.arange(len(forces)) * plant.step_time
    assert forces[np.argmin(np.abs(place - 0.05))] == pytest.approx(1.5 * FC, rel=0.01)
    assert forces[np.argmin(np.abs(place - 0.09))] == pytest.approx(FC, rel=0.01)
    wave = {"drive": 1, "wave": 0.3, "order": 100.0, "phase": 1.0}
    plant = released(emps, truth, position_dependent_friction=[wave])
    _, forces = carried(plant, lambda t: 0.1, 1.0)
    expected = FC * (1 + 0.3 * np.cos(100.0 * place - 1.0))
    assert forces[400:] == pytest.approx(expected[400:], rel=0.02)


@pytest.mark.parametrize(
    ("entry", "speed", "coefficient", "power"),
    [
        ({"load_dependent_friction": [OF_LOAD]}, 0.2, OF_LOAD["coefficient"], 1),
        ({"load_dependent_friction": [OF_LOAD]}, -0.2, OF_LOAD["coefficient"], 1),
        ({"load_quadratic_friction": [OF_LOAD | {"coefficient": 0.008}]}, -0.2, 0.008, 2),
        ({"directional_efficiency": [EFFICIENCY]}, 0.2, EFFICIENCY["driven"], 1),
        ({"directional_efficiency": [EFFICIENCY]}, -0.2, EFFICIENCY["driving"], 1),
    ],
)
def test_friction_grows_with_the_load_through_the_gear(
    tx40: Robot, entry: dict[str, object], speed: float, coefficient: float, power: int
) -> None:
    """Joint 2 in motion, stretched: the level rises with what its links take from the gear.

    The stretched arm pulls joint 2 forwards: forwards it drives its gear, backwards the gear lifts it.
    """
    nominal = nominal_truth(tx40)
    figures = {name: 0.0 if name[:2] in ("Fv", "Fc") else v for name, v in nominal.parameters.items()}
    truth = replace(nominal, parameters=figures | {"Fc2": 5.0})
    plant = released(tx40, truth, **entry)
    plant.position[:3] = [0.0, 1.2, 0.3]
    plant.velocity[1] = speed
    for _ in range(80):
        before = plant.velocity.copy()
        push = np.array([0, np.copysign(5.0, speed), 0, 0, 0, 0])
        plant.step(plant.holding_torque() + push)
    acceleration = (plant.velocity - before) / plant.step_time
    data = plant.model.createData()
    load = pin.rnea(plant.model, data, plant.position, plant.velocity, acceleration)[1]
    motor = plant.motion.motors[1]
    assert abs(load) > 20
    friction = motor["dry"] + motor["slope"] * motor["velocity"]
    assert load < 0.0
    assert friction == pytest.approx(np.copysign(5.0 + coefficient * abs(load) ** power, speed), rel=0.02)


def test_temperature_follows_the_power_of_friction(emps: Robot) -> None:
    """Constant speed: warmth goes to heating · power with its time constant, and friction follows."""
    drift = {
        "drive": 1,
        "heating": 5.0,
        "time_constant": 0.5,
        "viscous_per_kelvin": 0.0,
        "coulomb_per_kelvin": -0.02,
        "start": 4.0,
    }
    plant = released(emps, axis_truth(emps, Fc1=FC, Ia1=HEAVY), drifting_friction=[drift])
    _, forces = carried(plant, lambda t: 0.1, 3.0)
    warmth = float(plant.temperature()[0])
    assert forces[100] == pytest.approx(FC * math.exp(-0.02 * 4.0), rel=0.02)
    assert warmth == pytest.approx(5.0 * forces[-1] * 0.1, rel=0.02)
    assert forces[-1] == pytest.approx(FC * math.exp(-0.02 * warmth), rel=0.01)


def test_oil_gets_thinner_and_dry_friction_stays(emps: Robot) -> None:
    oil = {"drive": 1, "start": 30.0, "per_kelvin": -0.02, "time_constant": 1e6, "heating": 0.0}
    warm = {"viscous": 100.0, "temperature_viscous_friction": [oil]}
    slow, fast = (steady_force(emps, speed, **warm) for speed in (0.05, 0.2))
    thinner = 100.0 * math.exp(-0.02 * 30.0)
    assert (fast - slow) / 0.15 == pytest.approx(thinner, rel=0.01)
    assert slow - 0.05 * thinner == pytest.approx(FC, rel=0.01)


def test_a_drifting_room_warms_a_gear_without_friction(emps: Robot) -> None:
    drift = {"drive": 1, "ambient": 2.0, "ambient_rate": 3.0, "time_constant": 0.2, "heating": 0.0}
    plant = released(emps, axis_truth(emps), drifting_friction=[drift])
    for _ in range(8000):
        plant.step(np.zeros(1))
    # A first-order lag follows a ramp at a distance of its time constant.
    assert plant.temperature()[0] == pytest.approx(2.0 + 3.0 * (2.0 - 0.2), rel=0.01)


def test_a_rubbing_brake_comes_and_goes(emps: Robot) -> None:
    rub = {"drive": 1, "rise": 0.5, "period": 0.4, "share": 0.25}
    plant = released(emps, axis_truth(emps, Fc1=FC, Ia1=HEAVY), dragging_brake=[rub])
    _, forces = carried(plant, lambda t: 0.1, 0.8)
    half = len(forces) // 2
    assert forces[half + 200] == pytest.approx(1.5 * FC, rel=0.01)
    assert forces[half + 1000] == pytest.approx(FC, rel=0.01)


def test_more_friction_is_more_friction(emps: Robot) -> None:
    plain = steady_force(emps, 0.1, viscous=50.0)
    viscous = steady_force(emps, 0.1, viscous=50.0, viscous_friction=[{"drive": 1, "change": 0.4}])
    coulomb = steady_force(emps, 0.1, viscous=50.0, coulomb_friction=[{"drive": 1, "change": -0.5}])
    assert viscous - plain == pytest.approx(0.4 * 5.0, rel=0.02)
    assert coulomb - plain == pytest.approx(-0.5 * FC, rel=0.02)


def test_plant_without_friction_has_none(emps: Robot) -> None:
    plant = Plant(emps, axis_truth(emps))
    plant.engage(np.zeros(1, dtype=np.bool_))
    plant.velocity[0] = 0.1
    for _ in range(400):
        plant.step(np.zeros(1))
    assert plant.velocity[0] == pytest.approx(0.1, abs=1e-12)
