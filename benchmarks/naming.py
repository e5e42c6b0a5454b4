"""Blind campaign of the discrepancy search: how often the hidden effect gets its right name.

A scenario (effect, place, size) is drawn from a seed and given to the simulated plant alone; the search sees
recordings, description and a prior model from a clean run of the same arm. The scoring opens the truth
afterwards. Each run is one line of JSON, so that a campaign can be stopped and gone on with.

    python -m benchmarks.naming --single 300 --clean 200 --outside 50 --pairs 100 --jobs 2 --out naming.jsonl
    python -m benchmarks.naming --report naming.jsonl
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed

import robots
from benchmarks.evidence.asked import is_named
from benchmarks.evidence.case import Case
from benchmarks.naming_parameters import compared
from benchmarks.naming_report import NAMES, lines_of, picture, report
from drivers.errors import DriveError
from drivers.simulated import PlantTruth, draw_truth
from drivers.simulated.drawing import EFFECTS, DrawnScenario, draw_scenario
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import OUTSIDE_VOCABULARY, Scenario
from ident import Recording
from ident.discrepancy import Diagnosis
from ident.discrepancy.by_evidence import diagnose_with_evidence
from robots import Robot
from robots.arrays import FloatArray
from trajectories import plan

ARM = "tx40"
PERIOD = 12.0
PERIODS = 2
Task = tuple[str, str, int]
"""Kind of run (single, pair, one joint, triple, clean, outside), effect (or several, with a plus), seed."""


def main() -> None:
    """Run what is asked for, or report what was run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--single", type=int, default=0, help="scenarios with one hidden effect")
    parser.add_argument("--pairs", type=int, default=0, help="scenarios with two hidden effects")
    parser.add_argument("--one-joint", type=int, default=0, help="two hidden effects at one joint")
    parser.add_argument("--triples", type=int, default=0, help="three hidden effects, no two at one joint")
    parser.add_argument("--clean", type=int, default=0, help="arms with nothing hidden")
    parser.add_argument("--outside", type=int, default=0, help="effects that the vocabulary lacks")
    parser.add_argument("--effects", nargs="*", default=list(NAMES), help="effects of the single scenarios")
    parser.add_argument("--size", type=float, default=3.0, help="gap of the hidden effect in noise floors")
    parser.add_argument("--seed", type=int, default=5000, help="of the first scenario")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("naming.jsonl"))
    parser.add_argument("--report", type=Path, help="only report these results")
    parser.add_argument("--picture", type=Path, help="write the confusion matrix of the single scenarios")
    given = parser.parse_args()
    if given.report is None:
        campaign(tasks_of(given), given)
    print(report(given.report or given.out))
    if given.picture:
        picture(given.report or given.out, given.picture)


def tasks_of(given: argparse.Namespace) -> list[Task]:
    """Effects in turn, each with a seed of its own; the kinds mixed evenly, so that any beginning is fair."""
    outside, names, seed = OUTSIDE_VOCABULARY, given.effects, given.seed
    robot = robots.load(ARM)
    of_one = [name for name in names if all(len(axes) == 1 for axes in EFFECTS[name].places(robot))]
    kinds: list[list[Task]] = [
        [("single", names[k % len(names)], seed + k) for k in range(given.single)],
        [("clean", "white" if k % 3 else "coloured", seed + k) for k in range(given.clean)],
        [("outside", outside[k % len(outside)], seed + k) for k in range(given.outside)],
        [("pair", _several(names, 2, seed + k), seed + k) for k in range(given.pairs)],
        [("one joint", _several(of_one, 2, seed + k), seed + k) for k in range(given.one_joint)],
        [("triple", _several(names, 3, seed + k), seed + k) for k in range(given.triples)],
    ]
    placed = [((k + 0.5) / len(tasks), task) for tasks in kinds for k, task in enumerate(tasks)]
    return [task for _, task in sorted(placed)]


def _several(names: Sequence[str], number: int, seed: int) -> str:
    return "+".join(np.random.default_rng(seed).choice(names, number, replace=False))


def campaign(tasks: Sequence[Task], given: argparse.Namespace) -> None:
    """Run what the file does not hold yet, and append it."""
    done = {(line["kind"], line["effect"], line["seed"]) for line in lines_of(given.out)}
    wanted = [task for task in tasks if task not in done]
    motions = (motion(0), motion(1))
    runs = Parallel(n_jobs=given.jobs, return_as="generator_unordered")(
        delayed(one_run)(task, given.size, motions) for task in wanted
    )
    with given.out.open("a", encoding="utf-8") as file:
        for result in runs:
            file.write(json.dumps(result) + "\n")
            file.flush()


def motion(seed: int) -> FloatArray:
    """One period of an exciting trajectory, (N, n)."""
    robot = robots.load(ARM)
    planned = plan(
        robot,
        cycle_time=robot.bus.cycle_time,
        duration=PERIOD,
        seed=seed,
        evaluations=3000,
        periods=PERIODS,
    )
    return np.asarray(planned.position[: round(PERIOD / robot.bus.cycle_time)])


def one_run(task: Task, size: float, motions: tuple[FloatArray, FloatArray]) -> dict[str, Any]:
    """Draw, simulate, search, and only then compare."""
    kind, effect, seed = task
    robot = robots.load(ARM)
    truth = draw_truth(robot, seed)
    started = time.process_time()
    try:
        scenario, axes, ratio = hidden(robot, truth, task, size, motions[0])
    except DriveError as error:
        return {"kind": kind, "effect": effect, "seed": seed, "skipped": str(error)}
    quiet = scenario if kind == "clean" else Scenario()
    accepted = record(robot, truth, quiet, motions[0], seed + 1)
    fit = record(robot, truth, scenario, motions[0], seed + 2)
    validation = record(robot, truth, scenario, motions[1], seed + 3)
    found = search(robot, accepted, fit, validation)
    return {
        "kind": kind,
        "effect": effect,
        "seed": seed,
        "axes": list(axes),
        "ratio": ratio,
        "size": size,
        "scenario": scenario.as_dict(),
        "processor_seconds": time.process_time() - started,
        **summary(found),
        "compared": beside_truth(robot, truth, scenario, found),
    }


def beside_truth(
    robot: Robot, truth: PlantTruth, scenario: Scenario, found: Diagnosis
) -> dict[str, dict[str, list[float]]]:
    """Per finding that is hidden there, its parameters: found, standard deviation, truth."""
    hidden, pairs = scenario.as_dict(), {}
    for finding in found.findings:
        values = {p.name: (p.value, p.sigma) for p in finding.parameters}
        both = compared(robot, truth, hidden, finding.effect, finding.joints, values)
        if both:
            pairs[finding.effect] = both
    return pairs


def hidden(
    robot: Robot, truth: PlantTruth, task: Task, size: float, path: FloatArray
) -> tuple[Scenario, Sequence[Any], float]:
    """What a task hides: the scenario, its axes (of several effects each its own), least gap over floor."""
    kind, effect, seed = task
    if kind == "clean":
        noise = {"noise": {"time_constant": 0.02}} if effect == "coloured" else {}
        return Scenario.from_dict({"format": 1, **noise}), (), 0.0
    drawn: list[DrawnScenario] = []
    for one in effect.split("+"):
        beside = partial(_may_sit, kind, [other.axes for other in drawn])
        drawn.append(draw_scenario(robot, one, seed, size, truth=truth, reference=path, allowed=beside))
    scenario = drawn[0].scenario
    for other in drawn[1:]:
        scenario = scenario.merged(other.scenario)
    axes = drawn[0].axes if len(drawn) == 1 else [one.axes for one in drawn]
    return scenario, axes, min(one.ratio for one in drawn)


def _may_sit(kind: str, taken: Sequence[tuple[int, ...]], axes: tuple[int, ...]) -> bool:
    """Whether an effect may sit on some axes beside those that sit on others."""
    if kind == "triple":
        return not any(set(axes) & set(one) for one in taken)
    return kind != "one joint" or all(axes == one for one in taken)


def record(robot: Robot, truth: PlantTruth, scenario: Scenario, path: FloatArray, seed: int) -> Recording:
    """What a master would have recorded."""
    run = simulate_offline(robot, truth, path, scenario=scenario, periods=PERIODS, seed=seed)
    return Recording("blind", run.time, run.reference, run.position, run.control_signal)


def search(robot: Robot, accepted: Recording, fit: Recording, validation: Recording) -> Diagnosis:
    """The search as a user runs it: an accepted model as prior, one capture to fit, another to validate."""
    question = Case("blind", "own", robot, fit, validation, None, accepted).question()
    return diagnose_with_evidence(question, sizes=False)[0]


def summary(found: Diagnosis) -> dict[str, Any]:
    """What the scoring needs of a diagnosis."""
    gap = found.torque
    return {
        "verdict": found.verdict,
        "findings": [
            {
                "effect": finding.effect,
                "joints": list(finding.joints),
                "score": finding.score,
                "named": is_named(finding),
                "probability": finding.probability,
                "set": [[[c.effect], [list(c.joints)]] for c in finding.indistinguishable_from],
                "parameters": {p.name: [p.value, p.sigma] for p in finding.parameters},
            }
            for finding in found.findings
        ],
        "explainable": [gap.explainable(gap.before).tolist(), gap.explainable(gap.after).tolist()],
        "floor": gap.floor.tolist(),
        "level": [gap.before.tolist(), gap.after.tolist()],
    }


if __name__ == "__main__":
    main()
