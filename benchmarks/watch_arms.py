"""Arms for the simulated years of ``benchmarks/watch.py``: what a night's estimate is made of.

One identification of a simulated TX40 gives the observation matrix, the covariance within a run and what the
model leaves. Faults that move parameters (friction, payload, gain, offset) are moved there; what play, an
encoder and a delay make of an estimate and of the residual is simulated once at each size.
"""

from __future__ import annotations

import pickle
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import robots
from drivers.simulated import Scenario, draw_truth, simulate_offline
from ident import Options, Recording, identify
from ident.drift import Geometry, geometry_of, patterns_of
from robots.arrays import FloatArray
from trajectories import plan

DRIVE = 2
SIMULATED = ("play", "encoder", "delay")
"""What is hidden in the plant: 0.4 mrad of play, 0.4 mrad of encoder error twice a turn, 8 ms of age."""
SIZES = (0.5, 1.0, 2.0)
"""Multiples of them that are simulated; wear goes through them."""


def hidden(kind: str, size: float) -> Mapping[str, Any]:
    """Scenario with so many times what is hidden."""
    if kind == "play":
        return {"backlash": [{"drive": DRIVE, "width": 4e-4 * size}]}
    if kind == "encoder":
        return {"gear_ripple": [{"drive": DRIVE, "amplitude": 4e-4 * size, "order": 2.0}]}
    return {"time_delay": [{"drive": DRIVE, "torque": 0.008 * size}]}


@dataclass(frozen=True)
class Arm:
    """What a night is drawn from.

    Attributes:
        geometry: of the accepted trajectory, with the true parameters.
        within: (b, b) covariance within a run.
        torque_rms: (n,) that the model leaves of each joint's torque, N·m.
        shifts: by fault, at each of the sizes, change (b,) of the parameters and (n,) factor on torque_rms.
    """

    geometry: Geometry
    within: FloatArray
    torque_rms: FloatArray
    shifts: dict[str, tuple[FloatArray, FloatArray]]

    def shift_of(self, kind: str, size: float | FloatArray) -> tuple[FloatArray, FloatArray]:
        """Change (…, b) of the parameters and factor (…, n) on torque_rms, linear between the sizes."""
        moved, factor = self.shifts[kind]
        at = np.asarray(size, dtype=float)[..., None]
        known = np.r_[0.0, SIZES]

        def between(values: FloatArray) -> FloatArray:
            right = np.clip(np.searchsorted(known, at[..., 0]), 1, len(SIZES))
            part = (at - known[right - 1][..., None]) / (known[right] - known[right - 1])[..., None]
            return np.asarray((1.0 - part) * values[right - 1] + part * values[right])

        start = np.zeros((1, moved.shape[1])), np.ones((1, factor.shape[1]))
        return between(np.vstack([start[0], moved])), between(np.vstack([start[1], factor]))


def made_arm(seed: int) -> Arm:
    """Plan, simulate and identify (a minute)."""
    robot = robots.load("tx40")
    truth = draw_truth(robot, seed)
    cycle = robot.bus.cycle_time
    motion = plan(robot, cycle_time=cycle, duration=8.0, seed=1, evaluations=2000, start=robot.home)

    def fitted(scenario: Mapping[str, Any]) -> Any:
        run = simulate_offline(
            robot,
            replace(truth, seed=seed + 1),
            motion.position,
            scenario=Scenario.from_dict(scenario),
            start=motion.position[0],
            seed=seed + 1,
        )
        recording = Recording("night", run.time, run.reference, run.position, run.control_signal)
        return identify(robot, (recording,), options=Options("ls"))

    plain = fitted({})
    fit = plain.least_squares
    left = np.array(plain.result.least_squares.torque_rms)
    shifts = {}
    for kind in SIMULATED:
        others = [fitted(hidden(kind, size)) for size in SIZES]
        shifts[kind] = (
            np.array([other.least_squares.beta - fit.beta for other in others]),
            np.array([other.result.least_squares.torque_rms for other in others]) / left,
        )
    return Arm(geometry_of(plain.base, plain.rows, fit.sigma, fit.beta), fit.covariance, left, shifts)


def arm_of(seed: int, folder: Path) -> Arm:
    """The same, kept in a file of the folder: the seeds of years are many, those of arms few."""
    file = folder / f"arm{seed}.pickle"
    if not file.exists():
        folder.mkdir(parents=True, exist_ok=True)
        file.write_bytes(pickle.dumps(made_arm(seed)))
    arm: Arm = pickle.loads(file.read_bytes())
    return arm


@dataclass(frozen=True)
class Hall:
    """Season and weather of a hall, K.

    Attributes:
        season: amplitude over the year.
        weather: deviation of the daily innovation, autocorrelation 0.75.
        weekend: by how much it is colder then.
        thermometer: whether its temperature is recorded.
    """

    season: float
    weather: float
    weekend: float
    thermometer: bool


HALLS = {
    "heated hall, thermometer": Hall(1.0, 0.5, 0.0, True),
    "heated hall": Hall(1.0, 0.5, 0.0, False),
    "cold hall, thermometer": Hall(6.0, 1.2, 3.0, True),
    "cold hall": Hall(6.0, 1.2, 3.0, False),
}


_LEFT_PER_KELVIN = (
    (-0.016, -0.066),
    (-0.007, -0.035),
    (-0.001, -0.011),
    (-0.014, -0.086),
    (0.0, -0.013),
    (-0.002, -0.029),
)
"""Change of the logarithm of a joint's residual per kelvin of the hall, and of the warmth left over from the
day: means over six arms (seeds 30 to 35 of ``benchmarks/year_nights.py``, 40 nights of a year each)."""
_LEFT_SPREAD = 0.045
"""Deviation of what that leaves."""


@dataclass(frozen=True)
class Year:
    """Nights without a change: (N, b) parameters, (N,) thermometer in °C or None, (N, n) residual torque."""

    values: FloatArray
    celsius: FloatArray | None
    torque_rms: FloatArray


def year_of(
    arm: Arm, hall: Hall, nights: int, seed: int, colder_from: int = 10_000, kelvin: float = 0.0
) -> Year:
    """Draw a year: friction follows its gear's warmth, each joint differently; the rest is nearly steady.

    From night ``colder_from`` on the hall is colder by ``kelvin``.
    """
    rng = np.random.default_rng([seed, 0x77])
    made, n = arm.geometry, arm.geometry.joints
    day, phase = np.arange(nights), rng.uniform(0, 365)
    weather = np.zeros(nights)
    for i in range(1, nights):
        weather[i] = 0.75 * weather[i - 1] + rng.normal(0.0, hall.weather)
    rest = (day + rng.integers(7)) % 7 >= 5
    room = hall.season * np.sin(2 * np.pi * (day - phase) / 365) + weather - hall.weekend * rest
    room = room - kelvin * (day >= colder_from)
    left_over = np.where(rest, 0.0, np.abs(rng.normal(0.0, 2.0, nights)))
    share = rng.uniform(0.7, 1.3, n)
    gears = room[:, None] + left_over[:, None] * share + rng.normal(0.0, 0.5, (nights, n))
    values = np.tile(made.beta, (nights, 1))
    for pattern in patterns_of(made):
        if pattern.scale is not None and pattern.joint is not None and "friction" in pattern.effect:
            mean, spread = (0.004, 0.5) if pattern.effect.startswith("coulomb") else (0.013, 0.3)
            per_kelvin = mean * np.exp(rng.normal(0.0, spread))
            steady = rng.normal(0.0, 0.004, nights)
            factor = np.exp(-per_kelvin * gears[:, pattern.joint - 1]) - 1.0 + steady
            values += factor[:, None] * pattern.scale * pattern.directions[:, 0]
    for drive in range(n):
        values += rng.normal(0.0, 2e-4, nights)[:, None] * made.gain_direction(drive)
    values += rng.normal(size=values.shape) @ np.linalg.cholesky(arm.within).T
    recorded = 22.0 + room + 0.7 * left_over + rng.normal(0.0, 0.3, nights)
    of_room, of_gear = np.array(_LEFT_PER_KELVIN).T[:, :n]
    by_warmth = room[:, None] * of_room + left_over[:, None] * of_gear
    torque = arm.torque_rms * np.exp(by_warmth + rng.normal(0.0, _LEFT_SPREAD, (nights, n)))
    return Year(values, recorded if hall.thermometer else None, torque)
