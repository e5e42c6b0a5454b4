"""What a check's report says beside its verdict: baseline, largest change, nights known, temperature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from daq.report.gates import Fact
from daq.text.numbers import NOTHING, percent, setting, significant
from robots.standard import EITHER_UNIT


def facts_of(
    compared: Mapping[str, Any],
    details: Mapping[str, Any],
    baseline: tuple[str, str],
    tonight: tuple[str, str],
    tolerance: float,
) -> tuple[Fact, ...]:
    """Of a comparison as the catalogue keeps it; without one, what would have been compared.

    Args:
        compared: tonight beside the baseline; empty where there is none.
        details: of the check.
        baseline, tonight: their runs, and a note on each.
        tolerance: share of a joint's torque.

    Raises:
        KeyError, TypeError, ValueError: another version kept it otherwise.
    """
    facts = [Fact("Baseline", baseline[0] or "none", baseline[1]), Fact("This check", *tonight)]
    if not compared:
        return tuple(facts)
    share, joint, torque = max(
        (change / max(rms, 1e-12), joint, change)
        for joint, (change, rms) in enumerate(
            zip(compared["torque_change"], compared["torque_rms"], strict=True), start=1
        )
    )
    unit = units_of(compared)[joint - 1]
    note = f"{significant(torque)} {unit} rms on joint {joint}; tolerance {limit_words(tolerance)}"
    facts.append(Fact("Largest change of torque", percent(100 * share), note))
    course = compared.get("course")
    if course is not None:
        clean, known = sum(course["clean"][:-1]), len(course["clean"]) - 1
        stage = "still being learned" if compared["stage"] == "learning" else "learned"
        facts.append(Fact("Nights known", str(known), f"{clean} of them teach what is usual; {stage}"))
    warmth = (details.get("celsius"), compared.get("colder"), compared.get("unmeasured"))
    facts.append(_temperature(*warmth))
    return tuple(facts)


def units_of(compared: Mapping[str, Any]) -> Sequence[str]:
    """Of the joints' torques; an older check did not keep them."""
    found, joints = compared.get("torque_units"), len(compared["torque_rms"])
    return found if isinstance(found, list) and len(found) == joints else [EITHER_UNIT] * joints


def limit_words(tolerance: float) -> str:
    """A tolerance in percent."""
    return f"{setting(100 * tolerance)}\u00a0%"


def _temperature(celsius: Sequence[float] | None, colder: float | None, unmeasured: str | None) -> Fact:
    if not celsius:
        return Fact("Temperature", NOTHING, "no thermometer: the hall's warmth is allowed for")
    mean = sum(celsius) / len(celsius)
    note = "" if colder is None else f"{abs(colder):.1f} K {'colder' if colder > 0 else 'warmer'} than usual"
    if unmeasured:
        note = f"that of {unmeasured} is not known, so the hall's warmth is allowed for"
    return Fact("Temperature", f"{mean:.1f}\u00a0°C", note)
