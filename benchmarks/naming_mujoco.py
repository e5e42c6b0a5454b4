"""Does the search name what is hidden in a plant that nobody of this project wrote?

Each run draws an arm, a kind of effect, a place and a size from a seed, hides the effect in MuJoCo
(:mod:`benchmarks.mujoco_arm`), and gives the search recordings, description and a prior from a clean run of
the same arm. The coupling of the wrist is in the arm always; there the model lacks it, and there is no prior.
Each run is one line of JSON, so that a campaign can be stopped and gone on with.

    python -m benchmarks.naming_mujoco --seeds 5 --out naming_mujoco.jsonl
    python -m benchmarks.naming_mujoco --report naming_mujoco.jsonl
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import robots
from benchmarks.mujoco_arm import NOTHING, Hidden, on, record
from daq.diagnosis.diagnose import model_without
from drivers.simulated import PlantTruth, draw_truth
from drivers.simulated.drawing import exercise
from ident import Recording
from ident.discrepancy import Diagnosis, Question
from ident.discrepancy.by_evidence import diagnose_with_evidence, prior_by_evidence
from ident.effects.vocabulary import VOCABULARY
from robots import Robot
from robots.arrays import FloatArray

ARM = "tx40"
PERIOD = 10.0


@dataclass(frozen=True)
class Kind:
    """One kind of hidden effect: MuJoCo's word for it, and the vocabulary's (None: nothing is hidden)."""

    mujoco: str
    effect: str | None


KINDS = {
    kind.mujoco: kind
    for kind in (
        Kind("nothing", None),
        Kind("damping", "viscous_friction"),
        Kind("frictionloss", "coulomb_friction"),
        Kind("armature", "rotor_inertia"),
        # Linear, so by the definitions in docs/reference/effects.md no cable, which stiffens.
        Kind("stiffness", "gravity_spring"),
        Kind("payload body", "payload"),
        Kind("tendon coupling", "wrist_coupling"),
        Kind("actuator gear", "drive_gain_error"),
        Kind("actuator delay", "time_delay"),
        Kind("actuator filter", "current_loop_lag"),
    )
}


def main() -> None:
    """Run what is asked for, or report what was run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5, help="arms per kind")
    parser.add_argument("--first", type=int, default=700, help="first seed")
    parser.add_argument("--kinds", nargs="*", default=list(KINDS), choices=list(KINDS))
    parser.add_argument("--out", type=Path, default=Path("naming_mujoco.jsonl"))
    parser.add_argument("--report", type=Path, help="only report these results")
    given = parser.parse_args()
    if given.report is None:
        campaign(given.kinds, range(given.first, given.first + given.seeds), given.out)
    print(report(_lines(given.report or given.out)))


def campaign(kinds: Sequence[str], seeds: Sequence[int], out: Path) -> None:
    """Run what the file does not hold yet, and append it."""
    done = {(line["kind"], line["seed"]) for line in _lines(out)}
    for seed in seeds:
        for kind in kinds:
            if (kind, seed) in done:
                continue
            line = one_run(kind, seed)
            with out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")


def one_run(kind: str, seed: int) -> dict[str, Any]:
    """Draw, simulate, search, and only then compare."""
    robot = robots.load(ARM)
    truth = draw_truth(robot, seed)
    hidden, joints, size = draw(robot, truth, kind, seed)
    fit = record(robot, truth, motion(0), hidden, seed=seed + 2)
    validation = record(robot, truth, motion(1), hidden, seed=seed + 3)
    started = time.monotonic()
    if kind == "tendon coupling":
        model = model_without(robot, ("wrist_coupling",))
        question = Question(robot, (fit,), (validation,), VOCABULARY, None, model)
        found, _ = diagnose_with_evidence(question, sizes=False)
    else:
        accepted = record(robot, truth, motion(0), NOTHING, seed=seed + 1)
        found = search(robot, accepted, fit, validation)
    seconds = time.monotonic() - started
    return {"kind": kind, "seed": seed, "joints": joints, "size": size, "s": seconds, **summary(found)}


def search(robot: Robot, accepted: Recording, fit: Recording, validation: Recording) -> Diagnosis:
    """As a user does: the model of an accepted run is the prior."""
    question = Question(
        robot, (fit,), (validation,), VOCABULARY, lambda base: prior_by_evidence(base, (accepted,))
    )
    return diagnose_with_evidence(question, sizes=False)[0]


@cache
def motion(seed: int) -> FloatArray:
    """One period, (N, n)."""
    return exercise(robots.load(ARM), duration=PERIOD, seed=seed)


def draw(robot: Robot, truth: PlantTruth, kind: str, seed: int) -> tuple[Hidden, list[int], float]:
    """What is hidden, on which joints or drives (from 1), and its size in SI units."""
    generator = np.random.default_rng([seed, list(KINDS).index(kind)])
    drive, share = int(generator.integers(robot.n)), float(generator.uniform(0.2, 0.5))
    place = [drive + 1]
    if kind in ("damping", "frictionloss", "armature"):
        symbol, field = {
            "damping": ("Fv", "damping"),
            "frictionloss": ("Fc", "friction"),
            "armature": ("Ia", "armature"),
        }[kind]
        size = share * float(truth.per_drive(symbol)[drive])
        return Hidden(**{field: on(robot, drive, size)}), place, size
    if kind == "stiffness":
        size = float(generator.uniform(0.03, 0.1) * robot.joint[drive].torque)
        return Hidden(spring=(drive, size, float(robot.home[drive]))), place, size
    if kind == "payload body":
        size = float(generator.uniform(0.3, 1.5))
        centre = generator.uniform([-0.03, -0.03, 0.03], [0.03, 0.03, 0.1])
        return Hidden(payload=(size, *map(float, centre))), [], size
    if kind == "actuator gear":
        size = float(generator.choice([-1.0, 1.0]) * generator.uniform(0.05, 0.1))
        return Hidden(gain=(drive, size)), place, size
    if kind == "actuator delay":
        size = float(generator.uniform(0.002, 0.005))
        return Hidden(delay=(drive, size)), place, size
    if kind == "actuator filter":
        size = float(generator.uniform(0.002, 0.005))
        return Hidden(lag=(drive, size)), place, size
    return NOTHING, [5, 6] if kind == "tendon coupling" else [], 0.0


def summary(found: Diagnosis) -> dict[str, Any]:
    """What the scoring needs of a diagnosis."""
    gap = found.torque
    return {
        "verdict": found.verdict,
        "findings": [
            {
                "effect": finding.effect,
                "joints": list(finding.joints),
                "indistinguishable": [[[c.effect], [list(c.joints)]] for c in finding.indistinguishable_from],
                "parameters": {p.name: [p.value, p.sigma] for p in finding.parameters},
            }
            for finding in found.findings
        ],
        "explainable": [gap.explainable(gap.before).tolist(), gap.explainable(gap.after).tolist()],
        "floor": gap.floor.tolist(),
    }


def right(line: dict[str, Any]) -> bool:
    """The first finding has the right name and place; nothing is found where nothing is hidden."""
    effect = KINDS[line["kind"]].effect
    if effect is None or not line["findings"]:
        return effect is None and not line["findings"]
    return _same(line, line["findings"][0]["effect"], line["findings"][0]["joints"])


def in_set(line: dict[str, Any]) -> bool:
    """The right name and place are first or among what cannot be told from it."""
    return right(line) or any(
        _same(line, effects[0], joints[0])
        for finding in line["findings"][:1]
        for effects, joints in finding["indistinguishable"]
        if len(effects) == 1
    )


def _same(line: dict[str, Any], effect: str, joints: Sequence[int]) -> bool:
    return effect == KINDS[line["kind"]].effect and sorted(joints) == sorted(line["joints"])


def report(lines: Sequence[dict[str, Any]]) -> str:
    """The campaign as Markdown."""
    text = [
        "| hidden in MuJoCo | name | gap/floor | right first | in the set | gap left | called otherwise |",
        "|---|---|---|---|---|---|---|",
    ]
    for kind, what in KINDS.items():
        rows = [line for line in lines if line["kind"] == kind]
        if not rows:
            continue
        others = Counter(_called(line) for line in rows if not right(line))
        text.append(
            f"| {kind} | {what.effect or 'clean'} | {_gap_in_floors(rows)} |"
            f" {sum(map(right, rows))} of {len(rows)} |"
            f" {sum(map(in_set, rows))} of {len(rows)} | {_gap_left(rows)} |"
            f" {', '.join(f'{name} ×{count}' for name, count in others.most_common())} |"
        )
    return "\n".join(text) + "\n"


def _gap_in_floors(rows: Sequence[dict[str, Any]]) -> str:
    """How much there is to see: the explainable gap over the floor at the joint where that is largest."""
    ratios = [np.max(np.array(line["explainable"][0]) / np.array(line["floor"])) for line in rows]
    return ", ".join(f"{ratio:.1f}" for ratio in ratios)


def _gap_left(rows: Sequence[dict[str, Any]]) -> str:
    """Median of the explainable gap after over before, where it was named right."""
    shares = []
    for line in rows:
        if line["findings"] and right(line):
            before, after = (np.array(part) / np.array(line["floor"]) for part in line["explainable"])
            if np.linalg.norm(before) > 0.0:
                shares.append(np.linalg.norm(after) / np.linalg.norm(before))
    return f"{100 * float(np.median(shares)):.0f} %" if shares else "–"


def _called(line: dict[str, Any]) -> str:
    if not line["findings"]:
        return str(line["verdict"])
    first = line["findings"][0]
    return f"{first['effect']} at {first['joints']}"


def _lines(path: Path) -> list[dict[str, Any]]:
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line]


if __name__ == "__main__":
    main()
