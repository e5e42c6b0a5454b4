"""Ambiguous sets before a planned motion, a random one and a D-optimal one of equal time: which settles them?

The arm is accepted on a good motion, something is hidden in it, and a poor motion follows
(``naming_settled.py``). Where the diagnosis ends with a set of names the program plans its motion; the arm is
simulated over that one, over one random motion and over the one whose information has the largest
determinant, each twelve seconds twice, and the rows' evidence is asked again, each time with the poor
recording and the new one, which of the set's names it is, or nothing. Limits are checked by differences of
the set-points.

    python -m benchmarks.naming_settled_beside --first 86500 --scenarios 250 --out settled.jsonl --seconds 540
    python -m benchmarks.naming_settled_beside --report settled.jsonl
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Collection, Sequence
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

import robots
from benchmarks import naming
from benchmarks.naming_report import lines_of, share
from benchmarks.naming_settled import SETTINGS, Arm, motion
from daq.diagnosis.telling_apart import TOLD_APART, TellingApart, tell_apart
from drivers.errors import DriveError
from drivers.simulated import draw_truth
from drivers.simulated.drawing import draw_scenario
from drivers.simulated.scenario import Scenario
from ident import IdentificationError, Recording
from ident.discrepancy import Diagnosis, Question
from ident.discrepancy.by_evidence import EvidenceAnswer, diagnose_with_evidence, prior_by_evidence
from ident.discrepancy.by_evidence.workflow import diagnose_by_evidence
from ident.effects.vocabulary import VOCABULARY
from robots import Robot
from robots.arrays import FloatArray
from trajectories import Trajectory, plan

ARM = "emps"
EFFECTS = (
    "contact",
    "cable_spring",
    "hysteresis",
    "stribeck_friction",
    "nonlinear_viscous_friction",
    "position_dependent_friction",
    "asymmetric_friction",
    "viscous_friction",
)
"""What is hidden in turn: on a poor motion each resembles another."""
SIZE = 1.0
"""Gap of the hidden effect on the poor motion, in noise floors: small, so that little tells names apart."""
SWING = 0.35
"""Of the poor motion's way from home: on a short one springs of all forms differ little, and frictions."""
WAYS = ("planned", "random", "D-optimal")
LIMITS = 1.001
"""Of a limit; set-points are rounded to increments of the drives."""


def main() -> None:
    """Run what is asked for, or report what was run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--first", type=int, default=500, help="seed of the first scenario")
    parser.add_argument("--scenarios", type=int, default=16)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin no scenario after so long")
    parser.add_argument("--out", type=Path, default=Path("settled.jsonl"))
    parser.add_argument("--report", type=Path, help="only report these results")
    given = parser.parse_args()
    if given.report is None:
        done, until = {line["seed"] for line in lines_of(given.out)}, time.monotonic() + given.seconds
        for number in range(given.scenarios):
            seed = given.first + number
            if seed in done:
                continue
            if time.monotonic() > until:
                break
            line = one_run(EFFECTS[number % len(EFFECTS)], seed)
            with given.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
    print(report(lines_of(given.report or given.out)))


def one_run(effect: str, seed: int) -> dict[str, Any]:
    """Draw, simulate, search; where that is ambiguous move in three ways and search again."""
    robot, started = robots.load(ARM), time.process_time()
    truth = draw_truth(robot, seed)
    line: dict[str, Any] = {"effect": effect, "seed": seed}
    (poor, other), good = (_poor(robot, k) for k in (0, 1)), motion(ARM, 0, False)
    try:
        drawn = draw_scenario(robot, effect, seed, SIZE, truth=truth, reference=poor)
    except DriveError as error:
        return line | {"skipped": str(error)}
    accepted = naming.record(robot, truth, Scenario(), good, seed + 1)
    fit = naming.record(robot, truth, drawn.scenario, poor, seed + 2)
    validation = naming.record(robot, truth, drawn.scenario, other, seed + 3)
    line["axes"] = list(drawn.axes)

    def question(recordings: tuple[Recording, ...], names: Collection[str] | None = None) -> Question:
        def prior(base: Any) -> Any:
            return prior_by_evidence(base, (accepted,))

        families = tuple(one for one in VOCABULARY if names is None or one.name in names)
        return Question(robot, recordings, (validation,), families, prior)

    first = diagnose_by_evidence(question((fit,)), simulated=False)
    line["first"] = answered(first)
    if first.findings and not any(one.sure for one in first.findings):
        found, _ = diagnose_with_evidence(question((fit,)))
        line["verdict"] = found.verdict
        if found.verdict == "ambiguous":
            # Every motion is driven, offered or not, to see what would come of those that are not.
            with patch("daq.diagnosis.telling_apart.TOLD_APART", 1.0):
                apart = tell_apart(robot, found, SETTINGS)
            line |= said(apart, found)
            named = {name[0] for names in line["first"]["names"] for name in names}
            arm = Arm(robot, truth, drawn.scenario)
            motions = {
                "planned": next((one.trajectory for one in apart if one.trajectory), None),
                **others(seed),
            }
            if motions["planned"] is not None:
                for number, (way, trajectory) in enumerate(motions.items()):
                    assert trajectory is not None
                    more = arm.record(trajectory, seed + 4 + number)
                    line[way] = ask(question((fit, more), named))
                    line[way]["beyond"] = beyond_limits(robot, trajectory)
    return line | {"processor_seconds": round(time.process_time() - started, 1)}


def ask(question: Question) -> dict[str, Any]:
    """The rows' evidence."""
    try:
        return answered(diagnose_by_evidence(question, simulated=False))
    except IdentificationError as error:
        return {"verdict": "refused", "names": [], "reason": str(error)}


def answered(answer: EvidenceAnswer) -> dict[str, Any]:
    """Verdict, and per finding the names that hold 95 %, with joints from 1."""
    sets = [
        [[one.name, [j + 1 for j in one.joints], round(one.probability, 4)] for one in finding.set]
        for finding in answer.findings
    ]
    return {"verdict": answer.verdict, "names": sets}


def said(apart: Sequence[TellingApart], found: Diagnosis) -> dict[str, Any]:
    """How the names correlate on the motion, the first one's sizes in deviations; what is asked."""
    sizes = [[one.value for one in finding.parameters if not one.shape] for finding in found.findings]
    pairs = [
        [
            pair.first,
            pair.second,
            round(pair.correlation, 4),
            [round(v / s, 2) for v, s in zip(sizes[one.number - 1], pair.first_sigma, strict=False)],
        ]
        for one in apart
        if one.discrimination is not None
        for pair in one.discrimination.separation_after
    ]
    unsettled = [[pair.first, pair.second, pair.settled_by] for one in apart for pair in one.unsettled]
    return {"pairs": pairs, "not_by_motion": unsettled, "not_planned": [one.not_planned for one in apart]}


def _poor(robot: Robot, seed: int) -> FloatArray:
    """Short and slow."""
    home = np.array(robot.home)
    return np.asarray(home + SWING * (motion(ARM, seed, True) - home))


@cache
def _d_optimal() -> Trajectory:
    return _plan(SETTINGS.seed, SETTINGS.evaluations)


def others(seed: int) -> dict[str, Trajectory]:
    """A random motion, another for each seed, and the D-optimal one of as many trials as the planned."""
    return {"random": _plan(seed, 1), "D-optimal": _d_optimal()}


def _plan(seed: int, evaluations: int) -> Trajectory:
    robot = robots.load(ARM)
    return plan(
        robot,
        cycle_time=robot.bus.cycle_time,
        duration=SETTINGS.duration,
        periods=SETTINGS.periods,
        seed=seed,
        evaluations=evaluations,
    )


def beyond_limits(robot: Robot, trajectory: Trajectory) -> list[str]:
    """Limits of position, speed and acceleration that differences of the set-points exceed."""
    position, step = np.asarray(trajectory.position), robot.bus.cycle_time
    room = (LIMITS - 1.0) * (robot.upper - robot.lower)
    speed: FloatArray = np.diff(position, axis=0) / step
    found = []
    if (position > robot.upper + room).any() or (position < robot.lower - room).any():
        found.append("position")
    if (np.abs(speed).max(axis=0) > LIMITS * robot.velocity_limits).any():
        found.append("speed")
    if (np.abs(np.diff(speed, axis=0)).max(axis=0) / step > LIMITS * robot.acceleration_limits).any():
        found.append("acceleration")
    return found


def holds(line: dict[str, Any], answer: dict[str, Any]) -> bool:
    """The truth is in the set of a finding."""
    wanted = [line["effect"], line["axes"]]
    return any(one[:2] == wanted for names in answer["names"] for one in names)


def is_offered(line: dict[str, Any]) -> bool:
    """The program tells the user to drive the planned motion: it tells some pair apart."""
    return any(pair[2] <= TOLD_APART for pair in line["pairs"])


def first(line: dict[str, Any], answer: dict[str, Any]) -> bool:
    """The truth is the likeliest name of a finding, however sure."""
    wanted = [line["effect"], line["axes"]]
    return any(names[0][:2] == wanted for names in answer["names"] if names)


def settled(line: dict[str, Any], answer: dict[str, Any]) -> bool:
    """The truth is named, alone, and first."""
    names = answer["names"]
    alone = bool(names) and names[0][0][:2] == [line["effect"], line["axes"]] and names[0][0][2] >= 0.9
    return alone and answer["verdict"] == "named"


def wrong(line: dict[str, Any], answer: dict[str, Any]) -> bool:
    """Another name is given for the hidden effect, and the truth is in no set."""
    return answer["verdict"] == "named" and not holds(line, answer)


def report(lines: Sequence[dict[str, Any]]) -> str:
    """Figures with intervals, then per effect."""
    sets = [line for line in lines if line.get("verdict") == "ambiguous"]
    held = [line for line in sets if holds(line, line["first"])]
    driven = [line for line in sets if "planned" in line]
    offered = [line for line in driven if is_offered(line)]
    both = [line for line in offered if holds(line, line["first"])]
    rest = [line for line in driven if not is_offered(line) and holds(line, line["first"])]
    text = [
        f"{len(lines)} scenarios, {len(sets)} sets, {len(held)} hold the truth; a motion offered for"
        f" {len(offered)}, of those that hold it {len(both)}; driven all the same for"
        f" {len(driven) - len(offered)}, of those that hold it {len(rest)}",
        "",
        "| motion of 24 s | offered: settled to the truth alone, of sets that hold it | of all sets |"
        " truth first, of those that hold it | truth in the set still | wrong name |"
        " not offered: settled, of those that hold it | beyond a limit |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for way in WAYS:
        cells = [
            share(settled(line, line[way]) for line in both),
            share(settled(line, line[way]) for line in offered),
            share(first(line, line[way]) for line in both),
            share(holds(line, line[way]) for line in both),
            share(wrong(line, line[way]) for line in offered),
            share(settled(line, line[way]) for line in rest),
            str(sum(bool(line[way]["beyond"]) for line in driven)),
        ]
        text.append(f"| {way} | {' | '.join(cells)} |")
    text += ["", f"Offered sets that hold the truth and no motion settles: {_by_none(both)}.", ""]
    text += [
        "| hidden | sets | hold it | settled: planned | random | D-optimal | otherwise |",
        "|" + "---|" * 7,
    ]
    for effect in dict.fromkeys(line["effect"] for line in sets):
        own = [line for line in both if line["effect"] == effect]
        counts = [str(sum(settled(line, line[way]) for line in own)) for way in WAYS]
        ended = Counter(_ended(line["planned"]) for line in own if not settled(line, line["planned"]))
        words = "; ".join(f"{words} ({count})" for words, count in ended.items())
        all_sets = sum(line["effect"] == effect for line in sets)
        text.append(f"| {effect} | {all_sets} | {len(own)} | {' | '.join(counts)} | {words} |")
    return "\n".join(text) + "\n"


def _by_none(lines: Sequence[dict[str, Any]]) -> str:
    """How many sets none of the motions settles."""
    return f"{sum(not any(settled(line, line[way]) for way in WAYS) for line in lines)} of {len(lines)}"


def _ended(answer: dict[str, Any]) -> str:
    names = ["/".join(one[0] for one in names) for names in answer["names"]]
    return f"{answer['verdict']}: {', '.join(names) or '–'}"


if __name__ == "__main__":
    main()
