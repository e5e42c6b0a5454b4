"""Terms for effects that no vocabulary holds: right variables, and the gap left on other motion.

One axis, another arm for each scenario. A torque of a family below, of which no plant knows, is put into
the recordings themselves; a term is asked for as where a diagnosis says ``unnamed``. Clean arms are asked in
turn, whatever their misfit: there no term is right.

    python -m benchmarks.terms --seed 1 --scenarios 22 --out terms.jsonl
    python -m benchmarks.terms --seed 1 --scenarios 300 --clean --out clean.jsonl
    python -m benchmarks.terms --report terms.jsonl
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

import robots
from benchmarks.naming_report import lines_of, share
from drivers.simulated.scenario import Scenario
from ident import Recording
from ident.discrepancy import Question
from ident.discrepancy.by_evidence import prior_by_evidence
from ident.discrepancy.by_evidence.terms.asked import proposed_terms
from ident.effects.vocabulary import VOCABULARY
from robots.arrays import FloatArray
from tests.ident.discrepancy.blind_search import recorded

ROBOT = robots.load("emps")
PERIOD = 5.0
SIZE = 0.15
"""rms of the hidden torque, as a share of the rms torque of the clean recording that is fitted."""

Law = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
FAMILIES: dict[str, tuple[set[str], Law]] = {
    "drag": ({"v1"}, lambda q, v, t: v * np.abs(v)),
    "cubic drag": ({"v1"}, lambda q, v, t: v**3),
    "root of the speed": ({"v1"}, lambda q, v, t: np.sign(v) * np.sqrt(np.abs(v))),
    "viscous along the travel": ({"q1", "v1"}, lambda q, v, t: v * q),
    "dry along the travel": ({"q1", "v1"}, lambda q, v, t: np.tanh(v / 1e-3) * q),
    "dry, square of the travel": ({"q1", "v1"}, lambda q, v, t: np.tanh(v / 1e-3) * q**2),
    "spring that hardens": ({"q1"}, lambda q, v, t: q**3),
    "exponential spring": ({"q1"}, lambda q, v, t: np.exp(8.0 * q)),
    "dry that grows": ({"t", "v1"}, lambda q, v, t: np.tanh(v / 1e-3) * t),
    "viscous that grows": ({"t", "v1"}, lambda q, v, t: v * t),
    "drag along the travel": ({"q1", "v1"}, lambda q, v, t: v * np.abs(v) * q),
    "spring that slackens": ({"q1", "t"}, lambda q, v, t: q * np.exp(-t / 4.0)),
}
"""Variables, and what it goes with; each without its mean."""
FURTHER: dict[str, tuple[set[str], Law]] = {
    "power of one and a half": ({"v1"}, lambda q, v, t: np.sign(v) * np.abs(v) ** 1.5),
    "drag that saturates": ({"v1"}, lambda q, v, t: np.arctan(8.0 * v)),
    "drag with a hump": ({"v1"}, lambda q, v, t: v * np.exp(-np.abs(v) / 0.1)),
    "dry, bell over the travel": (
        {"q1", "v1"},
        lambda q, v, t: np.tanh(v / 1e-3) * np.exp(-((q / 0.02) ** 2)),
    ),
    "dry, root of the travel": ({"q1", "v1"}, lambda q, v, t: np.tanh(v / 1e-3) * np.sqrt(np.abs(q))),
    "spring that saturates": ({"q1"}, lambda q, v, t: np.tanh(30.0 * q)),
    "fifth power of the travel": ({"q1"}, lambda q, v, t: q**5),
    "viscous, bell over the travel": ({"q1", "v1"}, lambda q, v, t: v * np.exp(-((q / 0.02) ** 2))),
    "dry, wave over the travel": ({"q1", "v1"}, lambda q, v, t: np.tanh(v / 1e-3) * np.sin(50.0 * q)),
    "viscous that settles": ({"t", "v1"}, lambda q, v, t: v * (1.0 - np.exp(-t / 3.0))),
}
"""The same, of which the dictionary has none."""
ALL = FAMILIES | FURTHER


def with_torque(clean: Recording, law: Law, factor: float) -> Recording:
    """The recording with factor · law in its torque, and nothing else changed."""
    speed = np.gradient(clean.position, clean.sample_time, axis=0)
    more = law(clean.position, speed, (clean.time - clean.time[0])[:, np.newaxis])
    return replace(clean, control_signal=clean.control_signal + factor * more / ROBOT.gains)


def scenario(names: Sequence[str], number: int, seed: int) -> dict[str, Any]:
    """Of these in turn, at one seed."""
    name, truth = names[number % len(names)], seed + number
    accepted, fit, other = (recorded(ROBOT, truth, Scenario(), m, 10 * truth + m, PERIOD) for m in (2, 0, 1))
    line: dict[str, Any] = {"family": name, "seed": truth}
    if name != "clean":
        _, law = ALL[name]
        alone = with_torque(fit, law, 1.0).control_signal - fit.control_signal
        factor = SIZE * float(fit.control_signal.std() / alone.std())
        fit, other = (with_torque(one, law, factor) for one in (fit, other))
    question = Question(
        ROBOT, (fit,), (other,), VOCABULARY, lambda base: prior_by_evidence(base, (accepted,))
    )
    with patch("ident.discrepancy.by_evidence.terms.asked.ABOVE", -1.0):
        return line | {"terms": [one.as_json() for one in proposed_terms(question)]}


def variables(line: dict[str, Any]) -> set[str]:
    """Of all its terms."""
    return {name for term in line["terms"] for name in term["variables"]}


def _left(line: dict[str, Any]) -> float:
    """Share of the gap that its terms leave on the other motion."""
    gap = line["terms"][0]["unexplained"]
    return float(gap["after"] / gap["before"])


def report(lines: list[dict[str, Any]]) -> str:
    """Figures with 95 % intervals, then family by family."""
    clean = [line for line in lines if line["family"] == "clean"]
    hidden = [line for line in lines if line["family"] != "clean"]
    told = [line for line in hidden if line["terms"]]
    right = [variables(line) == ALL[line["family"]][0] for line in hidden]
    closed = [bool(line["terms"]) and _left(line) <= 0.3 for line in hidden]
    text = [
        "| figure | value |",
        "|---|---|",
        f"| a term on a clean arm | {share(bool(line['terms']) for line in clean)} |",
        f"| a term where something is hidden | {share(bool(line['terms']) for line in hidden)} |",
        f"| its variables, of all hidden | {share(right)} |",
        f"| of those told | {share(variables(line) == ALL[line['family']][0] for line in told)} |",
        f"| at most 30 % of the gap left, of all hidden | {share(closed)} |",
        "",
    ]
    for line in hidden:
        terms = "; ".join(f"{t['value']:.3g} {t['unit']} · {t['formula']}" for t in line["terms"]) or "–"
        gap = line["terms"][0]["unexplained"] if line["terms"] else None
        shown = "" if gap is None else f", left {100 * gap['after']:.1f} of {100 * gap['before']:.1f} %"
        text.append(f"- {line['family']}: {terms}{shown}")
    return "\n".join(text) + "\n"


def main() -> None:
    """Run scenarios, keep them, and report."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scenarios", type=int, default=22)
    parser.add_argument("--clean", action="store_true", help="clean arms alone")
    parser.add_argument("--further", action="store_true", help="laws that the dictionary does not have")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin none after so long")
    parser.add_argument("--out", type=Path, default=Path("terms.jsonl"))
    parser.add_argument("--report", type=Path, help="only report these results")
    given = parser.parse_args()
    names = ["clean", *(() if given.clean else FURTHER if given.further else FAMILIES)]
    until = time.monotonic() + given.seconds
    done = {line["seed"] for line in lines_of(given.out)}
    for number in range(given.scenarios if given.report is None else 0):
        if time.monotonic() > until:
            break
        if given.seed + number in done:
            continue
        line = scenario(names, number, given.seed)
        with given.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line, ensure_ascii=False) + "\n")
    print(report(lines_of(given.report or given.out)))


if __name__ == "__main__":
    main()
