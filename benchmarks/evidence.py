"""The search by evidence and the search by rules on the same logs of foreign plants, scored side by side.

Each run draws an effect from a seed, hides it in MuJoCo (:mod:`benchmarks.foreign_plant`), makes the prior
of a clean log of the same arm, and asks both searches. Each run is one line of JSON, so that a campaign can
be stopped and gone on with. A fifth of the runs hides nothing.

    python -m benchmarks.evidence --first 40000 --seeds 20 --out evidence.jsonl
    python -m benchmarks.evidence --report evidence.jsonl
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import robots
from benchmarks.foreign_plant import ARMS, Arm, Effect, Settings, record
from benchmarks.foreign_plant.files import write_description
from ident import BaseParameters, Recording, identify
from ident.discrepancy import Prior, Question, accepted_noise, accepted_prior, diagnose
from ident.discrepancy.by_evidence import diagnose_by_evidence, prior_by_evidence
from ident.effects.vocabulary import VOCABULARY
from robots import Robot

SEARCHES = ("evidence", "rules")
_SHARES = {
    "viscous_friction": ("viscous", 0.4),
    "coulomb_friction": ("coulomb", 0.4),
    "asymmetric_friction": ("coulomb", 0.3),
    "stribeck_friction": ("coulomb", 0.5),
    "nonlinear_viscous_friction": ("coulomb", 0.3),
    "hysteresis": ("coulomb", 0.3),
    "torque_ripple": ("coulomb", 0.2),
    "current_offset": ("coulomb", 0.3),
    "rotor_inertia": ("rotor", 0.4),
    "gravity_spring": ("torque", 0.05),
}
"""Sizes as shares of a figure of the joint."""
_SIZES = {
    "load_dependent_friction": 0.15,
    "drifting_friction": 0.35,
    "position_dependent_friction": 0.4,
    "drive_gain_error": 0.06,
    "current_loop_lag": 0.003,
    "time_delay": 0.003,
    "payload": 1.0,
    "base_tilt": 0.03,
}
"""Sizes in the effects' own units."""
_CLEAN = 5
"""One run of so many hides nothing."""


def main() -> None:
    """Run what is asked for, or report what was run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--arm", choices=ARMS, default="compact6")
    parser.add_argument("--first", type=int, default=40000, help="first seed")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--motion", default="waypoints")
    parser.add_argument("--periods", type=int, default=3)
    parser.add_argument("--searches", nargs="*", default=list(SEARCHES), choices=SEARCHES)
    parser.add_argument("--out", type=Path, default=Path("evidence.jsonl"))
    parser.add_argument("--report", type=Path, help="only report these results")
    given = parser.parse_args()
    if given.report is None:
        done = {line["seed"] for line in _lines(given.out)}
        for seed in range(given.first, given.first + given.seeds):
            if seed not in done:
                line = one_run(
                    given.arm, seed, Settings(motion=given.motion, periods=given.periods), given.searches
                )
                with given.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(line) + "\n")
    print(report(_lines(given.report or given.out)))


def one_run(name: str, seed: int, settings: Settings, searches: Sequence[str]) -> dict[str, Any]:
    """Draw, simulate, search, and only then compare."""
    arm = ARMS[name]
    effects = drawn(seed, arm)
    with tempfile.TemporaryDirectory() as folder:
        write_description(Path(folder), arm, settings)
        robot = robots.load(str(Path(folder) / "robot.toml"))
        accepted, fit, validation = (
            _recording(record(arm, settings, hidden, seed + shift, part))
            for hidden, shift, part in (((), 500_000, 0), (effects, 0, 0), (effects, 0, 1))
        )
        answers = {one: _answer(one, robot, accepted, fit, validation) for one in searches}
    truth = [[e.name, e.joint + 1] for e in effects]
    return {"arm": name, "seed": seed, "truth": truth, "answers": answers}


def drawn(seed: int, arm: Arm) -> tuple[Effect, ...]:
    """None, or one effect of the plant at a joint; sizes vary by a third."""
    if seed % _CLEAN == 0:
        return ()
    random = np.random.default_rng(seed)
    name = str(random.choice(sorted([*_SHARES, *_SIZES])))
    joint, factor = int(random.integers(arm.n)), float(np.exp(random.normal(0.0, 0.3)))
    if name in _SIZES:
        return (Effect(name, joint, _SIZES[name] * factor),)
    figure, share = _SHARES[name]
    return (Effect(name, joint, share * factor * float(getattr(arm.links[joint], figure))),)


def _recording(log: Any) -> Recording:
    return Recording("foreign", log.time, log.reference, log.position, log.control_signal)


def _answer(
    search: str, robot: Robot, accepted: Recording, fit: Recording, validation: Recording
) -> dict[str, Any]:
    started = time.process_time()
    if search == "evidence":
        found = diagnose_by_evidence(
            Question(
                robot, (fit,), (validation,), VOCABULARY, lambda base: prior_by_evidence(base, (accepted,))
            )
        )
        names = [[f.name, list(f.joints), f.probability, f.named] for f in found.findings]
        verdict: str = found.verdict
    else:
        estimate = identify(robot, (accepted,)).result.recommended

        def prior(base: BaseParameters) -> Prior:
            noise = accepted_noise(base, (accepted,))
            return accepted_prior(base, estimate.values, estimate.covariance, noise=noise)

        ruled = diagnose(Question(robot, (fit,), (validation,), VOCABULARY, prior))
        names = [[f.effect, list(f.joints), 1.0, True] for f in ruled.findings]
        verdict = ruled.verdict
    return {"verdict": verdict, "names": names, "processor_seconds": time.process_time() - started}


def report(lines: Sequence[dict[str, Any]]) -> str:
    """One table, a column per search."""
    head = ["| figure | " + " | ".join(SEARCHES) + " |", "|---|---|---|"]
    hidden = [line for line in lines if line["truth"]]
    clean = [line for line in lines if not line["truth"]]
    rows = [
        ("right name and joint first", hidden, _right),
        ("a name that is not hidden", lines, _wrong),
        ("clean arm with a finding", clean, _wrong),
        ("clean arm called clean", clean, lambda line, answer: answer["verdict"] == "clean"),
    ]
    return "\n".join([*head, *(f"| {title} | {_cells(part, test)} |" for title, part, test in rows)])


def _cells(lines: Sequence[dict[str, Any]], test: Any) -> str:
    cells = []
    for search in SEARCHES:
        asked = [line for line in lines if search in line["answers"]]
        hits = sum(test(line, line["answers"][search]) for line in asked)
        cells.append(f"{hits} of {len(asked)}")
    return " | ".join(cells)


def _same(truth: Sequence[Any], name: Sequence[Any]) -> bool:
    return truth[0] == name[0] and (not name[1] or truth[1] in name[1])


def _right(line: dict[str, Any], answer: dict[str, Any]) -> bool:
    return bool(answer["names"]) and any(_same(one, answer["names"][0]) for one in line["truth"])


def _wrong(line: dict[str, Any], answer: dict[str, Any]) -> bool:
    given = [name for name in answer["names"] if name[3]]
    return any(not any(_same(one, name) for one in line["truth"]) for name in given)


def _lines(path: Path) -> list[dict[str, Any]]:
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


if __name__ == "__main__":
    main()
