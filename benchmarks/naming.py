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
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed

import robots
from benchmarks.naming_parameters import compared, coverage
from drivers.errors import DriveError
from drivers.simulated import PlantTruth, draw_truth
from drivers.simulated.drawing import draw_scenario
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import OUTSIDE_VOCABULARY, Scenario
from ident import BaseParameters, Recording, identify
from ident.discrepancy import Diagnosis, Prior, Question, accepted_noise, accepted_prior, diagnose
from ident.effects.vocabulary import VOCABULARY
from robots import Robot
from robots.arrays import FloatArray
from trajectories import plan

ARM = "tx40"
PERIOD = 12.0
PERIODS = 2
NAMES = tuple(family.name for family in VOCABULARY)
Task = tuple[str, str, int]
"""Kind of run (single, pair, clean, outside), effect (two with a plus for a pair), seed."""


def main() -> None:
    """Run what is asked for, or report what was run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--single", type=int, default=0, help="scenarios with one hidden effect")
    parser.add_argument("--pairs", type=int, default=0, help="scenarios with two hidden effects")
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
        campaign(tasks_of(given), given.size, given.jobs, given.out)
    print(report(given.report or given.out))
    if given.picture:
        picture(given.report or given.out, given.picture)


def tasks_of(given: argparse.Namespace) -> list[Task]:
    """Effects in turn, each with a seed of its own; the kinds mixed evenly, so that any beginning is fair."""
    outside, names, seed = OUTSIDE_VOCABULARY, given.effects, given.seed
    kinds: list[list[Task]] = [
        [("single", names[k % len(names)], seed + k) for k in range(given.single)],
        [("clean", "white" if k % 3 else "coloured", seed + k) for k in range(given.clean)],
        [("outside", outside[k % len(outside)], seed + k) for k in range(given.outside)],
        [("pair", _pair(names, seed + k), seed + k) for k in range(given.pairs)],
    ]
    placed = [((k + 0.5) / len(tasks), task) for tasks in kinds for k, task in enumerate(tasks)]
    return [task for _, task in sorted(placed)]


def _pair(names: Sequence[str], seed: int) -> str:
    return "+".join(np.random.default_rng(seed).choice(names, 2, replace=False))


def campaign(tasks: Sequence[Task], size: float, jobs: int, out: Path) -> None:
    """Run what the file does not hold yet, and append it."""
    done = {(line["kind"], line["effect"], line["seed"]) for line in _lines(out)}
    wanted = [task for task in tasks if task not in done]
    motions = (motion(0), motion(1))
    runs = Parallel(n_jobs=jobs, return_as="generator_unordered")(
        delayed(one_run)(task, size, motions) for task in wanted
    )
    with out.open("a", encoding="utf-8") as file:
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
        scenario, axes, ratio = _hidden(robot, truth, task, size, motions[0])
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


def _hidden(
    robot: Robot, truth: PlantTruth, task: Task, size: float, path: FloatArray
) -> tuple[Scenario, Sequence[Any], float]:
    kind, effect, seed = task
    if kind == "clean":
        noise = {"noise": {"time_constant": 0.02}} if effect == "coloured" else {}
        return Scenario.from_dict({"format": 1, **noise}), (), 0.0
    drawn = [draw_scenario(robot, e, seed, size, truth=truth, reference=path) for e in effect.split("+")]
    if kind == "pair":
        both = drawn[0].scenario.merged(drawn[1].scenario)
        return both, [one.axes for one in drawn], min(one.ratio for one in drawn)
    return drawn[0].scenario, drawn[0].axes, drawn[0].ratio


def record(robot: Robot, truth: PlantTruth, scenario: Scenario, path: FloatArray, seed: int) -> Recording:
    """What a master would have recorded."""
    run = simulate_offline(robot, truth, path, scenario=scenario, periods=PERIODS, seed=seed)
    return Recording("blind", run.time, run.reference, run.position, run.control_signal)


def search(robot: Robot, accepted: Recording, fit: Recording, validation: Recording) -> Diagnosis:
    """The search as a user runs it: an accepted model as prior, one capture to fit, another to validate."""
    estimate = identify(robot, (accepted,)).result.recommended

    def prior(base: BaseParameters) -> Prior:
        noise = accepted_noise(base, (accepted,))
        return accepted_prior(base, estimate.values, estimate.covariance, noise=noise)

    return diagnose(Question(robot, (fit,), (validation,), VOCABULARY, prior))


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
                "set": [
                    [list(c.effects), [list(j) for j in c.joints]] for c in finding.indistinguishable_from
                ],
                "parameters": {p.name: [p.value, p.sigma] for p in finding.parameters},
            }
            for finding in found.findings
        ],
        "excess": [examination.excess for examination in found.examinations],
        "explainable": [gap.explainable(gap.before).tolist(), gap.explainable(gap.after).tolist()],
        "floor": gap.floor.tolist(),
        "level": [gap.before.tolist(), gap.after.tolist()],
    }


def _lines(path: Path) -> list[dict[str, Any]]:
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line]


def right_first(line: dict[str, Any]) -> bool:
    """The first finding has the right name and place."""
    findings = line["findings"]
    return bool(findings) and _same(line, findings[0]["effect"], findings[0]["joints"])


def in_set(line: dict[str, Any]) -> bool:
    """The truth is the first finding or among what cannot be told from it."""
    if right_first(line):
        return True
    return any(
        _same(line, effects[0], joints[0])
        for finding in line["findings"][:1]
        for effects, joints in finding["set"]
        if len(effects) == 1
    )


def _same(line: dict[str, Any], effect: str, joints: Sequence[int]) -> bool:
    if effect != line["effect"]:
        return False
    return not line["axes"] or not joints or sorted(joints) == sorted(line["axes"])


def share(hits: Iterable[bool]) -> str:
    """A share with its 95 % interval (Wilson)."""
    flags = list(hits)
    n = len(flags)
    if not n:
        return "–"
    p, z = sum(flags) / n, 1.959963984540054
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    return f"{100 * p:.0f} % [{100 * max(middle - half, 0):.0f}, {100 * min(middle + half, 1):.0f}] of {n}"


def report(path: Path) -> str:
    """The campaign as Markdown: figures with intervals, per effect, and what was taken for what."""
    lines = [line for line in _lines(path) if "skipped" not in line]
    single = [line for line in lines if line["kind"] == "single"]
    clean = [line for line in lines if line["kind"] == "clean"]
    outside = [line for line in lines if line["kind"] == "outside"]
    pairs = [line for line in lines if line["kind"] == "pair"]
    sizes: list[float] = [1 + len(line["findings"][0]["set"]) for line in single if line["findings"]]
    confident = [bool(line["findings"]) and not in_set(line) for line in single]
    named = [line for line in single if right_first(line)]
    levels = [line for line in named if "level" in line]
    text: list[str] = [
        "| figure | value |",
        "|---|---|",
        f"| right name and joint first | {share(map(right_first, single))} |",
        f"| truth in the reported set | {share(map(in_set, single))} |",
        f"| mean size of the set | {np.mean(sizes or [np.nan]):.2f} |",
        f"| a wrong name, the truth not in the set | {share(confident)} |",
        f"| gap on validation ≤ 20 % of what it was, where named right | {share(map(_closed, named))} |",
        f"| gap ≤ 20 %, the arm's joints taken together | {share(map(_closed_together, levels))} |",
        f"| share of the gap that is left, median | {_median_left(named)} |",
        *_beside_clean(named, clean),
        f"| two hidden: both named first | {share(map(both_named, pairs))} |",
        f"| two hidden: at least one | {share(bool(_of_pair(line)) for line in pairs)} |",
        f"| two hidden: a finding that is neither | {share(map(spurious, pairs))} |",
        f"| one hidden: more than one finding | {share(len(line['findings']) > 1 for line in single)} |",
        f"| clean arms with a finding | {share(bool(line['findings']) for line in clean)} |",
        f"| clean arms not called clean | {share(line['verdict'] != 'clean' for line in clean)} |",
        f"| outside the vocabulary: noticed | {share(line['verdict'] != 'clean' for line in outside)} |",
        f"| outside the vocabulary: no name | {share(not line['findings'] for line in outside)} |",
        "",
        "| effect | right first | in the set | called otherwise |",
        "|---|---|---|---|",
    ]
    groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for line in single:
        groups[line["effect"]].append(line)
    for effect, rows in sorted(groups.items()):
        others = Counter(_called(line) for line in rows if not right_first(line))
        words = ", ".join(f"{name} ×{count}" for name, count in others.most_common())
        text.append(f"| {effect} | {share(map(right_first, rows))} | {share(map(in_set, rows))} | {words} |")
    return "\n".join([*text, "", *_covered(lines)]) + "\n"


def _covered(lines: Sequence[dict[str, Any]]) -> list[str]:
    """How often the truth is within three standard deviations, over all parameters and for each."""
    within = coverage(lines)
    everything = [hit for hits in within.values() for hit in hits]
    text = ["| parameter | truth within 3 σ |", "|---|---|", f"| all | {share(everything)} |"]
    return [*text, *(f"| {name} | {share(hits)} |" for name, hits in sorted(within.items()))]


def _of_pair(line: dict[str, Any]) -> set[int]:
    """Which of two hidden effects (0, 1) are among the findings, with their place."""
    found = set()
    for index, (effect, axes) in enumerate(zip(line["effect"].split("+"), line["axes"], strict=True)):
        alone = line | {"effect": effect, "axes": axes}
        if any(_same(alone, finding["effect"], finding["joints"]) for finding in line["findings"]):
            found.add(index)
    return found


def both_named(line: dict[str, Any]) -> bool:
    """Both hidden effects are findings."""
    return len(_of_pair(line)) == 2


def spurious(line: dict[str, Any]) -> bool:
    """More findings than hidden effects among them."""
    return len(line["findings"]) > len(_of_pair(line))


def picture(path: Path, file: Path) -> None:
    """Hidden effect against what it was called, single scenarios."""
    single = [line for line in _lines(path) if line["kind"] == "single" and "skipped" not in line]
    columns = [*NAMES, "unnamed", "clean"]
    counts = np.zeros((len(NAMES), len(columns)))
    for line in single:
        called = line["findings"][0]["effect"] if line["findings"] else line["verdict"]
        counts[NAMES.index(line["effect"]), columns.index(called)] += 1
    cell, left, top = 20, 210, 210
    width, height = left + cell * len(columns) + 10, top + cell * len(NAMES) + 10
    text = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif"'
        f' font-size="12"><rect width="{width}" height="{height}" fill="white"/>'
    ]
    for column, name in enumerate(columns):
        x = left + cell * column + 14
        text.append(f'<text transform="translate({x} {top - 6}) rotate(-90)">{name}</text>')
    for row, name in enumerate(NAMES):
        y = top + cell * row
        text.append(f'<text x="{left - 6}" y="{y + 14}" text-anchor="end">{name}</text>')
        for column in range(len(columns)):
            count, x = int(counts[row, column]), left + cell * column
            shade = "#f3f3f3" if not count else "#7fb3e0" if row == column else "#f2b48a"
            text.append(f'<rect x="{x}" y="{y}" width="{cell - 1}" height="{cell - 1}" fill="{shade}"/>')
            if count:
                text.append(f'<text x="{x + 9}" y="{y + 14}" text-anchor="middle">{count}</text>')
    file.write_text("\n".join([*text, "</svg>"]) + "\n", encoding="utf-8")


_CLOSED = 0.2
"""Share of the gap that may be left."""


def _closed(line: dict[str, Any]) -> bool:
    return _left(line) <= _CLOSED


def _left(line: dict[str, Any]) -> float:
    """Share of the explainable gap that is left: joints one by one, each in its own floors."""
    floor = np.array(line["floor"])
    before, after = (float(np.linalg.norm(np.array(gap) / floor)) for gap in line["explainable"])
    return after / before if before > 0.0 else np.inf


def _closed_together(line: dict[str, Any]) -> bool:
    """The same with the floor taken off the whole arm's energy, so that chance does not add up over joints.

    Noise alone makes the level of a joint now larger than its floor and now smaller. Where each joint is cut
    off at zero only the larger ones count; in the sum they cancel.
    """
    floor = np.array(line["floor"])
    before, after = (float(np.sum((np.array(level) / floor) ** 2 - 1.0)) for level in line["level"])
    return max(after, 0.0) <= _CLOSED**2 * before


def _gap_in_floors(line: dict[str, Any]) -> float:
    """Explainable gap before anything was found, joints one by one, each in its own floors."""
    return float(np.linalg.norm(np.array(line["explainable"][0]) / np.array(line["floor"])))


def _beside_clean(named: Sequence[dict[str, Any]], clean: Sequence[dict[str, Any]]) -> list[str]:
    """What of the gap an arm with nothing hidden has, too: of a small gap that alone is more than a fifth."""
    if not clean:
        return []
    nothing = float(np.median([_gap_in_floors(line) for line in clean]))
    large = [line for line in named if _gap_in_floors(line) * _CLOSED >= nothing]
    return [
        f"| gap of clean arms in floors, all joints, median | {nothing:.2f} |",
        f"| gap ≤ 20 %, where a fifth of it is no less than that | {share(map(_closed, large))} |",
    ]


def _median_left(lines: Sequence[dict[str, Any]]) -> str:
    return f"{100 * float(np.median([_left(line) for line in lines])):.0f} %" if lines else "–"


def _called(line: dict[str, Any]) -> str:
    if not line["findings"]:
        return str(line["verdict"])
    first = line["findings"][0]
    return str(first["effect"]) + ("" if first["effect"] != line["effect"] else " at another joint")


if __name__ == "__main__":
    main()
