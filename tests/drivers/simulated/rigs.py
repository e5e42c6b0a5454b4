"""Single axes on which one law at a time can be checked by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from drivers.simulated import PlantTruth, Scenario, nominal_truth
from drivers.simulated.plant import Plant
from robots import Robot


def axis_truth(robot: Robot, **changes: float) -> PlantTruth:
    """The one-axis arm with a rotor of 20 kg, without friction, and what else is given (Ia1, Fc1 …)."""
    nominal = nominal_truth(robot)
    plain = {"Ia1": 20.0, "Fv1": 0.0, "Fc1": 0.0}
    return replace(nominal, parameters=nominal.parameters | plain | changes)


def released(robot: Robot, truth: PlantTruth, step: float = 1 / 4000, **effects: Any) -> Plant:
    """A plant whose brakes are off."""
    plant = Plant(robot, truth, step, Scenario.from_dict(effects))
    plant.engage(np.zeros(robot.n, dtype=np.bool_))
    return plant


def carried(plant: Plant, speed: Callable[[float], float], duration: float) -> tuple[np.ndarray, np.ndarray]:
    """Moves a one-axis plant along a speed profile by force; speeds and the forces that this takes.

    The axis is held to the profile by setting its speed before each step; what friction adds to that is read
    from the change of momentum.
    """
    steps = round(duration / plant.step_time)
    speeds, forces = np.empty(steps), np.empty(steps)
    inertia = float(plant.mass_matrix()[0, 0])
    for k in range(steps):
        wanted = speed(k * plant.step_time)
        plant.velocity[0] = wanted
        plant.motion.motors["last_change"][0] = speed((k + 1) * plant.step_time) - wanted
        plant.step(np.zeros(1))
        forces[k] = -inertia * (plant.velocity[0] - wanted) / plant.step_time
        speeds[k] = wanted
    return speeds, forces
