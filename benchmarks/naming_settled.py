"""Ambiguous sets, and whether the motion that is planned for them settles the name.

The arm is accepted on a good motion, and then something is hidden in it, as in ``benchmarks/naming.py``. The
first motion after that is a poor one on purpose: slow and short, so that many searches end with a set that
their data cannot tell apart. For each of those the program's own code plans the discriminating
motion, the arm is simulated over it, and the search runs again with both recordings; where it is still
ambiguous once more, as ``armhil diagnose --live`` does (two rounds).

    python benchmarks/naming_settled.py --scenarios 60 --seed 830000 --out naming_settled.jsonl
    python benchmarks/naming_settled.py --report naming_settled.jsonl
"""

from __future__ import annotations

import argparse
import json
import time
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import robots
from benchmarks import naming, naming_report, naming_scores
from benchmarks.naming_report import share
from daq.diagnosis.apart import PlanSettings, TellingApart
from daq.diagnosis.telling_apart import tell_apart
from drivers.errors import DriveError
from drivers.simulated import PlantTruth, draw_truth
from drivers.simulated.drawing import draw_scenario
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import Scenario
from ident import BaseParameters, Recording
from ident.discrepancy import Diagnosis, Prior, Question
from ident.discrepancy.by_evidence import diagnose_with_evidence, prior_by_evidence
from ident.effects.vocabulary import VOCABULARY
from robots import Robot
from robots.arrays import FloatArray
from trajectories import Trajectory, plan

SIZE = 0.8
"""Gap of the hidden effect on the poor motion, in noise floors: small, so that little tells names apart."""
EFFECTS = {
    "tx40": ("contact", "gravity_spring", "time_delay", "cable_spring"),
    "emps": ("contact", "cable_spring", "contact", "hysteresis"),
}
"""What is hidden: effects that others resemble on a poor motion."""
ROUNDS = 2
POOR = {
    "tx40": {"duration": 4.0, "evaluations": 15, "speed": 0.6},
    "emps": {"duration": 2.5, "evaluations": 30, "speed": 0.5},
}
"""The first motion: the best of few trials, short and slow."""
GOOD = {
    "tx40": {"duration": 12.0, "evaluations": 1500, "speed": 1.0},
    "emps": {"duration": 6.0, "evaluations": 300, "speed": 1.0},
}
"""The motion that the arm was accepted on."""
SETTINGS = PlanSettings()


def main() -> None:
    """Run what is asked for, or report what was run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--scenarios", type=int, default=60)
    parser.add_argument("--arms", nargs="+", default=list(EFFECTS), choices=list(EFFECTS))
    parser.add_argument("--seed", type=int, default=4000, help="of the first scenario")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin no scenario after so long")
    parser.add_argument("--out", type=Path, default=Path("naming_settled.jsonl"))
    parser.add_argument("--report", type=Path, help="only report these results")
    given = parser.parse_args()
    if given.report is None:
        campaign(tasks(given.scenarios, given.seed, given.arms), given.out, time.monotonic() + given.seconds)
    print(report(naming_report.lines_of(given.report or given.out)))


def tasks(scenarios: int, seed: int, arms: Sequence[str]) -> list[tuple[str, str, int]]:
    """Arm, effect and seed of each scenario; arms and their effects take turns."""
    turns = [arms[k % len(arms)] for k in range(scenarios)]
    return [
        (arm, EFFECTS[arm][(k // len(arms)) % len(EFFECTS[arm])], seed + k) for k, arm in enumerate(turns)
    ]


def campaign(wanted: Sequence[tuple[str, str, int]], out: Path, until: float) -> None:
    """Run what the file does not hold yet, and append it."""
    done = {line["seed"] for line in naming_report.lines_of(out)}
    for arm, effect, seed in wanted:
        if seed in done:
            continue
        if time.monotonic() > until:
            break
        with out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(one_run(arm, effect, seed)) + "\n")


@cache
def motion(arm: str, seed: int, poor: bool) -> FloatArray:
    """One period, (N, n)."""
    robot = robots.load(arm)
    how = (POOR if poor else GOOD)[arm]
    planned = plan(
        robot,
        cycle_time=robot.bus.cycle_time,
        duration=how["duration"],
        seed=seed,
        evaluations=int(how["evaluations"]),
        periods=naming.PERIODS,
        speed=how["speed"],
    )
    return np.asarray(planned.position[: len(planned.position) // naming.PERIODS])


def one_run(name: str, effect: str, seed: int) -> dict[str, Any]:
    """Draw, simulate, search; where that is ambiguous move and search again; only then compare."""
    robot = robots.load(name)
    truth = draw_truth(robot, seed)
    line: dict[str, Any] = {"kind": "single", "arm": name, "effect": effect, "seed": seed}
    started = time.process_time()
    try:
        drawn = draw_scenario(robot, effect, seed, SIZE, truth=truth, reference=motion(name, 0, True))
    except DriveError as error:
        return line | {"skipped": str(error)}
    arm = Arm(robot, truth, drawn.scenario)
    accepted = naming.record(robot, truth, Scenario(), motion(name, 0, False), seed + 1)
    fit = naming.record(robot, truth, drawn.scenario, motion(name, 0, True), seed + 2)
    validation = naming.record(robot, truth, drawn.scenario, motion(name, 1, True), seed + 3)
    line |= {"axes": list(drawn.axes), "ratio": drawn.ratio, "scenario": drawn.scenario.as_dict()}
    rounds = settle(arm, accepted, (fit,), (validation,), seed + 4)
    return line | {"rounds": rounds, "processor_seconds": time.process_time() - started}


@dataclass(frozen=True)
class Arm:
    """The simulated arm with what is hidden in it; it only answers motions with recordings."""

    robot: Robot
    truth: PlantTruth
    scenario: Scenario

    def record(self, trajectory: Trajectory, seed: int) -> Recording:
        """What a master would have recorded of a planned motion."""
        run = simulate_offline(self.robot, self.truth, trajectory.position, scenario=self.scenario, seed=seed)
        return Recording("tell apart", run.time, run.reference, run.position, run.control_signal)


def settle(
    arm: Arm,
    accepted: Recording,
    fit: tuple[Recording, ...],
    validation: tuple[Recording, ...],
    seed: int,
) -> list[dict[str, Any]]:
    """Search, and while that is ambiguous move as the program says and search again; one entry a search."""

    def prior(base: BaseParameters) -> Prior:
        return prior_by_evidence(base, (accepted,))

    rounds: list[dict[str, Any]] = []
    while True:
        found, _ = diagnose_with_evidence(
            Question(arm.robot, fit, validation, VOCABULARY, prior), sizes=False
        )
        rounds.append(naming.summary(found))
        if found.verdict != "ambiguous" or len(rounds) > ROUNDS:
            return rounds
        parts, words = planned_for(arm.robot, found)
        rounds[-1]["planned"] = words
        if not parts:
            return rounds
        seeds = (seed + len(rounds), seed + ROUNDS + 1 + len(rounds))
        fitted, judging = (arm.record(one, own) for one, own in zip(parts, seeds, strict=True))
        fit, validation = (*fit, *validation, fitted), (judging,)


def planned_for(robot: Robot, found: Diagnosis) -> tuple[tuple[Trajectory, ...], dict[str, Any]]:
    """Parts of the motion for the first ambiguous finding that has one, and what is said of its pairs."""
    apart = tell_apart(robot, found, SETTINGS)
    item = next((item for item in apart if item.parts), None)
    return (() if item is None else item.trajectories), {
        "correlations": [] if item is None else _correlations(item),
        "not_by_motion": [
            [pair.first, pair.second, pair.settled_by] for one in apart for pair in one.unsettled
        ],
    }


def _correlations(item: TellingApart) -> list[list[Any]]:
    return [[new.first, new.second, old.correlation, new.correlation] for old, new in item.pairs]


def was_ambiguous(line: dict[str, Any]) -> bool:
    """The first search ended with a set."""
    return bool(line["rounds"][0]["verdict"] == "ambiguous")


def truth_in_set(line: dict[str, Any]) -> bool:
    """The first search's set holds the truth."""
    return naming_scores.in_set(line | line["rounds"][0])


def resolved(line: dict[str, Any], rounds: int = ROUNDS) -> bool:
    """After so many motions the truth is named, alone."""
    last = line["rounds"][: rounds + 1][-1]
    return last["verdict"] == "named" and naming_scores.right_first(line | last)


def wrongly(line: dict[str, Any]) -> bool:
    """At the end the truth is neither named nor in the set."""
    return not naming_scores.in_set(line | line["rounds"][-1])


def said(line: dict[str, Any]) -> bool:
    """Where it stays ambiguous, the program says of a pair what settles it without motion."""
    return any(found.get("planned", {}).get("not_by_motion") for found in line["rounds"])


def report(lines: Sequence[dict[str, Any]]) -> str:
    """Figures with intervals, and per effect."""
    whole = [line for line in lines if "skipped" not in line]
    first = [line for line in whole if was_ambiguous(line)]
    held = [line for line in first if truth_in_set(line)]
    left = [line for line in held if not resolved(line)]
    per_arm = [
        f"| the same, {arm} | {share(resolved(line) for line in held if line['arm'] == arm)} |"
        for arm in EFFECTS
    ]
    sizes: list[float] = [1 + len(line["rounds"][0]["findings"][0]["set"]) for line in held]
    text = [
        "| figure | value |",
        "|---|---|",
        f"| searches that end with a set on the poor motion | {share(map(was_ambiguous, whole))} |",
        f"| mean size of those sets | {np.mean(sizes or [np.nan]):.2f} |",
        f"| the truth in the set | {share(map(truth_in_set, first))} |",
        f"| **sets that hold the truth, settled to the truth alone** | {share(map(resolved, held))} |",
        *per_arm,
        f"| the same after one motion | {share(resolved(line, 1) for line in held)} |",
        f"| of all sets, settled to the truth alone | {share(map(resolved, first))} |",
        f"| at the end the truth neither named nor in the set | {share(map(wrongly, held))} |",
        f"| not settled, and told what settles it without motion | {share(map(said, left))} |",
        "",
        "| hidden | sets | settled to it | otherwise |",
        "|---|---|---|---|",
    ]
    groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for line in held:
        groups[f"{line['effect']}, {line['arm']}"].append(line)
    for effect, rows in sorted(groups.items()):
        others = "; ".join(_ended(line) for line in rows if not resolved(line))
        text.append(f"| {effect} | {len(rows)} | {sum(map(resolved, rows))} | {others} |")
    return "\n".join(text) + "\n"


def _ended(line: dict[str, Any]) -> str:
    """How a search ended that did not name the truth alone."""
    last = line["rounds"][-1]
    names = [
        "+".join([finding["effect"], *("/".join(effects) for effects, _ in finding["set"])])
        for finding in last["findings"]
    ]
    return f"{last['verdict']}: {', '.join(names) or '–'}"


if __name__ == "__main__":
    main()
