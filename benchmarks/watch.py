"""Simulated years of nightly checks, kind by kind: verdict, parameter, delay, false alarms.

    PYTHONPATH=. OMP_NUM_THREADS=1 python benchmarks/watch.py --arms 100 101 --years 2 --json watch.json

Nights are drawn as estimates (``benchmarks/watch_arms.py``), changes are made and judged by
``benchmarks/watch_changes.py``. A quarter of an hour on one core. Rules were made with arms 0 and 1; the
figures of docs/how-to/schedule.md are those of others.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.watch_arms import HALLS, SIMULATED, Arm, Hall, Year, arm_of, year_of
from benchmarks.watch_changes import (
    GROWING,
    KINDS,
    SETTINGS,
    SHARES,
    STARTS,
    WEAR,
    WEAR_STARTS,
    as_nights,
    baseline_geometry,
    step_outcome,
    verdict_of,
    wear_outcome,
)
from daq.check.residual import residual_increase_of
from ident.drift import compare
from ident.drift.comparison import watch_of
from ident.drift.history import Series, expected_of
from ident.drift.patterns import WARMTH
from ident.drift.prior import largest_share


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
    per_unit = np.array([largest_share(chart.direction, geometry) for chart in watched.charts])
    warmth = np.array([chart.pattern.effect == WARMTH for chart in watched.charts])
    per_unit[warmth] = SETTINGS.tolerance / SETTINGS.possible_warmth
    large = np.abs(watched.predicted.error) * per_unit > 0.7 * SETTINGS.tolerance
    near |= (large & (np.abs(watched.scores) > 1.0)).any(axis=1)
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
    arms: Sequence[int],
    years: int,
    folder: Path,
    parts: Sequence[str],
    kept: Path | None,
    halls: Sequence[str] = tuple(HALLS),
) -> dict[str, Any]:
    """Quiet years, steps, wear and cold halls on each arm; each year has its own seed."""
    found: dict[str, Any] = {"quiet": [], "changes": [], "cold": []}
    for seed in arms:
        arm = arm_of(seed, folder)
        for number, (name, hall) in enumerate(HALLS.items()):
            if name not in halls:
                continue
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
        for kind in (*WEAR, *GROWING):
            found += [asdict(wear_outcome(arm, name, drawn, kind, start)) for start in WEAR_STARTS]
    return found


def at_most(count: int, of: int) -> str:
    """The 95 % upper bound of a share (Clopper and Pearson), in words; none where nothing was counted."""
    if not of:
        return ""
    return (
        f" (at most {100 * float(stats.beta.ppf(0.95, count + 1, of - count)) if count < of else 100:.2f} %)"
    )


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
        lines.append(f"nights beyond twice the tolerance: {serious}, fine: {fine}{at_most(fine, serious)}")
        verdicts = sum(one["verdicts"] for one in found["changes"])
        wrong = [word for one in found["changes"] for word in one["wrong"]]
        lines.append(f"nights that were told: {verdicts}, with the other verdict than is due: {len(wrong)}")
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
    parser.add_argument("--halls", nargs="+", default=list(HALLS), help=f"of {', '.join(HALLS)}")
    parser.add_argument("--folder", type=Path, default=Path("arms"), help="keeps the simulated arms")
    parser.add_argument("--json", type=Path, default=None)
    given = parser.parse_args()
    found = run(given.arms, given.years, given.folder, given.parts, given.json, given.halls)
    print("\n".join(summary(found)))


if __name__ == "__main__":
    main()
