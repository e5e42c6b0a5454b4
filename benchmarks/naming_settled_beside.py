"""Ambiguous sets before a planned motion, a random one and a D-optimal one of equal time: which settles them?

The arm is accepted on a good motion, something is hidden in it, and a poor motion follows
(``naming_settled.py``). Where the diagnosis ends with a set of names the program plans its motion, in two
parts of six seconds twice, one to fit and one to validate; the arm is simulated over these, over two random
motions, and over two whose information has the largest determinant. Each time the whole vocabulary is asked
again with the poor recordings and the new ones: after the planned motion as ``armhil diagnose`` does, after
the others by the rows' evidence alone, by which all three are compared. Limits are checked by differences of
the set-points.

    python -m benchmarks.naming_settled_beside --first 86500 --scenarios 250 --out settled.jsonl --seconds 540
    python -m benchmarks.naming_settled_beside --report settled.jsonl
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import robots
from benchmarks import naming
from benchmarks.naming_report import lines_of, share
from benchmarks.naming_settled import SETTINGS, Arm, motion
from daq.diagnosis.apart import TellingApart
from daq.diagnosis.telling_apart import tell_apart
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
RANDOM = 10_000_000
"""Between the seeds of the two parts of a random motion."""
LIMITS = 1.001
"""Of a limit; set-points are rounded to increments of the drives."""


def main() -> None:
    """Run what is asked for, or report what was run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--first", type=int, default=500, help="seed of the first scenario")
    parser.add_argument("--scenarios", type=int, default=16)
    parser.add_argument("--effects", nargs="+", default=list(EFFECTS), help="hidden in turn")
    parser.add_argument("--every", type=int, default=1, help="turns from one with all motions to the next")
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
            turn, place = divmod(number, len(given.effects))
            line = one_run(given.effects[place], seed, turn % given.every == 0)
            with given.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
    print(report(lines_of(given.report or given.out)))


def one_run(effect: str, seed: int, beside: bool = True) -> dict[str, Any]:
    """Draw, simulate, search; where that is ambiguous, and a motion is offered, move and search again.

    Args:
        effect: to hide.
        seed: of the scenario.
        beside: whether the other two motions are driven, too.
    """
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

    def question(*more: Recording) -> Question:
        def prior(base: Any) -> Any:
            return prior_by_evidence(base, (accepted,))

        fitted, held = ((fit, validation, *more[:1]), more[1:]) if more else ((fit,), (validation,))
        return Question(robot, fitted, held, VOCABULARY, prior)

    found, answer = diagnose_with_evidence(question(), sizes=False)
    line |= {"first": answered(answer), "verdict": found.verdict}
    if found.verdict == "ambiguous":
        together = [(one, *one.indistinguishable_from) for one in found.findings]
        line["set"] = [[[one.effect, list(one.joints)] for one in names] for names in together]
        apart = tell_apart(robot, found, SETTINGS)
        line |= said(apart, found)
        planned = next((one.trajectories for one in apart if one.parts), None)
        motions = {} if planned is None else {"planned": planned, **(others(seed) if beside else {})}
        arm = Arm(robot, truth, drawn.scenario)
        for number, (way, parts) in enumerate(motions.items()):
            seeds = (seed + 4 + 2 * number, seed + 5 + 2 * number)
            more = [arm.record(one, own) for one, own in zip(parts, seeds, strict=True)]
            line[way] = ask(question(*more), whole=way == "planned")
            line[way]["beyond"] = [beyond for one in parts for beyond in beyond_limits(robot, one)]
    return line | {"processor_seconds": round(time.process_time() - started, 1)}


def ask(question: Question, whole: bool) -> dict[str, Any]:
    """The rows' evidence; with the whole diagnosis its verdict and findings, too."""
    try:
        if not whole:
            return answered(diagnose_by_evidence(question, simulated=False))
        found, answer = diagnose_with_evidence(question, sizes=False)
        findings = [[one.effect, list(one.joints), one.probability] for one in found.findings]
        reasons = [one.confirmation.reason for one in found.findings]
        return answered(answer) | {"whole": found.verdict, "findings": findings, "reasons": reasons}
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
        for _, pair in one.pairs
    ]
    unsettled = [[pair.first, pair.second, pair.settled_by] for one in apart for pair in one.unsettled]
    return {"pairs": pairs, "not_by_motion": unsettled, "not_planned": [one.not_planned for one in apart]}


def _poor(robot: Robot, seed: int) -> FloatArray:
    """Short and slow."""
    home = np.array(robot.home)
    return np.asarray(home + SWING * (motion(ARM, seed, True) - home))


@cache
def _d_optimal() -> tuple[Trajectory, Trajectory]:
    return _plan(SETTINGS.seed, SETTINGS.evaluations), _plan(SETTINGS.seed + 1, SETTINGS.evaluations)


def others(seed: int) -> dict[str, tuple[Trajectory, Trajectory]]:
    """Random motions, others for each seed, and D-optimal ones of as many trials as the planned."""
    return {"random": (_plan(seed, 1), _plan(seed + RANDOM, 1)), "D-optimal": _d_optimal()}


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


def told(line: dict[str, Any]) -> bool:
    """The truth is in the set that the whole diagnosis leaves open; of older lines, in that of the rows."""
    return holds(line, {"names": line["set"]} if "set" in line else line["first"])


def first(line: dict[str, Any], answer: dict[str, Any]) -> bool:
    """The truth is the likeliest name of a finding, however sure."""
    wanted = [line["effect"], line["axes"]]
    return any(names[0][:2] == wanted for names in answer["names"] if names)


def settled(line: dict[str, Any], answer: dict[str, Any]) -> bool:
    """The truth is named, alone, and first."""
    names = answer["names"]
    alone = bool(names) and names[0][0][:2] == [line["effect"], line["axes"]] and names[0][0][2] >= 0.9
    return alone and answer["verdict"] == "named"


def settled_whole(line: dict[str, Any], answer: dict[str, Any]) -> bool:
    """``armhil diagnose`` says ``named``, and the truth is its one finding."""
    found = [one[:2] for one in answer.get("findings", [])]
    return answer.get("whole") == "named" and found == [[line["effect"], line["axes"]]]


def wrong(line: dict[str, Any], answer: dict[str, Any]) -> bool:
    """Another name is given for the hidden effect, and the truth is in no set."""
    return answer["verdict"] == "named" and not holds(line, answer)


def report(lines: Sequence[dict[str, Any]]) -> str:
    """Figures with intervals, then per effect."""
    sets = [line for line in lines if line.get("verdict") == "ambiguous"]
    held = [line for line in sets if told(line)]
    offered = [line for line in sets if "planned" in line]
    both = [line for line in offered if told(line)]
    text = [
        f"{len(lines)} scenarios, {len(sets)} sets, {len(held)} hold the truth; a motion offered for"
        f" {len(offered)}, of those that hold it {len(both)}",
        "",
        "| motion of 24 s | settled to the truth alone, of sets that hold it | of all sets |"
        " truth first, of those that hold it | truth in the set still | wrong name | beyond a limit |",
        "|---|---|---|---|---|---|---|",
    ]
    for way in WAYS:
        own, held_too = ([line for line in part if way in line] for part in (offered, both))
        cells = [
            share(settled(line, line[way]) for line in held_too),
            share(settled(line, line[way]) for line in own),
            share(first(line, line[way]) for line in held_too),
            share(holds(line, line[way]) for line in held_too),
            share(wrong(line, line[way]) for line in own),
            f"{sum(bool(line[way]['beyond']) for line in own)} of {len(own)}",
        ]
        text.append(f"| {way} | {' | '.join(cells)} |")
    text += [
        "",
        f"Planned, by the whole diagnosis: {share(settled_whole(line, line['planned']) for line in both)};"
        f" of all that are offered {share(settled_whole(line, line['planned']) for line in offered)}.",
        "",
    ]
    text += [
        "| hidden | sets | hold it | settled: planned | random | D-optimal | otherwise |",
        "|" + "---|" * 7,
    ]
    for effect in dict.fromkeys(line["effect"] for line in sets):
        own = [line for line in both if line["effect"] == effect]
        counts = [_count(settled(line, line[way]) for line in own if way in line) for way in WAYS]
        ended = Counter(_ended(line["planned"]) for line in own if not settled(line, line["planned"]))
        words = "; ".join(f"{words} ({count})" for words, count in ended.items())
        all_sets = sum(line["effect"] == effect for line in sets)
        text.append(f"| {effect} | {all_sets} | {len(own)} | {' | '.join(counts)} | {words} |")
    return "\n".join(text) + "\n"


def _count(found: Iterable[bool]) -> str:
    values = list(found)
    return f"{sum(values)} of {len(values)}"


def _ended(answer: dict[str, Any]) -> str:
    names = ["/".join(one[0] for one in names) for names in answer["names"]]
    return f"{answer['verdict']}: {', '.join(names) or '–'}"


if __name__ == "__main__":
    main()
