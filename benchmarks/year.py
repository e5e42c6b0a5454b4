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
from ident.drift import Comparison, DriftSettings, Geometry, Night, compare

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
    seed: int, nights: int, after: int, settings: DriftSettings, made: Bench | None = None
) -> dict[str, Any]:
    """One arm: a year without a change, and each change from a fifth of the year on."""
    made = made or bench(seed)
    start = max(nights // 5, settings.learning_nights + 3)
    year = as_nights(run_nights(made, range(max(nights, start)), seed, {}))
    clean = judge(year, made.geometry, settings)
    false = [year[k + 1].label for k, one in enumerate(clean) if one.state == "changed"]
    panels, outcomes = [], []
    for words, (effect, joint, besides) in changes(start, after).items():
        later = as_nights(run_nights(made, range(start, start + after), seed, besides))
        together = [*year[:start], *later]
        found = judge(together, made.geometry, settings, start)
        result = outcome(words, effect, joint, found)
        outcomes.append(result)
        panels.append(Panel.of(words, effect, joint, together, start, result.delay, made.geometry))
    return {
        "seed": seed,
        "nights": len(clean),
        "false_alarms": false,
        "changes": [asdict(one) for one in outcomes],
        "panels": panels,
    }


def rate_words(alarms: int, nights: int, settings: DriftSettings) -> str:
    """False alarms a year, with the one-sided 95 % bound of a Poisson count."""
    years = nights / settings.nights_per_year
    bound = float(stats.chi2.isf(0.05, 2 * (alarms + 1))) / 2.0
    return f"{alarms / years:.2f} a year per arm, at most {bound / years:.2f} (95 %)"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nights", type=int, default=300)
    parser.add_argument("--after", type=int, default=21)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1], help="of the arms")
    parser.add_argument("--picture", type=Path, default=None)
    parser.add_argument("--json", type=Path, default=None)
    given = parser.parse_args()
    settings = DriftSettings()
    years = []
    for seed in given.seeds:
        year = run_year(seed, given.nights, given.after, settings)
        panels = year.pop("panels")
        if given.picture is not None and not years:
            write_picture(given.picture, panels)
        years.append(year)
        if given.json is not None:  # an arm takes minutes: what is done is kept
            text = json.dumps(years, indent=2, ensure_ascii=False)
            given.json.write_text(text + "\n", encoding="utf-8")
    nights = sum(year["nights"] for year in years)
    alarms = sum(len(year["false_alarms"]) for year in years)
    print(json.dumps(years, indent=2, ensure_ascii=False))
    print(f"{alarms} alarms in {nights} nights without a change: {rate_words(alarms, nights, settings)}")


if __name__ == "__main__":
    main()
