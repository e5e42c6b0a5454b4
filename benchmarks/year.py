"""A simulated year of nightly checks: false alarms without a change, and how soon three changes are named.

``python benchmarks/year.py --picture docs/images/year.svg`` (15 minutes on one core) gives the figures
of docs/how-to/schedule.md. Short: ``--nights 40 --after 12 --seeds 0``.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.year_nights import Bench, Nights, bench, run_nights
from benchmarks.year_picture import Panel, write_picture
from daq.check.residual import ENOUGH, ResidualIncrease, residual_increase_of
from ident.drift import Comparison, DriftSettings, Geometry, Night, compare
from robots.arrays import FloatArray

WEAR_PER_WEEK = 0.01
MASS = 0.2
LOST_GAIN = -0.05


@dataclass(frozen=True)
class Outcome:
    """What became of one change.

    Attributes:
        scenario: in words.
        delay: nights from the change to the alarm, 1 for the first night with it; None where there was none.
        named: nights to the first comparison that names the effect at its joint first; None where none did.
        sentence: at that time.
    """

    scenario: str
    delay: int | None
    named: int | None
    sentence: str


def as_nights(found: Nights) -> list[Night]:
    """Nights as the comparison takes them; the hall has one thermometer."""
    joints = 6
    rows = zip(found.day, found.celsius, found.values, found.covariance, strict=True)
    return [Night(d, v, s, np.full(joints, c), True, f"night {d:.0f}") for d, c, v, s in rows]


def judge(
    nights: Sequence[Night], geometry: Geometry, settings: DriftSettings, first: int = 1
) -> list[Comparison]:
    """Every night from ``first`` beside those before; a night on which something is found teaches nothing."""
    history, found = list(nights), []
    for k in range(first, len(history)):
        comparison = compare(history[0], history[1 : k + 1], geometry, settings)
        if comparison.state == "changed":
            history[k] = replace(history[k], clean=False)
        found.append(comparison)
    return found


def residual_warnings(torque_rms: FloatArray, clean: Sequence[bool]) -> list[tuple[int, ResidualIncrease]]:
    """Nights on which the check says that the model leaves more of the torque than on any clean night before.

    Args:
        torque_rms: (N, n) night by night; the first is the baseline's.
        clean: (N,) whether the comparison found nothing on that night.
    """
    found = []
    teaches = np.array(clean)
    for k in range(1, len(torque_rms)):
        increase = residual_increase_of(torque_rms[:k][teaches[:k]], tuple(torque_rms[k]))
        if increase:
            found.append((k, increase))
            teaches[k] = False
    return found


def largest_growth(torque_rms: FloatArray, clean: Sequence[bool]) -> dict[str, float]:
    """How near a year came to the warning: the largest ratio while little is known, and later."""
    few, later = [0.0], [0.0]
    for k in range(1, len(torque_rms)):
        before = torque_rms[:k][np.asarray(clean[:k])]
        (later if len(before) >= ENOUGH else few).append(float((torque_rms[k] / before.max(axis=0)).max()))
    return {"few": max(few), "later": max(later)}


def changes(first: int, after: int) -> dict[str, tuple[str, int | None, dict[int, Mapping[str, Any]]]]:
    """Scenario in words → effect, joint, and what the arm has besides by day."""
    days = range(first, first + after)
    wear = {
        d: {"coulomb_friction": [{"drive": 2, "change": WEAR_PER_WEEK * (d - first + 1) / 7}]} for d in days
    }
    tool = {d: {"payload": {"mass": MASS, "centre": [0.0, 0.0, 0.05]}} for d in days}
    gain = {d: {"drive_gain_error": [{"drive": 3, "change": LOST_GAIN}]} for d in days}
    return {
        "Coulomb friction of joint 2 +1 % a week": ("coulomb_friction", 2, wear),
        "0.2 kg left on the tool": ("payload", None, tool),
        "drive gain of joint 3 −5 %": ("drive_gain_error", 3, gain),
    }


def outcome(words: str, effect: str, joint: int | None, found: Sequence[Comparison]) -> Outcome:
    """When a change was found, and when it was named."""
    alarms = [k for k, one in enumerate(found) if one.state == "changed"]
    right = [
        k
        for k in alarms
        if found[k].changes and (found[k].changes[0].effect, found[k].changes[0].joint) == (effect, joint)
    ]
    said = found[right[0]].sentence if right else (found[alarms[0]].sentence if alarms else "")
    return Outcome(words, alarms[0] + 1 if alarms else None, right[0] + 1 if right else None, said)


def run_year(
    seed: int,
    nights: int,
    after: int,
    settings: DriftSettings,
    made: Bench | None = None,
    tested: int = 0,
) -> dict[str, Any]:
    """One arm: a year without a change, and each change from a fifth of the year on.

    Args:
        seed: of the arm and its year.
        nights: without a change.
        after: nights with each change; the changes are left out where 0.
        settings: of the comparison.
        made: the arm; drawn from the seed where None.
        tested: the revised test is made on every night whose number it divides; on none where 0.
    """
    made = made or bench(seed)
    start = max(nights // 5, settings.learning_nights + 3)
    found = run_nights(made, range(max(nights, start)), seed, {}, tested=tested)
    year = as_nights(found)
    quiet = judge(year, made.geometry, settings)
    clean = [True, *(one.state == "unchanged" for one in quiet)]
    told = residual_warnings(found.torque_rms, clean)
    panels, outcomes = [], []
    for words, (effect, joint, besides) in changes(start, after).items() if after else ():
        later = as_nights(run_nights(made, range(start, start + after), seed, besides))
        together = [*year[:start], *later]
        compared = judge(together, made.geometry, settings, start)
        result = outcome(words, effect, joint, compared)
        outcomes.append(result)
        panels.append(Panel.of(words, effect, joint, together, start, result.delay, made.geometry))
    return {
        "seed": seed,
        "nights": len(quiet),
        "false_alarms": [night.label for night, fine in zip(year, clean, strict=True) if not fine],
        "residual_warnings": [{"night": night, "grown": increase} for night, increase in told],
        "residual_largest": largest_growth(found.torque_rms, clean),
        "tested": len(found.verdict) - found.verdict.count(""),
        "instruments_invalid": found.verdict.count("instruments_invalid"),
        "torque_rms": found.torque_rms.tolist(),
        "changes": [asdict(one) for one in outcomes],
        "panels": panels,
    }


def rate_words(alarms: int, nights: int, settings: DriftSettings) -> str:
    """Events a year, with the exact 95 % interval of a Poisson count and the one-sided bound."""
    years = nights / settings.nights_per_year
    low = float(stats.chi2.ppf(0.025, 2 * alarms)) / 2.0 if alarms else 0.0
    high, bound = (float(stats.chi2.isf(tail, 2 * (alarms + 1))) / 2.0 for tail in (0.025, 0.05))
    interval = f"95 %: {low / years:.2f} to {high / years:.2f}, one-sided at most {bound / years:.2f}"
    return f"{alarms / years:.2f} a year per arm ({interval})"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nights", type=int, default=300)
    parser.add_argument("--after", type=int, default=21)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1], help="of the arms")
    parser.add_argument(
        "--tested", type=int, default=0, help="revised test on every night whose number it divides"
    )
    parser.add_argument("--picture", type=Path, default=None)
    parser.add_argument("--json", type=Path, default=None)
    given = parser.parse_args()
    settings = DriftSettings()
    years = []
    for seed in given.seeds:
        year = run_year(seed, given.nights, given.after, settings, tested=given.tested)
        panels = year.pop("panels")
        if given.picture is not None and not years:
            write_picture(given.picture, panels)
        years.append(year)
        if given.json is not None:  # an arm takes minutes: what is done is kept
            text = json.dumps(years, indent=2, ensure_ascii=False)
            given.json.write_text(text + "\n", encoding="utf-8")
    nights = sum(year["nights"] for year in years)
    for year in years:
        year.pop("torque_rms")
    print(json.dumps(years, indent=2, ensure_ascii=False))
    for what, count in (
        ("alarms", sum(len(year["false_alarms"]) for year in years)),
        ("warnings of a grown residual", sum(len(year["residual_warnings"]) for year in years)),
    ):
        print(f"{count} {what} in {nights} nights without a change: {rate_words(count, nights, settings)}")
    closed, tested = (sum(year[key] for year in years) for key in ("instruments_invalid", "tested"))
    print(f"{closed} of {tested} nights on which the revised test was made: instruments invalid")


if __name__ == "__main__":
    main()
