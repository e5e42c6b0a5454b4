"""Predicted and obtained %σ of the base parameters, on the simulated bench.

For each seed another arm is drawn around the description. An earlier capture of another planned motion gives
the errors to expect (σ and an AR process per joint) and the values with their deviations, as ``armhil plan
--earlier`` takes them. Then a motion is planned, its %σ predicted from the plan alone, the motion is
simulated with other noise and identified, and the %σ that identification reports is compared with the
prediction:

    python benchmarks/prediction.py --seeds 5

Three sources of the errors: the earlier capture with its memory along time (``ar``), the same capture's σ
taken as white, and the description alone, as for an arm that was never measured.

A %σ is a ratio with the estimate below: where the parameter drowns (%σ above 30) the estimate is largely
noise and so is its %σ, however well σ is known. Such parameters are in the figures of all parameters, and
the others are shown beside them.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace

os.environ.setdefault("OMP_NUM_THREADS", "1")  # many small solves are quicker on one thread

import numpy as np

from drivers.simulated import PlantTruth, draw_truth, simulate_offline
from ident import BaseParameters, Recording, RegressorModel, base_parameters, identify
from ident.estimators import stack, weighted_least_squares
from ident.preparation.observation import observe
from robots import Robot, load
from robots.arrays import FloatArray
from trajectories import Conditions, ExpectedValues, TorqueNoise, Trajectory, plan, predicted

WITHIN = 1.5
SHARE_ASKED = 0.9
SEEN = 30.0


@dataclass(frozen=True)
class Outcome:
    """Predicted over obtained, per base parameter, by source of the errors."""

    percent_sigma: dict[str, FloatArray]
    sigma: dict[str, FloatArray]
    obtained: FloatArray
    names: tuple[str, ...]


def recorded(robot: Robot, truth: PlantTruth, trajectory: Trajectory) -> Recording:
    """What the simulated arm answers to a trajectory."""
    run = simulate_offline(robot, truth, trajectory.position)
    return Recording("simulated", run.time, run.reference, run.position, run.control_signal)


def known_of(robot: Robot, base: BaseParameters, recording: Recording) -> tuple[TorqueNoise, ExpectedValues]:
    """Errors and values from an earlier recording, as ``armhil plan --earlier`` takes them."""
    rows = observe(base, (recording,), robot.identification)
    fit = weighted_least_squares(stack(rows), base.names, robot.identification.error_deviation)
    return TorqueNoise.of_rows(rows, fit), ExpectedValues(fit.beta, np.sqrt(np.diag(fit.covariance)))


def outcome(robot: Robot, base: BaseParameters, seed: int, options: argparse.Namespace) -> Outcome:
    """One arm: an earlier capture, a plan, its prediction, its identification."""
    truth = draw_truth(robot, seed)
    cycle = robot.bus.cycle_time
    earlier = plan(
        robot,
        cycle_time=cycle,
        duration=options.duration,
        seed=1000 + seed,
        family=options.family,
        periods=options.periods,
        evaluations=options.evaluations,
    )
    noise, expected = known_of(robot, base, recorded(robot, truth, earlier))
    trajectory = plan(
        robot,
        cycle_time=cycle,
        duration=options.duration,
        seed=seed,
        family=options.family,
        periods=options.periods,
        evaluations=options.evaluations,
        conditions=Conditions(noise=noise, expected=expected),
    )
    sources = {
        "ar": (noise, expected),
        "white": (TorqueNoise.white(robot, noise.sigma), expected),
        "description": (TorqueNoise.white(robot), None),
    }
    predictions = {
        name: predicted(base, trajectory.motion, cycle, errors, known)
        for name, (errors, known) in sources.items()
    }
    # Other noise on the same arm: the seed that is left is that of the noise alone.
    recording = recorded(robot, replace(truth, seed=5000 + seed), trajectory)
    found = identify(robot, (recording,)).result.least_squares
    sigma = np.array([parameter.sigma for parameter in found.parameters])
    percent = np.array([parameter.percent_sigma for parameter in found.parameters])
    return Outcome(
        {name: prediction.percent_sigma / percent for name, prediction in predictions.items()},
        {name: prediction.sigma / sigma for name, prediction in predictions.items()},
        percent,
        base.names,
    )


def same_advice(outcomes: Sequence[Outcome], source: str) -> float:
    """Share of the parameters within the factor, or poorly seen both by prediction and by identification."""
    ratios = np.concatenate([o.percent_sigma[source] for o in outcomes])
    obtained = np.concatenate([o.obtained for o in outcomes])
    poor = (obtained > SEEN) & (ratios * obtained > SEEN)
    return float(np.mean(poor | ((ratios < WITHIN) & (ratios > 1 / WITHIN))))


def row(label: str, ratios: FloatArray) -> str:
    """One line of the table: share within the factor, and the quantiles."""
    within = np.mean((ratios < WITHIN) & (ratios > 1 / WITHIN))
    finite = np.where(np.isfinite(ratios), ratios, np.inf)
    low, middle, high = np.quantile(finite, [0.05, 0.5, 0.95], method="nearest")
    return f"| {label} | {100 * within:.0f} % | {low:.2f} | {middle:.2f} | {high:.2f} |"


def main() -> None:
    """Run the seeds and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robot", default="tx40")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--family", choices=("ruckig", "fourier"), default="ruckig")
    parser.add_argument("--duration", type=float, default=12.0)
    parser.add_argument("--periods", type=int, default=2)
    parser.add_argument("--evaluations", type=int, default=4000)
    options = parser.parse_args()
    robot = load(options.robot)
    base = base_parameters(RegressorModel.of(robot))
    print(f"{options.robot}, {len(base.names)} base parameters, {options.family}, {options.seeds} seeds")
    print("| predicted / obtained | within a factor of 1.5 | 5 % | median | 95 % |")
    print("|---|---|---|---|---|")
    outcomes = []
    for seed in range(options.seeds):
        outcomes.append(outcome(robot, base, seed, options))
        print(row(f"seed {seed}, %σ, ar", outcomes[-1].percent_sigma["ar"]), flush=True)
    for quantity in ("percent_sigma", "sigma"):
        for source in outcomes[0].sigma:
            ratios = np.concatenate([getattr(o, quantity)[source] for o in outcomes])
            label = "%σ" if quantity == "percent_sigma" else "σ"
            print(row(f"**{label}, {source}**", ratios))
            if quantity == "percent_sigma":
                seen = np.concatenate([o.obtained for o in outcomes]) <= SEEN
                share = f"{100 * seen.mean():.0f} % of the parameters"
                both = 100 * same_advice(outcomes, source)
                print(f"| %σ, {source}, within the factor or above {SEEN:g} in both | {both:.0f} % | | | |")
                print(row(f"%σ, {source}, obtained %σ ≤ {SEEN:g}: {share}", ratios[seen]))
    every = np.array([o.percent_sigma["ar"] for o in outcomes])
    outside = ((every >= WITHIN) | (every <= 1 / WITHIN)).sum(axis=0)
    listed = [f"{n} ({k})" for n, k in zip(outcomes[0].names, outside, strict=True) if k]
    print(f"\noutside (seeds): {', '.join(listed) or 'none'}; asked for: {100 * SHARE_ASKED:.0f} % within")


if __name__ == "__main__":
    main()
