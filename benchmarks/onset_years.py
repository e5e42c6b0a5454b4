"""Since which night, and what it was: simulated years with one change, or none, each.

``python -m benchmarks.onset_years --arms 520 521 522 523 --years 50 --json onset_years.json`` (half an hour
on one core) gives the figures of benchmarks/onset.md.

Nights are drawn as estimates (``benchmarks/watch_arms.py``). In each year one thing happens on a night
between 30 and 300, on a drive, of a size and in a hall that are drawn: friction wears, friction steps, a
load is taken up, the heating fails, or nothing but the seasons. Every night is judged from then on (of a
year in which nothing happens, all of them), and what is told teaches nothing. Scored are the first night
that is told and the sixtieth after the change.
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

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.naming_report import share
from benchmarks.watch import interval, quiet_alarms
from benchmarks.watch_arms import HALLS, Arm, Year, arm_of, year_of
from benchmarks.watch_changes import SETTINGS, as_nights, baseline_geometry, direction_of, verdict_of
from daq.check.residual import residual_increase_of
from ident.drift import Comparison, Night, compare
from ident.drift.patterns import WARMTH
from robots.arrays import FloatArray

HAPPENS = ("friction wears", "friction steps", "load", "warmth", "nothing")
FRICTIONS = ("coulomb_friction", "viscous_friction")
FIRST, LAST, AFTER = 30, 300, 60
SMALLEST, LARGEST = 0.05, 0.25
"""Share of a joint's torque: of a step, and of wear on the sixtieth night."""
COLDER = 10.0


@dataclass
class Said:
    """What one night says.

    Attributes:
        night: nights since the change; 0 is its first.
        what: one of ``HAPPENS``, or the effect where it is another.
        place: whether the joint is the right one.
        off: nights by which the beginning is off.
        holds: whether the interval holds the beginning.
        width: nights in the interval.
        sentence: as it was told.
    """

    night: int
    what: str
    place: bool
    off: int | None
    holds: bool | None
    width: int | None
    sentence: str


@dataclass
class Told:
    """One year: what happened, and what the first night that was told, and the last, say."""

    arm: int
    hall: str
    happens: str
    effect: str
    joint: int | None
    start: int
    share: float
    nights: int
    alarms: int
    first: Said | None
    last: Said | None


def what_is_said(found: Comparison) -> tuple[str, str, int | None]:
    """One of ``HAPPENS`` where it is one of them, the effect and the joint."""
    if found.state != "changed" or not found.changes:
        return ("something" if found.state == "changed" else "nothing"), "", None
    leading = found.changes[0]
    if leading.effect == WARMTH:
        return "warmth", leading.effect, leading.joint
    if leading.effect == "payload":
        return "load", leading.effect, None
    if leading.effect in FRICTIONS and found.since is not None:
        grows = found.since.shape == "ramp"
        return ("friction wears" if grows else "friction steps"), leading.effect, leading.joint
    return leading.effect, leading.effect, leading.joint


def night_of(label: str) -> int:
    """Number of a night from its label."""
    return int(label.rsplit(" ", 1)[1])


def said_of(found: Comparison, night: int, start: int, effect: str, joint: int | None) -> Said:
    """What a night says beside what happened."""
    what, of, at = what_is_said(found)
    right = (of, at) == (effect, joint)
    if found.since is None:
        return Said(night - start, what, right, None, None, None, found.sentence)
    first, last = night_of(found.since.earliest), night_of(found.since.latest)
    off = found.since.index - start
    return Said(night - start, what, right, off, first <= start <= last, last - first + 1, found.sentence)


def happened(
    arm: Arm, year: Year, happens: str, rng: np.random.Generator, start: int
) -> tuple[str, int | None, float]:
    """Put what happens into the nights; its effect, joint and share of the torque."""
    share = float(np.exp(rng.uniform(np.log(SMALLEST), np.log(LARGEST))))
    joint, friction = int(rng.integers(1, arm.geometry.joints + 1)), str(rng.choice(FRICTIONS))
    since = np.arange(len(year.values)) - start
    if happens == "load":
        effect, place, course = "payload", None, (since >= 0).astype(float)
    elif happens == "friction steps":
        effect, place, course = friction, joint, (since >= 0).astype(float)
    elif happens == "friction wears":
        effect, place, course = friction, joint, np.maximum(since + 1, 0) / (AFTER + 1.0)
    else:
        return "", None, 0.0
    moved: FloatArray = share * direction_of(arm, effect, place)
    year.values[:] += course[:, None] * moved
    return effect, place, share


def told_of(seed: int, arm: Arm, number: int) -> Told:
    """One year of one arm."""
    rng = np.random.default_rng([seed, number, 0x515])
    happens, hall = HAPPENS[number % len(HAPPENS)], str(rng.choice(list(HALLS)))
    start = int(rng.integers(FIRST, LAST + 1))
    quiet = happens == "nothing"
    size = 366 if quiet else start + AFTER + 1
    colder = start if happens == "warmth" else 10_000
    year = year_of(arm, HALLS[hall], size, 1_000_000 + 1000 * seed + number, colder, COLDER)
    effect, joint, share = happened(arm, year, happens, rng, start)
    nights, geometry = as_nights(arm, year), baseline_geometry(arm, year)
    out = Told(seed, hall, happens, effect, joint, start, share, size - 1, 0, None, None)
    if quiet:
        alarms = [night for night, _ in quiet_alarms(arm, year)]
        return replace(out, alarms=sum(night - 1 not in alarms for night in alarms))
    for night in range(start, size):
        found = compare(nights[0], nights[1 : night + 1], geometry, SETTINGS)
        fine = verdict_of(found, _left_more(nights, year, night)) == "ok"
        nights[night] = replace(nights[night], clean=fine)
        if found.state == "changed" or night == size - 1:
            out.last = said_of(found, night, start, effect, joint)
        if found.state == "changed":
            out.first = out.first or out.last
    return out


def _left_more(nights: Sequence[Night], year: Year, night: int) -> bool:
    taught = [i for i in range(night) if nights[i].clean]
    return bool(residual_increase_of(year.torque_rms[taught], tuple(year.torque_rms[night])))


def line_of(happens: str, years: Sequence[Told]) -> str:
    """A row of the table."""
    told = [one for one in years if one.first is not None]
    last = [one.last for one in told if one.last is not None and one.last.what != "nothing"]
    off = [abs(one.off) for one in last if one.off is not None]
    delays = [one.first.night + 1 for one in told if one.first is not None]
    cells = [
        happens,
        share(one.first is not None for one in years),
        f"{np.median(delays):.0f} ({max(delays)})" if delays else "–",
        share(bool(one.first and one.first.what == one.happens) for one in told),
        share(bool(one.last and one.last.what == one.happens) for one in told),
        share(one.place for one in last),
        f"{np.median(off):.0f} ({max(off)})" if off else "–",
        share(bool(one.holds) for one in last),
        f"{np.median([one.width for one in last if one.width is not None]):.0f}" if off else "–",
    ]
    return "| " + " | ".join(cells) + " |"


def summary(years: Sequence[Told]) -> list[str]:
    """The table, and what the years without a change say."""
    lines = [
        "| happens | told | first told, night (most) | kind at first | kind after sixty nights"
        " | effect and joint | beginning off, nights (most) | interval holds it | its width, nights |",
        "|---" * 9 + "|",
    ]
    lines += [line_of(h, [one for one in years if one.happens == h]) for h in HAPPENS[:3]]
    all_changed = [one for one in years if one.happens in HAPPENS[:3]]
    lines.append(line_of("all three", all_changed))
    cold = [one for one in years if one.happens == "warmth"]
    blamed = [bool(one.last and one.last.what not in ("nothing", "warmth")) for one in cold]
    lines.append(f"heating fails: something else blamed {share(blamed)}")
    right = [bool(one.last and one.last.what == one.happens) for one in all_changed if one.first is not None]
    lines.append(f"told apart, of those told and the cold: {share([*right, *(not one for one in blamed)])}")
    quiet = [one for one in years if one.happens == "nothing"]
    if quiet:
        alarms, span = sum(one.alarms for one in quiet), sum(one.nights for one in quiet) / 365.0
        lines.append(f"nothing but seasons, {span:.0f} years: alarms {interval(alarms, span)}")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--arms", type=int, nargs="+", default=[0])
    parser.add_argument("--years", type=int, default=10, help="of each arm")
    parser.add_argument("--folder", type=Path, default=Path("arms"), help="keeps the simulated arms")
    parser.add_argument("--json", type=Path, default=None)
    given = parser.parse_args()
    years: list[Told] = []
    for seed in given.arms:
        arm = arm_of(seed, given.folder)
        for number in range(given.years):
            years.append(told_of(seed, arm, number))
            print(_words(years[-1]), file=sys.stderr, flush=True)
            if given.json is not None:
                kept: list[dict[str, Any]] = [asdict(one) for one in years]
                given.json.write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    print("\n".join(summary(years)))


def _words(one: Told) -> str:
    said = "nothing" if one.last is None else f"{one.last.what}, off {one.last.off}, holds {one.last.holds}"
    what = f"{one.happens} {one.effect} {one.joint} {one.share:.2f} night {one.start}"
    return f"arm {one.arm}, {one.hall}: {what}: {said}"


if __name__ == "__main__":
    main()
