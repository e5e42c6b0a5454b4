"""Tables of a diagnosis: gap, relative errors and gate 1, each before and after."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from daq.diagnosis.diagnosis_words import gate_state, gate_words
from daq.text.numbers import percent, significant
from ident.discrepancy import Gap
from ident.discrepancy.before_after import ModelCheck
from robots.arrays import FloatArray


@dataclass(frozen=True)
class GapRow:
    """One joint's gap: numbers and a bar."""

    joint: str
    before: str
    after: str
    floor: str
    picture: Markup


@dataclass(frozen=True)
class ErrorRow:
    """One joint's relative errors, % before and after, with a bar."""

    joint: str
    identified: tuple[str, str]
    moving: tuple[str, str]
    held_out: tuple[str, str]
    picture: Markup


@dataclass(frozen=True)
class GateChange:
    """Gate 1 without and with the effect: state, sentence."""

    before: str
    after: str
    words: str


def gate_change(before: ModelCheck, after: ModelCheck) -> GateChange:
    """Gate 1 of a model and of the next one."""
    return GateChange(gate_state(before), gate_state(after), gate_words(before, after))


def error_rows(before: ModelCheck, after: ModelCheck, joints: list[str]) -> tuple[ErrorRow, ...]:
    """Relative errors per joint; the bars are those on moving rows, on one scale for all joints."""
    largest = float(max(np.nanmax(before.moving), np.nanmax(after.moving))) or 1.0

    def texts(one: FloatArray, other: FloatArray, j: int) -> tuple[str, str]:
        return percent(float(one[j])), percent(float(other[j]))

    return tuple(
        ErrorRow(
            joint,
            texts(before.identified, after.identified, j),
            texts(before.moving, after.moving, j),
            texts(before.held_out, after.held_out, j),
            _bar(100.0 * float(before.moving[j]) / largest, 100.0 * float(after.moving[j]) / largest, None),
        )
        for j, joint in enumerate(joints)
    )


def gap_rows(gap: Gap, joints: list[str], units: list[str]) -> tuple[GapRow, ...]:
    """Bars from zero to the joint's own largest level."""
    rows = []
    for j, joint in enumerate(joints):
        before, after, floor = float(gap.before[j]), float(gap.after[j]), float(gap.floor[j])
        largest = max(x for x in (before, after, floor) if np.isfinite(x)) or 1.0
        picture = _bar(
            100.0 * before / largest,
            100.0 * after / largest,
            100.0 * floor / largest if np.isfinite(floor) else None,
        )
        unit = units[j]
        rows.append(
            GapRow(
                joint,
                f"{significant(before)} {unit}",
                f"{significant(after)} {unit}",
                f"{significant(floor)} {unit}" if np.isfinite(floor) else "not known",
                picture,
            )
        )
    return tuple(rows)


def _bar(before: float, after: float, floor: float | None) -> Markup:
    """Hollow before, filled after, a line at the floor; all in percent of the width."""
    line = ""
    if floor is not None:
        line = f'<line class="floor" x1="{floor:.1f}%" x2="{floor:.1f}%" y1="0" y2="18"/>'
    return Markup(  # noqa: S704
        '<svg class="bar" aria-hidden="true">'
        f'<rect class="before" y="3" height="12" width="{before:.1f}%"/>'
        f'<rect class="after" y="6" height="6" width="{after:.1f}%"/>{line}</svg>'
    )
