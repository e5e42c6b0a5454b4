"""Are the parameters of the simulated arm recovered, and is σ as large as the errors are?

Each replicate is an arm of its own (drawn from its seed), its own planned trajectory, its own noise: the demo
without a bus. Every base parameter's error is divided by its σ. A σ that is right gives an rms of 1, 99.7 %
within 3 σ and 99 % within 2.58 σ. Parameters of one replicate are correlated, so the interval of a share is
that of the replicates' shares (t distribution over the seeds).

    python benchmarks/recovery.py --replicates 20
"""

from __future__ import annotations

import argparse
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # many small solves are quicker on one thread

import numpy as np
from scipy.stats import norm, t

import robots
from drivers.simulated.offline import simulate_offline
from drivers.simulated.truth import PlantTruth, draw_truth
from ident import BaseParameters, Recording, drive_parameters, identify
from ident.results import Estimate
from robots import Robot
from robots.arrays import FloatArray
from trajectories import plan

SEED = 0
DURATION = 12.0
PERIODS = 2
NINETY_NINE = float(norm.ppf(0.995))


def recording(robot: Robot, seed: int, evaluations: int) -> Recording:
    """One run of the arm of that seed along the trajectory of that seed."""
    trajectory = plan(
        robot,
        cycle_time=robot.bus.cycle_time,
        duration=DURATION,
        seed=seed,
        evaluations=evaluations,
        periods=PERIODS,
    )
    run = simulate_offline(robot, draw_truth(robot, seed), trajectory.position)
    return Recording(f"seed {seed}", run.time, run.reference, run.position, run.control_signal)


def true_values(base: BaseParameters, plant: PlantTruth) -> FloatArray:
    """The simulated arm's base parameters, (b,)."""
    drives = drive_parameters(
        base.model.robot, plant.per_drive("Ia"), plant.per_drive("Fv"), plant.per_drive("Fc")
    )
    return np.asarray(base.regroup({**plant.parameters, **drives}))


def errors_in_sigma(estimate: Estimate, truth: FloatArray) -> FloatArray:
    """(b,) (β̂ − β)/σ."""
    return np.array([(p.value - true) / p.sigma for p, true in zip(estimate.parameters, truth, strict=True)])


def interval(values: FloatArray) -> str:
    """Mean with its 95 % interval over the replicates."""
    if values.size < 2:
        return f"{values.mean():.4g}"
    half = float(t.ppf(0.975, values.size - 1)) * values.std(ddof=1) / np.sqrt(values.size)
    return f"{values.mean():.4g} [{values.mean() - half:.4g}, {values.mean() + half:.4g}]"


def report(label: str, errors: FloatArray, names: tuple[str, ...]) -> None:
    """Size of the errors over replicates × parameters, and the parameters that are off on average."""
    size = np.abs(errors)
    print(f"\n{label}: {errors.shape[0]} replicates × {errors.shape[1]} parameters")
    print(
        f"  rms of error/σ            {interval(np.sqrt(np.mean(errors**2, axis=1)))}   (1 where σ is right)"
    )
    three = interval(100 * np.mean(size <= 3, axis=1))
    print(f"  share within 3 σ, %       {three}   (99.73)")
    share = interval(100 * np.mean(size <= NINETY_NINE, axis=1))
    print(f"  share within {NINETY_NINE:.2f} σ, %    {share}   (99)")
    print(f"  share within 1.96 σ, %    {interval(100 * np.mean(size <= 1.96, axis=1))}   (95)")
    print(f"  replicates with all within 3 σ   {int(np.sum(size.max(axis=1) <= 3))}")
    worst = np.unravel_index(np.argmax(size), size.shape)
    print(f"  farthest                  {names[worst[1]]} in replicate {worst[0]}, {errors[worst]:+.2f} σ")
    mean = errors.mean(axis=0)
    far = np.argsort(-np.abs(mean))[:4]
    named = ", ".join(f"{names[k]} {mean[k]:+.2f}" for k in far)
    print(f"  largest mean error/σ      {named}   (deviation of a mean: {1 / np.sqrt(len(errors)):.2f})")


def main() -> None:
    """Parse the command line and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--robot", default="tx40")
    parser.add_argument("--replicates", type=int, default=20)
    parser.add_argument("--evaluations", type=int, default=800, help="trials of each trajectory search")
    options = parser.parse_args()
    robot = robots.load(options.robot)
    print(f"{robot.name}, seeds {SEED} to {SEED + options.replicates - 1}", flush=True)
    found: dict[str, list[FloatArray]] = {"ls": [], "iv": []}
    lags, names = [], ()
    for seed in range(SEED, SEED + options.replicates):
        fitted = identify(robot, (recording(robot, seed, options.evaluations),))
        truth = true_values(fitted.base, draw_truth(robot, seed))
        names = fitted.base.names
        for estimate in fitted.result.estimates:
            found[estimate.method].append(errors_in_sigma(estimate, truth))
        signals = fitted.result.signals
        if signals is not None and signals.estimated_lag is not None:
            lags.append(1e3 * signals.estimated_lag)
    for label, method in (("Least squares", "ls"), ("Instrumental variables", "iv")):
        if found[method]:
            report(label, np.array(found[method]), names)
    print(f"\nestimated lag of the control signal, ms: {interval(np.array(lags))}")


if __name__ == "__main__":
    main()
