"""Every effect of the vocabulary as one that has no name: joint, variables and gap of the terms in its place.

Shoulder and elbow of the shipped arm on the own bench, or all its six axes (``--six``); other masses and
friction for each seed. An effect is drawn at a
joint, so large that its gap is eight noise floors, and a term is asked for as where a diagnosis without that
effect says ``unnamed``: no name is tried, at each joint whose misfit is above the accepted one.

    python -m benchmarks.terms_left_out --seed 600 --rounds 1 --out left-out.jsonl --seconds 540
    python -m benchmarks.terms_left_out --report left-out.jsonl
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import robots
from benchmarks import naming
from benchmarks.naming_report import NAMES, lines_of, share
from benchmarks.shoulder_and_elbow import shoulder_and_elbow
from drivers.errors import DriveError
from drivers.simulated import draw_truth
from drivers.simulated.drawing import draw_scenario, exercise
from drivers.simulated.scenario import Scenario
from ident import IdentificationError
from ident.discrepancy import Question
from ident.discrepancy.by_evidence import prior_by_evidence
from ident.discrepancy.by_evidence.terms.asked import proposed_terms
from ident.effects.vocabulary import VOCABULARY
from robots import Robot
from robots.arrays import FloatArray

PERIOD, SIZE = 8.0, 8.0
"""s of a period, two of which are recorded; and gap of the effect in noise floors."""
LEFT = 0.3
"""Share of the gap that may be left on the other motion."""

VARIABLES: dict[str, tuple[frozenset[str], ...]] = {
    "viscous_friction": (frozenset("v"),),
    "coulomb_friction": (frozenset("v"),),
    "asymmetric_friction": (frozenset("v"), frozenset()),
    "stribeck_friction": (frozenset("v"),),
    "nonlinear_viscous_friction": (frozenset("v"),),
    "load_dependent_friction": (frozenset({"v", "load"}),),
    "load_quadratic_friction": (frozenset({"v", "load"}),),
    "directional_efficiency": (frozenset({"v", "load"}), frozenset({"load"})),
    "drifting_friction": (frozenset("vt"),),
    "temperature_viscous_friction": (frozenset("vt"),),
    "position_dependent_friction": (frozenset("qv"),),
    "torque_ripple": (frozenset("q"),),
    "current_offset": (frozenset(),),
    "torque_constant_droop": (frozenset({"load"}),),
    "rotor_inertia": (frozenset("a"),),
    "gravity_spring": (frozenset("q"),),
    "cable_spring": (frozenset("q"),),
    "contact": (frozenset("q"),),
    "dress_pack_hysteresis": (frozenset("qv"), frozenset("q")),
    "hysteresis": (frozenset("v"), frozenset("qv")),
}
"""Variables of the effect's own joint that describe it; others are no product of the dictionary's."""


def arm(six: bool) -> Robot:
    """Of six axes, or two of them."""
    return robots.load("tx40" if six else str(shoulder_and_elbow(Path(tempfile.mkdtemp()))))


def one_run(robot: Robot, effect: str, seed: int) -> dict[str, Any]:
    """Draw, simulate, ask."""

    def path(motion: int) -> FloatArray:
        return exercise(robot, PERIOD, motion)

    started = time.process_time()
    truth, line = draw_truth(robot, seed), {"effect": effect, "seed": seed}
    try:
        drawn = draw_scenario(robot, effect, seed, SIZE, truth=truth, reference=path(0))
        quiet, hidden = Scenario(), drawn.scenario
        accepted = naming.record(robot, truth, quiet, path(2), seed + 1)
        fit, other = (naming.record(robot, truth, hidden, path(k), seed + 2 + k) for k in (0, 1))
        question = Question(
            robot, (fit,), (other,), VOCABULARY, lambda base: prior_by_evidence(base, (accepted,))
        )
        terms = [one.as_json() for one in proposed_terms(question)]
    except (DriveError, IdentificationError) as error:
        return line | {"skipped": str(error)}
    return line | {
        "axes": list(drawn.axes),
        "joints": sorted(joints_of(robot, drawn.axes)),
        "terms": terms,
        "processor_seconds": round(time.process_time() - started, 1),
    }


def joints_of(robot: Robot, axes: Iterable[int]) -> set[int]:
    """These, and those that their drives move too (from 1): a coupled wrist's torques fall on two."""
    return {
        *axes,
        *(int(joint) + 1 for axis in axes for joint in robot.transmission_matrix[axis - 1].nonzero()[0]),
    }


def right_joint(line: dict[str, Any]) -> bool:
    """The terms are at the joints that have it; of the whole arm any is."""
    places = {term["joint"] for term in line["terms"]}
    return bool(places) and (not line["axes"] or places <= set(line["joints"]))


def right_variables(line: dict[str, Any]) -> bool:
    """Those of the terms at its joint together are those of the effect."""
    found = {str(name).rstrip("0123456789") for term in line["terms"] for name in term["variables"]}
    return right_joint(line) and any(found == set(wanted) for wanted in VARIABLES[line["effect"]])


def closed(line: dict[str, Any]) -> bool:
    """At most 30 % of the gap is left on the other motion, at every joint that has a term."""
    gaps = [term["unexplained"] for term in line["terms"]]
    return bool(gaps) and all(one["after"] <= LEFT * one["before"] for one in gaps)


def report(lines: Sequence[dict[str, Any]]) -> str:
    """Figures with 95 % intervals, then effect by effect."""
    ran = [line for line in lines if "skipped" not in line]
    inside = [line for line in ran if line["effect"] in VARIABLES]
    beyond = [line for line in ran if line["effect"] not in VARIABLES]
    told = [line for line in inside if line["terms"]]
    text = [
        "| figure | a product of the dictionary describes it | none does |",
        "|---|---|---|",
        f"| a term | {share(bool(o['terms']) for o in inside)} | {share(bool(o['terms']) for o in beyond)} |",
        f"| its joint, of those told | {share(map(right_joint, told))} |"
        f" {share(right_joint(one) for one in beyond if one['terms'])} |",
        f"| its variables, of those told | {share(map(right_variables, told))} | – |",
        f"| at most 30 % of the gap left | {share(map(closed, inside))} | {share(map(closed, beyond))} |",
        "",
        "| left out | hidden | told | joint | variables | gap closed | as |",
        "|---|---|---|---|---|---|---|",
    ]
    for effect in dict.fromkeys(line["effect"] for line in ran):
        own = [line for line in ran if line["effect"] == effect]
        kinds = [right_variables(line) for line in own] if effect in VARIABLES else None
        formulas = dict.fromkeys(f"{term['formula']}" for line in own for term in line["terms"])
        cells = [
            str(len(own)),
            str(sum(bool(line["terms"]) for line in own)),
            str(sum(map(right_joint, own))),
            "–" if kinds is None else str(sum(kinds)),
            str(sum(map(closed, own))),
            "; ".join(formulas) or "–",
        ]
        text.append(f"| {effect} | {' | '.join(cells)} |")
    return "\n".join(text) + "\n"


def main() -> None:
    """Run scenarios, keep them, and report."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=600)
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--six", action="store_true", help="six axes")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin none after so long")
    parser.add_argument("--out", type=Path, default=Path("left-out.jsonl"))
    parser.add_argument("--report", type=Path, help="only report these results")
    given = parser.parse_args()
    robot = arm(given.six)
    naming.PERIODS = 2
    until, done = time.monotonic() + given.seconds, {line["seed"] for line in lines_of(given.out)}
    for number in range(given.rounds * len(NAMES) if given.report is None else 0):
        if time.monotonic() > until:
            break
        if given.seed + number not in done:
            line = one_run(robot, NAMES[number % len(NAMES)], given.seed + number)
            with given.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line, ensure_ascii=False) + "\n")
    print(report(lines_of(given.report or given.out)))


if __name__ == "__main__":
    main()
