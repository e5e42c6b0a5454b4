"""How often the check would say without a change that the model leaves more of the torque than before.

    PYTHONPATH=. python benchmarks/year_residual.py --nights 300 --seeds 21 22 23 24 --json residual.json

Years of ``benchmarks/year.py`` without what takes long there: the residual of least squares needs neither a
covariance nor a comparison. All arms go through a night before the next one, so that a run that is cut short
has the same nights of each; the file is written after every night. Ten minutes on one core.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import robots
from benchmarks.year import largest_growth, rate_words, residual_warnings
from benchmarks.year_nights import hall, recorded_night
from daq.check.residual import ENOUGH, INCREASE, INCREASE_OF_FEW
from drivers.simulated import draw_truth
from ident import Recording, RegressorModel, base_parameters
from ident.drift import DriftSettings
from ident.estimators import stack, weighted_least_squares
from ident.parameters.base import BaseParameters
from ident.preparation.observation import observe
from robots.arrays import FloatArray
from trajectories import plan


def residual_rms(base: BaseParameters, recording: Recording) -> FloatArray:
    """(n,) rms of what least squares leaves of each joint's torque, N·m, as ``identify`` has it."""
    settings = base.model.robot.identification
    stacked = stack(observe(base, (recording,), settings))
    fit = weighted_least_squares(stacked, base.names, settings.error_deviation)
    residuals = stacked.split(stacked.y - stacked.x @ fit.beta)
    return np.array([float(np.sqrt(np.mean(np.square(left)))) for left in residuals])


def years(seeds: list[int], nights: int) -> Iterator[dict[int, list[list[float]]]]:
    """After each night, what was left on every night so far, by arm."""
    robot = robots.load("tx40")
    cycle_time = robot.bus.cycle_time
    planned = plan(robot, cycle_time=cycle_time, duration=8.0, seed=1, evaluations=2000, start=robot.home)
    base = base_parameters(RegressorModel.of(robot))
    truths = {seed: draw_truth(robot, seed) for seed in seeds}
    halls = {seed: hall(400, seed) for seed in seeds}
    found: dict[int, list[list[float]]] = {seed: [] for seed in seeds}
    for day in range(nights + 1):
        for seed in seeds:
            room, gears, _ = halls[seed]
            recording = recorded_night(
                robot, truths[seed], planned.position, room[day], gears[day], 1000 * seed + day + 1
            )
            found[seed].append(residual_rms(base, recording).tolist())
        yield found


def shuffled_rate(torque_rms: FloatArray, times: int = 2000, seed: int = 0) -> float:
    """Warnings in a year of these nights, on average over orders that they might have come in.

    A year has one order, and a warning depends on which nights come early. Takes nights for exchangeable,
    which the seasons are not quite.

    Args:
        torque_rms: (N, n) night by night.
        times: orders that are tried.
        seed: of the orders.
    """
    rng = np.random.default_rng(seed)
    limits = np.where(np.arange(1, len(torque_rms)) >= ENOUGH, INCREASE, INCREASE_OF_FEW)[:, None]
    count = 0
    for _ in range(times):
        order = torque_rms[rng.permutation(len(torque_rms))]
        most = np.maximum.accumulate(order, axis=0)[:-1]
        count += int((order[1:] > limits * most).any(axis=1).sum())
    return count / times


def words_of(found: dict[int, list[list[float]]], last: bool) -> dict[str, Any]:
    """Warnings and how near the years came to one; in other orders of the nights too after the last one."""
    warnings = {seed: residual_warnings(np.array(v), [True] * len(v)) for seed, v in found.items()}
    largest = {seed: largest_growth(np.array(v), [True] * len(v)) for seed, v in found.items()}
    nights = sum(len(values) - 1 for values in found.values())
    count = sum(len(one) for one in warnings.values())
    return {
        "nights": nights,
        "warnings": count,
        "rate": rate_words(count, nights, DriftSettings()),
        "largest": largest,
        "shuffled": {seed: shuffled_rate(np.array(values)) for seed, values in found.items()} if last else {},
        "torque_rms": found,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--nights", type=int, default=300)
    parser.add_argument("--seeds", type=int, nargs="+", default=[21, 22, 23, 24], help="of the arms")
    parser.add_argument("--json", type=Path, default=None)
    given = parser.parse_args()
    words: dict[str, Any] = {}
    for found in years(given.seeds, given.nights):
        done = len(found[given.seeds[0]]) - 1
        if not done:
            continue
        words = words_of(found, done == given.nights)
        if given.json is not None:
            given.json.write_text(json.dumps(words, indent=1) + "\n", encoding="utf-8")
    words.pop("torque_rms", None)
    print(json.dumps(words, indent=2))


if __name__ == "__main__":
    main()
