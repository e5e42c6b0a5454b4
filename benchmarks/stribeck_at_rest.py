"""Stribeck friction at rest: does the printed deviation hold the size, where both forms of its fall fit?

The rig with Stribeck friction of either form, a rise of 0.2 to 0.6 of the dry friction and a speed of 1 to 8
% of the limit, another arm for each seed; two periods of 5 s against an accepted model, the search with
that effect alone. Beside the printed deviation stands the one of a form that is taken for certain.

    python -m benchmarks.stribeck_at_rest --seed 86400 --scenarios 60 --out stribeck.jsonl
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

import robots
from benchmarks.naming_report import lines_of, share
from drivers.simulated import draw_truth
from ident.discrepancy import refine
from ident.discrepancy.refined import Refined
from ident.effects.vocabulary import family_named
from tests.ident.discrepancy.blind_search import search

ARM, DURATION = "emps", 5.0
NAME = "stribeck_friction"
INSIDE = 1.959963984540054


def one_run(seed: int) -> dict[str, Any]:
    """Hidden and found: size at rest with both deviations, speed and exponent."""
    robot, random = robots.load(ARM), np.random.default_rng(seed)
    exponent = float(random.choice((1.0, 2.0)))
    speed = float(robot.velocity_limits[0] * np.exp(random.uniform(*np.log((0.01, 0.08)))))
    rise = float(random.uniform(0.2, 0.6))
    hidden = {"drive": 1, "rise": rise, "speed": speed, "exponent": exponent}
    before: list[Refined] = []

    def kept(*given: Any) -> Refined:
        before.append(certain(*given))
        return before[-1]

    certain = refine.with_deviations
    with patch.object(refine, "with_deviations", kept):
        found = search(
            ARM,
            seed,
            {NAME: [hidden]},
            duration=DURATION,
            vocabulary=(family_named(NAME),),
            at_reversals=False,
        )
    line: dict[str, Any] = {"seed": seed, "exponent": exponent, "speed": speed}
    line["size"] = rise * draw_truth(robot, seed).parameters["Fc1"]
    if found.findings:
        values = {one.name: (one.value, one.sigma) for one in found.findings[0].parameters}
        one_form = float(before[-1].linear_sigma[0][0])
        line["found"] = {"size": values["Fs1"], "one_form": one_form, "exponent": values["exponent"][0]}
        line["found"]["speed"] = values["stribeck_speed"]
    return line


def report(lines: list[dict[str, Any]]) -> str:
    """Shares inside, by whether the form was found."""
    found = [line for line in lines if "found" in line]
    right = [line for line in found if line["found"]["exponent"] == line["exponent"]]
    wrong = [line for line in found if line not in right]
    text = [
        f"{len(lines)} scenarios, {len(found)} found",
        "",
        "| form | size at rest inside 95 % | were the form certain | rms of z | form certain |",
        "|---|---|---|---|---|",
    ]
    for words, some in (("right", right), ("the other one", wrong), ("all", found)):
        off = np.array([line["found"]["size"][0] - line["size"] for line in some])
        printed = off / np.array([line["found"]["size"][1] for line in some])
        certain = off / np.array([line["found"]["one_form"] for line in some])
        cells = [share(bool(abs(one) < INSIDE) for one in z) for z in (printed, certain)]
        cells += [f"{np.sqrt(np.mean(z**2)):.2f}" if z.size else "–" for z in (printed, certain)]
        text.append(f"| {words} | {' | '.join(cells)} |")
    return "\n".join(text) + "\n"


def main() -> None:
    """Run scenarios, keep them, and report."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=600)
    parser.add_argument("--scenarios", type=int, default=16)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin none after so long")
    parser.add_argument("--out", type=Path, default=Path("stribeck.jsonl"))
    given = parser.parse_args()
    until, done = time.monotonic() + given.seconds, {line["seed"] for line in lines_of(given.out)}
    for seed in range(given.seed, given.seed + given.scenarios):
        if time.monotonic() > until:
            break
        if seed not in done:
            line = one_run(seed)
            with given.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
    print(report(lines_of(given.out)))


if __name__ == "__main__":
    main()
