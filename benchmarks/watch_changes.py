"""Changes in the simulated years of ``benchmarks/watch.py``: steps and wear, judged night after night."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.watch_arms import DRIVE, SIMULATED, Arm, Year
from daq.check.residual import residual_increase_of
from ident.drift import Comparison, DriftSettings, Geometry, Night, Pattern, compare, patterns_of
from ident.drift.patterns import warmth_share
from robots.arrays import FloatArray

SETTINGS = DriftSettings()
STARTS = (1, 4, 12, 25, 40, 120, 280)
"""Nights on which a step begins: four of them while the arm is still being learned."""
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
WEAR: dict[str, tuple[str, int | None]] = {
    "Coulomb friction wears": ("coulomb_friction", DRIVE),
    "viscous friction wears": ("viscous_friction", DRIVE),
    "payload grows": ("payload", None),
    "drive gain drifts": ("drive_gain_error", 3),
    "torque offset drifts": ("current_offset", DRIVE),
}
GROWING = {f"{kind} grows": kind for kind in SIMULATED}
WEAR_STARTS = (1, 15, 60, 200)
WEAR_NIGHTS, WEAR_SHARE, WEAR_SIZE, WEAR_STEP = 120, 0.25, 2.0, 3
"""Wear reaches a quarter of the torque, or twice what is hidden in the plant; every third night is judged."""
PATIENCE = 2
"""Judged nights after the first one that is told on which the right name still counts."""
LATER = 12
"""Once it was told and named, every twelfth night is judged."""
NEAR = 1.25
"""Within such a factor of a limit (tolerance, 15 K) either verdict is right."""


@dataclass
class Outcome:
    """One change on one arm.

    Attributes:
        kind, hall, start, share: what was done; share of the joint's torque, of wear at its end.
        delay: nights to the first one that is not fine, 1 for the first with the change; None where all were.
        right: whether effect and joint were named first, then or within two nights.
        shape_right: whether step or ramp was said then.
        since_off: nights by which the change point was off then.
        serious, serious_fine: judged nights beyond twice the tolerance, and those of them that were fine.
        verdicts, wrong: judged nights that were told, and those of them whose verdict is not due.
        verdict: of the first night that is not fine.
        share_told: share of the joint's torque that had changed by then.
        sentence: then.
    """

    kind: str
    hall: str
    start: int
    share: float
    delay: int | None = None
    right: bool = False
    shape_right: bool = False
    since_off: int | None = None
    serious: int = 0
    serious_fine: int = 0
    verdicts: int = 0
    wrong: list[str] = field(default_factory=list)
    verdict: str = "ok"
    share_told: float = 0.0
    sentence: str = ""


@dataclass(frozen=True)
class Change:
    """What is done to an arm: effect and joint, step or ramp, and (N,) share of the joint's torque."""

    effect: str
    joint: int | None
    shape: str
    start: int
    course: FloatArray


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


def torque_share(geometry: Geometry, change: FloatArray) -> float:
    """Largest share of a joint's torque that a change (b,) makes."""
    return float(np.max(geometry.torque_rms(change) / geometry.torque_rms(geometry.beta)))


def pattern_of(arm: Arm, effect: str, joint: int | None) -> Pattern:
    """The effect at its joint."""
    return next(p for p in patterns_of(arm.geometry) if (p.effect, p.joint) == (effect, joint))


def direction_of(arm: Arm, effect: str, joint: int | None) -> FloatArray:
    """(b,) per share of torque: a friction, an offset or a gain by itself, a payload 5 cm off the flange."""
    pattern = pattern_of(arm, effect, joint)
    direction = np.array(pattern.directions[:, 0])
    if effect == "payload":
        direction = direction + 0.05 * pattern.directions[:, -1]
    return direction / torque_share(arm.geometry, direction)


def verdicts_due(arm: Arm, change: Change, share: float, measured: bool) -> tuple[str, ...]:
    """Verdicts that are right for a change of so much torque, as docs/how-to/schedule.md has them.

    Beyond the tolerance a failure, else a warning; without a thermometer a change of friction that a hall
    may make (15 K at the largest likely coefficient) is never a failure. A new effect is a warning at least.
    """
    if change.effect == "residual":
        return ("warning", "failed")
    both = ("warning", "failed")
    due = both
    if share < SETTINGS.tolerance / NEAR:
        due = ("warning",)
    elif share > SETTINGS.tolerance * NEAR:
        due = ("failed",)
    coefficient, sigma = warmth_share(change.effect, SETTINGS)
    if measured or not coefficient or due == ("warning",):
        return due
    pattern = pattern_of(arm, change.effect, change.joint)
    per_unit = torque_share(arm.geometry, pattern.directions[:, 0])
    kelvin = share / per_unit / abs(float(pattern.scale or np.inf)) / (coefficient + 3.0 * sigma)
    if kelvin < SETTINGS.possible_warmth / NEAR:
        return ("warning",)
    return due if kelvin > SETTINGS.possible_warmth * NEAR else both


def step_outcome(
    arm: Arm, hall: str, year: Year, kind: str, start: int, share: float, nights_after: int = 12
) -> Outcome:
    """A step: a parameter moves, or what is left of the torque grows."""
    factor = np.ones(arm.geometry.joints)
    effect, joint = "residual", DRIVE
    if kind in SIMULATED:
        moved, factor = arm.shift_of(kind, 1.0)
        share = torque_share(arm.geometry, moved)
    else:
        effect, joint, sign = KINDS[kind]  # type: ignore[assignment]
        moved = sign * share * direction_of(arm, effect, joint)
    size = min(start + nights_after, len(year.values))
    changed = _first(year, size)
    changed.values[start:] += moved
    changed.torque_rms[start:] *= factor
    course = np.r_[np.zeros(start), np.full(size - start, share)]
    return judged(arm, hall, changed, kind, Change(effect, joint, "step", start, course), 1)


def wear_outcome(arm: Arm, hall: str, year: Year, kind: str, start: int) -> Outcome:
    """A ramp, judged every third night."""
    size = min(start + WEAR_NIGHTS, len(year.values))
    grown = np.r_[np.zeros(start), np.arange(1, size - start + 1) / WEAR_NIGHTS]
    worn = _first(year, size)
    effect, joint = WEAR.get(kind, ("residual", DRIVE))
    if kind in GROWING:
        moved, factor = arm.shift_of(GROWING[kind], WEAR_SIZE * grown)
        course = np.array([torque_share(arm.geometry, one) for one in moved])
        worn.values[:] += moved
        worn.torque_rms[:] *= factor
    else:
        course = WEAR_SHARE * grown
        worn.values[:] += course[:, None] * direction_of(arm, effect, joint)
    return judged(arm, hall, worn, kind, Change(effect, joint, "ramp", start, course), WEAR_STEP)


def _first(year: Year, size: int) -> Year:
    celsius = None if year.celsius is None else year.celsius[:size]
    return Year(year.values[:size].copy(), celsius, year.torque_rms[:size].copy())


def judged(arm: Arm, hall: str, year: Year, kind: str, change: Change, step: int) -> Outcome:
    """Judge night after night; what is told teaches nothing, nor do the nights up to the next judged."""
    nights, geometry = as_nights(arm, year), baseline_geometry(arm, year)
    out = Outcome(kind, hall, change.start, float(change.course[-1]))
    told, clean = None, True
    for k in range(change.start, len(nights)):
        wait = step if told is None or k <= told + PATIENCE * step else LATER
        if (k - change.start) % wait and k != len(nights) - 1:
            nights[k] = replace(nights[k], clean=clean)
            continue
        found = compare(nights[0], nights[1 : k + 1], geometry, SETTINGS)
        taught = [i for i in range(k) if nights[i].clean]
        increase = residual_increase_of(year.torque_rms[taught], tuple(year.torque_rms[k]))
        verdict = verdict_of(found, bool(increase))
        clean = verdict == "ok"
        nights[k] = replace(nights[k], clean=clean)
        share = float(change.course[k])
        if share > 2.0 * SETTINGS.tolerance:
            out.serious, out.serious_fine = out.serious + 1, out.serious_fine + clean
        if clean:
            continue
        if told is None:
            told, out.delay, out.verdict, out.share_told = k, k - change.start + 1, verdict, share
            out.sentence = found.sentence if found.state == "changed" else "residual"
        if k <= told + PATIENCE * step and not out.right:
            _name(out, found, increase, change)
        out.verdicts += 1
        due = verdicts_due(arm, change, share, year.celsius is not None)
        if verdict not in due:
            out.wrong.append(f"{share:.3f} {verdict} for {due[0]}: {found.sentence}")
    return out


def _name(out: Outcome, found: Comparison, increase: Any, change: Change) -> None:
    out.right = named_right(found, increase, change.effect, change.joint)
    if found.since is not None:
        out.shape_right = found.since.shape == change.shape
        out.since_off = found.since.index - change.start


def named_right(
    found: Comparison, increase: Sequence[tuple[int, float]], effect: str, joint: int | None
) -> bool:
    """The effect at its joint comes first; where no parameter shows it, the joint with the grown residual."""
    if effect == "residual":
        return bool(increase) and max(increase, key=lambda pair: pair[1])[0] == joint
    return bool(found.changes) and (found.changes[0].effect, found.changes[0].joint) == (effect, joint)
