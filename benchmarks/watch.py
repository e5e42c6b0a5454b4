"""Simulated years of nightly checks, kind by kind: verdict, parameter, delay, false alarms.

    PYTHONPATH=. OMP_NUM_THREADS=1 python benchmarks/watch.py --arms 100 101 --years 2 --json watch.json

Nights are drawn as estimates (``benchmarks/watch_arms.py``). A quarter of an hour on one core. Rules were
made with arms 0 and 1; the figures of docs/how-to/schedule.md are those of others.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.watch_arms import DRIVE, HALLS, SIMULATED, Arm, Hall, Year, arm_of, year_of
from daq.check.residual import residual_increase_of
from ident.drift import Comparison, DriftSettings, Geometry, Night, compare, patterns_of
from ident.drift.comparison import watch_of
from ident.drift.history import Series, expected_of
from robots.arrays import FloatArray

SETTINGS = DriftSettings()
STARTS = (1, 4, 12, 25, 40, 120, 280)
"""Nights on which a change begins: four of them while the arm is still being learned."""
SHARES = (0.03, 0.07, 0.12, 0.25)
"""Size of a step: share of the joint's torque."""
KINDS: dict[str, tuple[str, int | None, float]] = {
    "Coulomb friction up": ("coulomb_friction", DRIVE, 1.0),
    "Coulomb friction down": ("coulomb_friction", DRIVE, -1.0),
    "viscous friction up": ("viscous_friction", DRIVE, 1.0),
    "payload": ("payload", None, 1.0),
    "drive gain": ("drive_gain_error", 3, 1.0),
    "torque offset": ("current_offset", DRIVE, 1.0),
}
WEAR = {
    "Coulomb friction wears": ("coulomb_friction", DRIVE),
    "viscous friction wears": ("viscous_friction", DRIVE),
}
WEAR_NIGHTS, WEAR_SHARE, WEAR_STEP = 120, 0.25, 3
PATIENCE = 2
"""Judged nights after the first one that is told on which the right name still counts."""


@dataclass(frozen=True)
class Outcome:
    """One change on one arm.

    Attributes:
        kind, hall, start, share: what was done; share of the joint's torque, of wear at its end.
        delay: nights to the first one that is not fine, 1 for the first with the change; None where all were.
        right: whether effect and joint were named first, then or within two nights.
        shape_right: whether step or ramp was said then.
        since_off: nights by which the change point was off then.
        serious, serious_fine: nights beyond twice the tolerance, and those of them that were fine.
        verdict: of the first night that is not fine.
        share_told: share of the joint's torque that had changed by then.
        sentence: then.
    """

    kind: str
    hall: str
    start: int
    share: float
    delay: int | None
    right: bool
    shape_right: bool
    since_off: int | None
    serious: int
    serious_fine: int
    verdict: str
    share_told: float
    sentence: str


def as_nights(arm: Arm, year: Year) -> list[Night]:
    """Nights as the comparison takes them; the hall has one thermometer or none."""
    n = arm.geometry.joints
    celsius = [None] * len(year.values) if year.celsius is None else [np.full(n, c) for c in year.celsius]
    rows = enumerate(zip(year.values, celsius, strict=True))
    return [Night(float(k), v, arm.within, c, True, f"night {k}") for k, (v, c) in rows]


def baseline_geometry(arm: Arm, year: Year) -> Geometry:
    """With the parameters of the first night, as a check has it."""
    return replace(arm.geometry, beta=year.values[0])


def verdict_of(found: Comparison, increase: bool) -> str:
    """As ``daq.check.judged`` has it."""
    if found.state == "changed":
        return "failed" if found.large and not found.doubtful else "warning"
    return "warning" if increase else "ok"


def quiet_alarms(arm: Arm, year: Year) -> list[tuple[int, str]]:
    """Nights of a year without a change that were not fine, and what was said.

    Learning nights are judged one by one; later ones where the charts of the whole year come near a limit,
    each beside the nights before it.
    """
    nights, geometry = as_nights(arm, year), baseline_geometry(arm, year)
    series = Series.of(nights[0], nights[1:])
    watched = watch_of(series, expected_of(series, geometry, SETTINGS), geometry, SETTINGS)
    near = np.abs(watched.scores).max(axis=1) > 0.7 * watched.one_night
    near |= np.maximum(watched.up, watched.down).max(axis=1) > 0.8 * watched.trend
    near |= np.nan_to_num(watched.other) > 0.7 * watched.other_threshold
    near[: SETTINGS.learning_nights + 2] = True
    found = []
    for k in range(1, len(nights)):
        clean = [i for i in range(k) if nights[i].clean]
        increase = bool(residual_increase_of(year.torque_rms[clean], tuple(year.torque_rms[k])))
        said = f"residual {year.torque_rms[k] / year.torque_rms[clean].max(axis=0)}"
        changed = False
        if near[k]:
            comparison = compare(nights[0], nights[1 : k + 1], geometry, SETTINGS)
            changed = comparison.state == "changed"
            said = comparison.sentence if changed else said
        if changed or increase:
            nights[k] = replace(nights[k], clean=False)
            found.append((k, said))
    return found


def torque_share(geometry: Geometry, change: FloatArray) -> float:
    """Largest share of a joint's torque that a change (b,) makes."""
    return float(np.max(geometry.torque_rms(change) / geometry.torque_rms(geometry.beta)))


def direction_of(arm: Arm, effect: str, joint: int | None) -> FloatArray:
    """(b,) per share of torque: a friction, an offset or a gain by itself, a payload 5 cm off the flange."""
    made = arm.geometry
    pattern = next(p for p in patterns_of(made) if (p.effect, p.joint) == (effect, joint))
    direction = np.array(pattern.directions[:, 0])
    if effect == "payload":
        direction = direction + 0.05 * pattern.directions[:, -1]
    return direction / torque_share(made, direction)


def step_outcome(
    arm: Arm, hall: str, year: Year, kind: str, start: int, share: float, nights_after: int = 12
) -> Outcome:
    """A step: a parameter moves, or what is left of the torque grows."""
    factor = np.ones(arm.geometry.joints)
    if kind in SIMULATED:
        change, factor = arm.shifts[kind]
        share = torque_share(arm.geometry, change)
        effect, joint, sign = "residual", DRIVE, 1.0
    else:
        effect, joint, sign = KINDS[kind]  # type: ignore[assignment]
        change = sign * share * direction_of(arm, effect, joint)
    size = min(start + nights_after, len(year.values))
    values, torque = year.values[:size].copy(), year.torque_rms[:size].copy()
    values[start:] += change
    torque[start:] *= factor
    celsius = None if year.celsius is None else year.celsius[:size]
    changed = Year(values, celsius, torque)
    course = np.r_[np.zeros(start), np.full(size - start, share)]
    return judged(arm, hall, changed, kind, (effect, joint, "step"), start, course, range(start, size))


def wear_outcome(arm: Arm, hall: str, year: Year, kind: str, start: int) -> Outcome:
    """A ramp, judged every third night."""
    effect, joint = WEAR[kind]
    size = min(start + WEAR_NIGHTS, len(year.values))
    course = np.zeros(size)
    course[start:] = WEAR_SHARE * np.arange(1, size - start + 1) / WEAR_NIGHTS
    values = year.values[:size] + course[:, None] * direction_of(arm, effect, joint)
    celsius = None if year.celsius is None else year.celsius[:size]
    worn = Year(values, celsius, year.torque_rms[:size])
    judge = range(start, size, WEAR_STEP)
    return judged(arm, hall, worn, kind, (effect, joint, "ramp"), start, course, judge)


def judged(
    arm: Arm,
    hall: str,
    year: Year,
    kind: str,
    truth: tuple[str, int | None, str],
    start: int,
    course: FloatArray,
    nights_judged: range,
) -> Outcome:
    """Judge night after night; what is told teaches nothing, nor do the nights up to the next judged."""
    nights, geometry = as_nights(arm, year)[: len(course)], baseline_geometry(arm, year)
    effect, joint, shape = truth
    first: tuple[int, Comparison, str] | None = None
    right = shape_right = False
    since_off, serious, serious_fine, clean = None, 0, 0, True
    step = nights_judged.step
    for k in range(start, len(course)):
        if k not in nights_judged:
            nights[k] = replace(nights[k], clean=clean)
            continue
        found = compare(nights[0], nights[1 : k + 1], geometry, SETTINGS)
        taught = [i for i in range(k) if nights[i].clean]
        increase = residual_increase_of(year.torque_rms[taught], tuple(year.torque_rms[k]))
        verdict = verdict_of(found, bool(increase))
        clean = verdict == "ok"
        nights[k] = replace(nights[k], clean=clean)
        if course[k] > 2.0 * SETTINGS.tolerance:
            serious, serious_fine = serious + 1, serious_fine + clean
        if not clean and first is None:
            first = (k, found, verdict)
        if first is not None and k <= first[0] + PATIENCE * step and not right:
            right = named_right(found, increase, effect, joint)
            if found.since is not None:
                shape_right = found.since.shape == shape
                since_off = found.since.index - start
        if first is not None and k >= first[0] + PATIENCE * step:
            break
    if first is None:
        return Outcome(
            kind,
            hall,
            start,
            float(course[-1]),
            None,
            False,
            False,
            None,
            serious,
            serious_fine,
            "ok",
            0.0,
            "",
        )
    k, found, verdict = first
    said = found.sentence if found.state == "changed" else "residual"
    what = (k - start + 1, right, shape_right, since_off, serious, serious_fine)
    return Outcome(kind, hall, start, float(course[-1]), *what, verdict, float(course[k]), said)


def named_right(found: Comparison, increase: Any, effect: str, joint: int | None) -> bool:
    """The effect at its joint comes first; where no parameter shows it, the joint with the grown residual."""
    if effect == "residual":
        return bool(increase) and max(increase, key=lambda pair: pair[1])[0] == joint
    return bool(found.changes) and (found.changes[0].effect, found.changes[0].joint) == (effect, joint)


def cold_outcome(arm: Arm, hall: str, seed: int, start: int, kelvin: float = 10.0) -> dict[str, Any]:
    """The heating fails: the hall is colder from one night on, and friction follows."""
    year = year_of(arm, HALLS[hall], start + 8, seed, start, kelvin)
    nights, geometry = as_nights(arm, year), baseline_geometry(arm, year)
    verdicts, said = [], ""
    for k in range(start, len(nights)):
        found = compare(nights[0], nights[1 : k + 1], geometry, SETTINGS)
        nights[k] = replace(nights[k], clean=found.state == "unchanged")
        verdicts.append(verdict_of(found, False))
        said = said or (found.sentence if found.state == "changed" else "")
    return {"hall": hall, "start": start, "verdicts": verdicts, "sentence": said}


def interval(count: int, years: float) -> str:
    """Events a year with the exact 95 % interval of a Poisson count."""
    low = stats.chi2.ppf(0.025, 2 * count) / 2 if count else 0.0
    high = stats.chi2.ppf(0.975, 2 * (count + 1)) / 2
    return f"{count / years:.2f} a year ({low / years:.2f} to {high / years:.2f})"


def run(
    arms: Sequence[int], years: int, folder: Path, parts: Sequence[str], kept: Path | None
) -> dict[str, Any]:
    """Quiet years, steps, wear and cold halls on each arm; each year has its own seed."""
    found: dict[str, Any] = {"quiet": [], "changes": [], "cold": []}
    for seed in arms:
        arm = arm_of(seed, folder)
        for number, (name, hall) in enumerate(HALLS.items()):
            for year_number in range(years):
                drawn = year_of(arm, hall, 366, 10_000 * seed + 100 * number + year_number)
                if "quiet" in parts:
                    alarms = quiet_alarms(arm, drawn)
                    found["quiet"].append({"arm": seed, "hall": name, "alarms": alarms})
                    print(f"arm {seed}, {name}: {alarms[:4]}", file=sys.stderr, flush=True)
            found["changes"] += _changes(arm, name, hall, seed, number, parts)
            if "cold" in parts:
                own = 10_000 * seed + 100 * number + 90
                found["cold"] += [cold_outcome(arm, name, own, start) for start in (3, 20, 60, 200)]
            if kept is not None:  # a hall takes minutes: what is done is kept
                kept.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return found


def _changes(
    arm: Arm, name: str, hall: Hall, seed: int, number: int, parts: Sequence[str]
) -> list[dict[str, Any]]:
    found = []
    rng = np.random.default_rng([seed, number, 3])
    drawn = year_of(arm, hall, 366, 10_000 * seed + 100 * number + 91)
    if "steps" in parts:
        for kind in (*KINDS, *SIMULATED):
            for start in STARTS:
                share = float(rng.choice(SHARES))
                found.append(asdict(step_outcome(arm, name, drawn, kind, start, share)))
    if "wear" in parts:
        for kind in WEAR:
            found += [asdict(wear_outcome(arm, name, drawn, kind, start)) for start in (1, 15, 60, 200)]
    return found


def summary(found: dict[str, Any]) -> list[str]:
    """Lines for a reader."""
    lines = []
    for hall in HALLS:
        of = [year for year in found["quiet"] if year["hall"] == hall]
        if of:
            nights = [night for year in of for night, _ in year["alarms"]]
            onsets = sum(_onsets([night for night, _ in year["alarms"]]) for year in of)
            lines.append(
                f"quiet, {hall}: {len(of)} years, {len(nights)} nights not fine"
                f" ({sum(k <= 30 for k in nights)} of learning), {onsets} alarms: {interval(onsets, len(of))}"
            )
    for kind in dict.fromkeys(one["kind"] for one in found["changes"]):
        lines += _kind_lines(kind, [one for one in found["changes"] if one["kind"] == kind])
    if found["changes"]:
        serious = sum(one["serious"] for one in found["changes"])
        fine = sum(one["serious_fine"] for one in found["changes"])
        lines.append(f"nights beyond twice the tolerance: {serious}, fine: {fine}")
    for hall in HALLS:
        verdicts = [v for one in found["cold"] if one["hall"] == hall for v in one["verdicts"]]
        if verdicts:
            counts = {v: verdicts.count(v) for v in ("ok", "warning", "failed")}
            lines.append(f"heating fails, {hall}: {counts}")
    return lines


def _onsets(nights: Sequence[int]) -> int:
    return sum(night - 1 not in nights for night in nights)


def _kind_lines(kind: str, of: Sequence[dict[str, Any]]) -> list[str]:
    lines = []
    for words, some in (
        ("learning", [one for one in of if one["start"] < SETTINGS.learning_nights]),
        ("watching", [one for one in of if one["start"] >= SETTINGS.learning_nights]),
    ):
        told = [one for one in some if one["delay"] is not None]
        delays = sorted(one["delay"] for one in told)
        if not some:
            continue
        middle = delays[len(delays) // 2] if delays else None
        worst = delays[-1] if delays else None
        lines.append(
            f"{kind}, {words}: told {len(told)} of {len(some)}, delay {middle} (most {worst}) nights,"
            f" right {sum(one['right'] for one in told)}, shape {sum(one['shape_right'] for one in told)},"
            f" untold at {sorted({round(one['share'], 3) for one in some if one['delay'] is None})}"
        )
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--arms", type=int, nargs="+", default=[0])
    parser.add_argument("--years", type=int, default=1, help="quiet years of each arm in each hall")
    parser.add_argument("--parts", nargs="+", default=["quiet", "steps", "wear", "cold"])
    parser.add_argument("--folder", type=Path, default=Path("arms"), help="keeps the simulated arms")
    parser.add_argument("--json", type=Path, default=None)
    given = parser.parse_args()
    found = run(given.arms, given.years, given.folder, given.parts, given.json)
    print("\n".join(summary(found)))


if __name__ == "__main__":
    main()
