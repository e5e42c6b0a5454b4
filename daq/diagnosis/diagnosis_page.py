"""The page of one diagnosis: what is missing, where it lives, how sure that is, the gap before and after."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from daq.diagnosis.diagnosis_json import trajectory_name
from daq.diagnosis.diagnosis_words import (
    gate_state,
    gate_words,
    headline,
    recommendation,
    share_words,
    unit_of_quantity,
)
from daq.diagnosis.telling_apart import TellingApart
from daq.report.numbers import correlation, percent, probability, significant, with_sigma
from daq.report.page import ReportError
from daq.report.parameters import joint_heading
from daq.report.pictures import Tick, icon, nice_ticks, scaled, tick_text, trace_path
from daq.report.traces import pixels_per_trace
from ident.discrepancy import Candidate, Diagnosis, Finding, FoundParameter, Gap
from ident.discrepancy.before_after import ModelCheck, Series
from ident.discrepancy.portrait import Portrait
from ident.effects.vocabulary import family_named
from robots.arrays import FloatArray
from robots.description import Robot


@dataclass(frozen=True)
class DiagnosisContent:
    """Everything that the page shows."""

    title: str
    robot: Robot
    diagnosis: Diagnosis
    series: Series
    apart: tuple[TellingApart, ...] = ()
    facts: Mapping[str, str] = field(default_factory=dict)
    """How it was made, label → text, in the order shown."""


@dataclass(frozen=True)
class Plot:
    """Lines in plot units (1000 × 400) with labels of both axes; ``lines`` are (class, path)."""

    heading: str
    description: str
    unit: str
    lines: tuple[tuple[str, str], ...]
    ticks: tuple[Tick, ...]
    along: tuple[Tick, ...]
    along_unit: str


@dataclass(frozen=True)
class GapRow:
    """One joint's gap: numbers and a bar."""

    joint: str
    before: str
    after: str
    floor: str
    picture: Markup


@dataclass(frozen=True)
class RankRow:
    """One candidate: what, how much it explains, its bar, and whether it is in the set."""

    words: str
    score: str
    explained: str
    picture: Markup
    state: str


@dataclass(frozen=True)
class FindingView:
    """One finding as the template shows it."""

    number: int
    words: str
    sentence: str
    mode: str
    p_value: str
    closed: str
    parameters: tuple[tuple[str, ...], ...]
    here: tuple[Plot, ...]
    elsewhere: tuple[Plot, ...]
    ranking: tuple[RankRow, ...]
    errors: tuple[ErrorRow, ...]
    gate: GateChange
    gap: tuple[GapRow, ...]
    apart: TellingApart | None
    pairs: tuple[tuple[str, str, str], ...]
    file: str


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


_KIND = {"clean": "good", "named": "switch", "ambiguous": "unknown", "unnamed": "bad"}
_ICON = {"clean": "good", "named": "switch", "ambiguous": "unknown", "unnamed": "bad"}
_MODES = {
    "prior": "against a model that existed before",
    "refit": "after a refit of the base parameters",
}


def write_diagnosis_page(path: Path, content: DiagnosisContent) -> None:
    """Write the page: one HTML file that needs no other file and no network.

    Raises:
        ReportError: the file cannot be written.
    """
    try:
        path.write_text(render_diagnosis(content), encoding="utf-8", newline="\n")
    except OSError as error:
        raise ReportError(f"cannot write page {path}: {error.strerror}") from error


def render_diagnosis(content: DiagnosisContent) -> str:
    """The page as text."""
    environment = Environment(
        loader=PackageLoader("daq", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    diagnosis, robot = content.diagnosis, content.robot
    joints = [joint_heading(j, joint.name) for j, joint in enumerate(robot.joint)]
    return environment.get_template("diagnosis.html.j2").render(
        title=content.title,
        kind=_KIND[diagnosis.verdict],
        icon=icon(_ICON[diagnosis.verdict]),  # type: ignore[arg-type]
        verdict=diagnosis.verdict,
        headline=headline(diagnosis),
        recommendation=recommendation(diagnosis),
        findings=[_finding(k, found, content, joints) for k, found in enumerate(diagnosis.findings, start=1)],
        gate=_gate_change(content.series.checks[0], content.series.checks[-1]),
        torque=_gap_rows(diagnosis.torque, joints, _torque_unit(robot)),
        position=None
        if diagnosis.position is None
        else _gap_rows(diagnosis.position, joints, _position_unit(robot)),
        loop_reason=diagnosis.loop_reason,
        loop=_loop_plots(diagnosis, joints, robot),
        quantities=[name for name, _ in diagnosis.habitats[0].shares],
        habitats=[
            (joints[place.joint], significant(place.rms), [_share(share) for _, share in place.shares])
            for place in diagnosis.habitats
        ],
        unrepeated=[item.sentence for item in diagnosis.unrepeated],
        facts=content.facts,
    )


def _torque_unit(robot: Robot) -> list[str]:
    return ["N" if joint.kind == "prismatic" else "N·m" for joint in robot.joint]


def _position_unit(robot: Robot) -> list[str]:
    return ["m" if joint.kind == "prismatic" else "rad" for joint in robot.joint]


def _share(share: float) -> tuple[str, float]:
    """Text of a share of variance, and how dark its cell is (0 to 1)."""
    return (f"{100 * share:.0f}", round(min(max(share, 0.0), 1.0), 2))


def _finding(number: int, finding: Finding, content: DiagnosisContent, joints: list[str]) -> FindingView:
    robot, (before, after) = content.robot, content.series.checks[number - 1 : number + 1]
    shown = {joint - 1 for joint in finding.joints} or {finding.portrait.joint}
    pictures = content.series.portraits[number - 1]
    apart = next((item for item in content.apart if item.number == number), None)
    return FindingView(
        number=number,
        words=finding.words(),
        sentence=finding.sentence,
        mode=_MODES[finding.mode],
        p_value=probability(finding.p_value),
        closed=percent(100.0 * finding.held_out_gain),
        parameters=tuple(_parameter_row(p) for p in finding.parameters),
        here=tuple(_portrait(one, joints, robot) for one in pictures if one.joint in shown),
        elsewhere=tuple(_portrait(one, joints, robot) for one in pictures if one.joint not in shown),
        ranking=_ranking(finding),
        errors=_error_rows(before, after, joints),
        gate=_gate_change(before, after),
        gap=_gap_rows(finding.gap, joints, _torque_unit(robot)),
        apart=apart,
        pairs=_pairs(apart),
        file=trajectory_name(number),
    )


def _parameter_row(parameter: FoundParameter) -> tuple[str, ...]:
    unit = "" if parameter.unit == "1" else parameter.unit
    if parameter.value == 0.0 and parameter.sigma == 0.0:
        return parameter.name, "not seen", "", ""
    return (parameter.name, *with_sigma(parameter.value, parameter.sigma), unit)


def _pairs(apart: TellingApart | None) -> tuple[tuple[str, str, str], ...]:
    """What a planned motion does for each pair: the pair, correlation before and after."""
    if apart is None or apart.discrimination is None:
        return ()
    found = apart.discrimination
    return tuple(
        (f"{last.first} – {last.second}", correlation(first.correlation), correlation(last.correlation))
        for first, last in zip(found.separation_before, found.separation_after, strict=True)
    )


def _gate_change(before: ModelCheck, after: ModelCheck) -> GateChange:
    return GateChange(gate_state(before), gate_state(after), gate_words(before, after))


def _error_rows(before: ModelCheck, after: ModelCheck, joints: list[str]) -> tuple[ErrorRow, ...]:
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


def _ranking(finding: Finding) -> tuple[RankRow, ...]:
    """Candidates with bars from zero to the best score; those that cannot be told apart are marked."""
    alike = {candidate.words() for candidate in finding.indistinguishable_from}
    shown = [c for c in finding.ranking if c.score > 0] or list(finding.ranking[:1])
    named = _named(finding, shown)
    best = max((c.score for c in shown), default=1.0) or 1.0
    rows = []
    for candidate in shown:
        words = candidate.words()
        state = "named" if words == named else "alike" if words in alike else "other"
        if state == "other" and _contains(candidate, finding):
            state = "general"
        width = max(0.0, min(100.0, 100.0 * candidate.score / best))
        bound = max(0.0, min(100.0, 100.0 * finding.threshold / best))
        picture = Markup(  # noqa: S704
            f'<svg class="bar {state}" aria-hidden="true"><rect y="4" height="10" width="{width:.1f}%"/>'
            f'<line x1="{bound:.1f}%" x2="{bound:.1f}%" y1="0" y2="18"/></svg>'
        )
        rows.append(
            RankRow(words, significant(candidate.score), share_words(candidate.explained), picture, state)
        )
    return tuple(rows)


def _contains(candidate: Candidate, finding: Finding) -> bool:
    """Whether the named effect is a limit of the candidate: friction that drifts may also not drift."""
    if len(candidate.effects) > 1 or candidate.joints[0][-1:] != finding.joints[-1:]:
        return False
    return finding.effect in family_named(candidate.effects[0]).contains


def _named(finding: Finding, shown: list[Candidate]) -> str:
    for candidate in shown:
        if candidate.effects == (finding.effect,) and candidate.joints == (finding.joints,):
            return candidate.words()
    return ""


def _gap_rows(gap: Gap, joints: list[str], units: list[str]) -> tuple[GapRow, ...]:
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


def _portrait(picture: Portrait, joints: list[str], robot: Robot) -> Plot:
    kind = robot.joint[picture.joint].kind
    series = (("m", picture.before), ("p", picture.added), ("d", picture.after))
    unit = "N" if kind == "prismatic" else "N·m"
    along_unit = unit_of_quantity(picture.quantity, kind)
    return _plot(
        f"{joints[picture.joint]} against {picture.quantity}",
        unit,
        along_unit,
        picture.centre,
        series,
        pixels_per_trace(4),
        ticks=2,
    )


def _loop_plots(diagnosis: Diagnosis, joints: list[str], robot: Robot) -> list[Plot]:
    loop = diagnosis.loop
    if loop is None:
        return []
    pixels = pixels_per_trace(2 * len(joints))
    return [
        _plot(
            joint,
            _position_unit(robot)[j],
            "s",
            loop.time,
            (("m", loop.before[:, j]), ("p", loop.after[:, j])),
            pixels,
        )
        for j, joint in enumerate(joints)
    ]


def _plot(
    heading: str,
    unit: str,
    along_unit: str,
    along: FloatArray,
    series: tuple[tuple[str, FloatArray], ...],
    pixels: int,
    ticks: int = 5,
) -> Plot:
    values = np.concatenate([trace for _, trace in series])
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = 0.06 * (high - low) or abs(high) or 1.0
    low, high = low - margin, high + margin
    a0, a1 = float(along[0]), float(along[-1])
    a1 = a1 if a1 > a0 else a0 + 1.0
    up, right = nice_ticks(low, high, 3), nice_ticks(a0, a1, ticks)
    return Plot(
        heading=heading,
        description=f"{heading}, in {unit}, from {significant(a0)} to {significant(a1)} {along_unit}",
        unit=unit,
        lines=tuple(
            (style, trace_path(along, trace, (a0, a1, low, high), pixels)) for style, trace in series
        ),
        ticks=tuple(Tick(100.0 - scaled(v, (low, high)), tick_text(v, up)) for v in up),
        along=tuple(Tick(scaled(v, (a0, a1)), tick_text(v, right)) for v in right),
        along_unit=along_unit,
    )
