"""How often the hidden effect is named right, against its size in noise floors: the detection curve.

Arms, drawing, recordings, search and scoring are those of ``benchmarks/naming.py``. Groups and sizes are
taken in turn, each scenario with a seed of its own, so that any beginning of the campaign is fair; effects
take turns within their group. The two motions are planned once and kept beside the results. On one axis
(``--arm emps --period 6``) a scenario takes a fourth of the time; effects that it has no place for are
skipped.

    python benchmarks/naming_detection.py --rounds 10 --seed 960000 --out naming_detection.jsonl
    python benchmarks/naming_detection.py --report naming_detection.jsonl --picture naming-detection.svg
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import naming, naming_report, naming_scores
from benchmarks import trust_pictures as pictures
from benchmarks.naming_report import share
from robots.arrays import FloatArray

SIZES = (0.5, 1.0, 1.5, 2.0, 3.0, 5.0)
"""Gap over noise floor at the joint where that is largest."""

GROUPS: dict[str, tuple[str, ...]] = {
    "friction": (
        "viscous_friction",
        "coulomb_friction",
        "asymmetric_friction",
        "stribeck_friction",
        "static_friction",
        "nonlinear_viscous_friction",
        "load_dependent_friction",
        "drifting_friction",
        "position_dependent_friction",
    ),
    "gears": ("joint_elasticity", "backlash", "hysteresis", "wrist_coupling", "gear_ripple"),
    "drives": (
        "drive_gain_error",
        "current_offset",
        "torque_ripple",
        "saturation",
        "rotor_inertia",
        "current_loop_lag",
        "time_delay",
    ),
    "loads": ("payload", "gravity_spring", "base_tilt", "cable_spring", "contact"),
}
"""The vocabulary by where an effect sits: in the bearings, the gears, the drives, or on the links."""


def main() -> None:
    """Run what is asked for, or report what was run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--arm", default=naming.ARM, help="a shipped arm")
    parser.add_argument("--period", type=float, default=naming.PERIOD, help="of the motions, s")
    parser.add_argument("--rounds", type=int, default=10, help="scenarios per group and size")
    parser.add_argument("--seed", type=int, default=6000, help="of the first scenario")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin no scenario after so long")
    parser.add_argument("--out", type=Path, default=Path("naming_detection.jsonl"))
    parser.add_argument("--report", type=Path, help="only report these results")
    parser.add_argument("--picture", type=Path, help="write the curves")
    given = parser.parse_args()
    naming.ARM, naming.PERIOD = given.arm, given.period
    if given.report is None:
        campaign(tasks(given.rounds, given.seed), given.out, given.seconds)
    lines = [line for line in naming_report.lines_of(given.report or given.out) if "skipped" not in line]
    print(report(lines))
    if given.picture:
        given.picture.write_text(picture(lines), encoding="utf-8")


def tasks(rounds: int, seed: int) -> list[tuple[str, int, float]]:
    """Effect, seed and size of each scenario; an effect's sizes are of arms of their own."""
    found = []
    for number in range(rounds):
        for place, effects in enumerate(GROUPS.values()):
            for step, size in enumerate(SIZES):
                own = seed + (number * len(GROUPS) + place) * len(SIZES) + step
                found.append((effects[(number * len(SIZES) + step) % len(effects)], own, size))
    return found


def campaign(wanted: Sequence[tuple[str, int, float]], out: Path, seconds: float) -> None:
    """Run what the file does not hold yet, and append it."""
    done = {(line["effect"], line["seed"]) for line in naming_report.lines_of(out)}
    motions = planned(out.with_suffix(".npz"))
    until = time.monotonic() + seconds
    for effect, seed, size in wanted:
        if (effect, seed) in done:
            continue
        if time.monotonic() > until:
            break
        line = naming.one_run(("single", effect, seed), size, motions)
        with out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line | {"size": size}) + "\n")


def planned(path: Path) -> tuple[FloatArray, FloatArray]:
    """The two motions of the campaign, (N, n) each."""
    if not path.exists():
        np.savez(path, fit=naming.motion(0), validation=naming.motion(1))
    with np.load(path) as kept:
        return kept["fit"], kept["validation"]


def named_alone(line: dict[str, Any]) -> bool:
    """The verdict is one name, and it is the right one."""
    return naming_scores.right_first(line) and not line["findings"][0]["set"]


def named_wrong(line: dict[str, Any]) -> bool:
    """There is a finding, and the truth is neither it nor in its set."""
    return bool(line["findings"]) and not naming_scores.in_set(line)


MEASURES: dict[str, Callable[[dict[str, Any]], bool]] = {
    "noticed (not called clean)": lambda line: line["verdict"] != "clean",
    "right name and place first": naming_scores.right_first,
    "right name and place, alone": named_alone,
    "truth in the reported set": naming_scores.in_set,
    "a name that is wrong": named_wrong,
}


def report(lines: Sequence[dict[str, Any]]) -> str:
    """Over all groups per measure, then the right name per group; each against the size."""
    heading = "| {} | " + " | ".join(f"{size:g}" for size in SIZES) + " |"
    rule = "|---" * (len(SIZES) + 1) + "|"
    text = [heading.format("size in noise floors, all groups"), rule]
    for words, measure in MEASURES.items():
        cells = [share(map(measure, of(lines, size))) for size in SIZES]
        text.append(f"| {words} | {' | '.join(cells)} |")
    text += ["", heading.format("right name and place first, by group"), rule]
    for group in GROUPS:
        cells = [share(map(naming_scores.right_first, of(lines, size, group))) for size in SIZES]
        text.append(f"| {group} | {' | '.join(cells)} |")
    return "\n".join(text) + "\n"


def of(lines: Sequence[dict[str, Any]], size: float, group: str | None = None) -> list[dict[str, Any]]:
    """The scenarios of a size, of one group or of all."""
    effects = naming_report.NAMES if group is None else GROUPS[group]
    return [line for line in lines if line["size"] == size and line["effect"] in effects]


def picture(lines: Sequence[dict[str, Any]]) -> str:
    """Left: all groups, three measures. Right: the right name by group. With 95 % intervals."""
    share = pictures.Axis(0.0, 1.0, 300, 70, tuple((k / 4, f"{25 * k} %") for k in range(5)))
    ticks = tuple((size, f"{size:g}") for size in SIZES)
    left = pictures.Axis(SIZES[0], SIZES[-1], 70, 360, ticks, True)
    right = pictures.Axis(SIZES[0], SIZES[-1], 590, 880, ticks, True)
    shown = {
        "noticed": MEASURES["noticed (not called clean)"],
        "in the set": naming_scores.in_set,
        "right first": naming_scores.right_first,
        "wrong name": named_wrong,
    }
    body = [
        pictures.written(70, 24, "All effects", "head"),
        pictures.written(70, 44, f"share of {len(lines)} scenarios, 95 % interval", "small"),
        pictures.written(590, 24, "Right name and place first", "head"),
        pictures.written(590, 44, "by where the effect sits", "small"),
        *pictures.frame(left, share, "size of the hidden effect, noise floors"),
        *pictures.frame(right, share, "size of the hidden effect, noise floors"),
    ]
    every = {name: (measure, list(lines)) for name, measure in shown.items()}
    by_group = {
        group: (naming_scores.right_first, [line for line in lines if line["effect"] in effects])
        for group, effects in GROUPS.items()
    }
    for across, curves in ((left, every), (right, by_group)):
        marks = []
        for place, (name, (measure, chosen)) in enumerate(curves.items()):
            points = []
            for size in SIZES:
                hits = [measure(line) for line in of(chosen, size)]
                if not hits:
                    continue
                x = across(size) + 4 * place - 6
                points.append((x, share(sum(hits) / len(hits))))
                body.append(pictures._bar(x, share, pictures.wilson(sum(hits), len(hits)), f"c{place}"))
            if points:
                body += pictures._curve(points, f"c{place}", place, dashed=False)
                marks.append((points[-1][1], f"c{place}|{name}"))
        body += pictures._side_labels(across.end + 22, marks)
    return pictures.drawing(970, 352, "How often a hidden effect is named right, against its size", body)


if __name__ == "__main__":
    main()
