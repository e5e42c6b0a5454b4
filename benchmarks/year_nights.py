"""Nights of a simulated year: one arm, one accepted trajectory, a hall whose temperature swings.

What varies from night to night: the room (season, weather, a colder hall at weekends), how warm the gears
still are from the day, which the sensors see only in part, the sensors' own error, and the arm's noise.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import robots
from drivers.simulated import PlantTruth, Scenario, draw_truth, simulate_offline
from ident import Options, Recording, identify
from ident.drift import Geometry, geometry_of
from robots import Robot
from robots.arrays import FloatArray
from trajectories import plan

WEEK = 7
REFERENCE_CELSIUS = 22.0


@dataclass(frozen=True)
class Nights:
    """Identified parameters night by night.

    Attributes:
        day: (N,) nights since the first.
        celsius: (N,) temperature that was recorded, °C.
        values: (N, b) base parameters.
        covariance: (N, b, b) within the run.
        torque_rms: (N, n) of what the model leaves of each joint's torque, N·m.
        verdict: (N,) of the revised test; empty where it was not made.
    """

    day: FloatArray
    celsius: FloatArray
    values: FloatArray
    covariance: FloatArray
    torque_rms: FloatArray
    verdict: tuple[str, ...]


@dataclass(frozen=True)
class Bench:
    """The arm, its trajectory, and what its observation matrix tells of effects."""

    robot: Robot
    truth: PlantTruth
    reference: FloatArray
    geometry: Geometry


def bench(seed: int, duration: float = 8.0, evaluations: int = 2000) -> Bench:
    """An arm drawn from a seed, with a planned trajectory and the observation matrix of one run."""
    robot = robots.load("tx40")
    truth = draw_truth(robot, seed)
    planned = plan(
        robot,
        cycle_time=robot.bus.cycle_time,
        duration=duration,
        seed=1,
        evaluations=evaluations,
        start=robot.home,
    )
    fitted = identify(robot, (_run(robot, truth, planned.position, Scenario(), 0),), options=Options("ls"))
    rows = fitted.rows
    fit = fitted.least_squares
    return Bench(robot, truth, planned.position, geometry_of(fitted.base, rows, fit.sigma, fit.beta))


def hall(nights: int, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Room and gears above the reference temperature (K) and the recorded temperature (°C), (N,) each."""
    rng = np.random.default_rng([seed, 0xA1])
    day = np.arange(nights)
    weather = np.zeros(nights)
    for i in range(1, nights):
        weather[i] = 0.75 * weather[i - 1] + rng.normal(0.0, 1.2)
    room = 5.0 * np.sin(2 * np.pi * (day - 60) / 365) + weather - 3.0 * (day % WEEK >= WEEK - 2)
    left_over = np.where(day % WEEK >= WEEK - 2, 0.0, np.abs(rng.normal(0.0, 2.0, nights)))
    recorded = REFERENCE_CELSIUS + room + 0.7 * left_over + rng.normal(0.0, 0.3, nights)
    return room, room + left_over, recorded


def run_nights(
    made: Bench,
    days: Iterable[int],
    seed: int,
    changes: Mapping[int, Mapping[str, Any]],
    *,
    nights: int = 400,
    tested: int = 0,
) -> Nights:
    """Simulate and identify the nights ``days``.

    Args:
        made: the arm.
        days: which nights.
        seed: of the hall and of the noise.
        changes: what the arm has besides on each.
        nights: of the hall.
        tested: the revised test, which takes longer, is made on nights whose number it divides; on none
            where 0.
    """
    room, gears, recorded = hall(nights, seed)
    days = list(days)
    values, covariances, left, verdicts = [], [], [], []
    for day in days:
        drift = [
            {"drive": j + 1, "start": float(gears[day]), "ambient": float(room[day])}
            for j in range(made.robot.n)
        ]
        scenario = Scenario.from_dict({"drifting_friction": drift, **changes.get(day, {})})
        recording = _run(made.robot, made.truth, made.reference, scenario, 1000 * seed + day + 1)
        with_test = bool(tested) and day % tested == 0
        fitted = identify(made.robot, (recording,), options=Options("auto" if with_test else "ls"))
        values.append(fitted.least_squares.beta)
        covariances.append(fitted.least_squares.covariance)
        left.append(fitted.result.least_squares.torque_rms)
        verdicts.append(fitted.result.test.verdict if with_test else "")
    return Nights(
        np.array(days, dtype=float),
        recorded[days],
        np.array(values),
        np.array(covariances),
        np.array(left),
        tuple(verdicts),
    )


def recorded_night(
    robot: Robot, truth: PlantTruth, reference: FloatArray, room: float, gears: float, seed: int
) -> Recording:
    """One night without a change.

    Args:
        robot, truth: the arm.
        reference: (N, n) of the accepted trajectory.
        room, gears: their warmth above the reference temperature, K.
        seed: of the noise.
    """
    drift = [{"drive": j + 1, "start": float(gears), "ambient": float(room)} for j in range(robot.n)]
    return _run(robot, truth, reference, Scenario.from_dict({"drifting_friction": drift}), seed)


def _run(robot: Robot, truth: PlantTruth, reference: FloatArray, scenario: Scenario, seed: int) -> Recording:
    run = simulate_offline(
        robot, replace(truth, seed=seed), reference, scenario=scenario, start=reference[0], seed=seed
    )
    return Recording(f"night {seed}", run.time, run.reference, run.position, run.control_signal)
