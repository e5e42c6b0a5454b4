"""What a person sees of a diagnosis on the terminal: findings, gap, verdict last."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from daq.diagnosis.blind_spots import BlindSpot
from daq.diagnosis.diagnosis_words import (
    confirmed_words,
    gate_words,
    headline,
    recommendation,
    sentence_of,
    share_words,
    spaced,
)
from daq.diagnosis.ranking_table import candidate_rows
from daq.diagnosis.telling_apart import TellingApart
from daq.diagnosis.unexplained_table import unexplained_remarks, unexplained_rows
from daq.text.numbers import percent, probability, significant, with_sigma
from ident.discrepancy import Diagnosis, Finding, Gap
from ident.discrepancy.before_after import ModelCheck

_COLOURS = {
    "clean": "green",
    "named": "cyan",
    "ambiguous": "yellow",
    "not_confirmed": "red",
    "unnamed": "red",
}


def print_diagnosis(
    console: Console,
    diagnosis: Diagnosis,
    checks: Sequence[ModelCheck],
    apart: Sequence[TellingApart],
    blind: Sequence[BlindSpot] = (),
) -> None:
    """Print findings and gaps, then what it all means.

    Args:
        console: where a person reads.
        diagnosis: of the search.
        checks: of the model before anything was found and after each finding.
        apart: what to do about each ambiguous finding.
        blind: what these recordings could not have shown.
    """
    for number, finding in enumerate(diagnosis.findings, start=1):
        console.print(_finding_table(number, finding))
        console.print(sentence_of(confirmed_words(finding)), highlight=False, markup=False)
        console.print(_ranking_table(finding))
        console.print(_error_table(checks[number - 1], checks[number]))
        _print_gate(console, checks[number - 1], checks[number])
    if not diagnosis.findings:
        console.print(_error_table(checks[0], checks[0]))
        _print_gate(console, checks[0], checks[0])
    _print_left(console, diagnosis)
    console.print(_gap_table("Torque gap on the validation recordings, rms", diagnosis.torque))
    if diagnosis.position is not None:
        console.print(_gap_table("Position gap of the closed loop, rms", diagnosis.position))
    elif diagnosis.loop_reason:
        console.print(f"Closed loop not simulated: {diagnosis.loop_reason}", highlight=False, markup=False)
    for item in diagnosis.unrepeated:
        console.print(f"[yellow]does not repeat:[/] {item.sentence}", highlight=False)
    word = f"[bold {_COLOURS[diagnosis.verdict]}]{spaced(diagnosis.verdict).upper()}[/]"
    console.print(f"\n{word}   {headline(diagnosis)}", highlight=False)
    console.print(recommendation(diagnosis), highlight=False, markup=False)
    for ambiguous in apart:
        _print_apart(console, ambiguous)
    if blind:
        console.print("Could be there unseen:")
    for spot in blind:
        console.print(f"  {spot.words()}", highlight=False, markup=False)


def _print_left(console: Console, diagnosis: Diagnosis) -> None:
    """What the model does not have and does not explain."""
    for finding in diagnosis.rejected:
        words = f"Left out of the model: {spaced(finding.words())}; {confirmed_words(finding)}"
        console.print(words, highlight=False, markup=False)
    if not diagnosis.findings:
        console.print(_candidate_table(diagnosis))
    console.print(_unexplained_table(diagnosis))
    if remarks := unexplained_remarks(diagnosis):
        console.print(remarks, highlight=False, markup=False)


def _print_gate(console: Console, before: ModelCheck, after: ModelCheck) -> None:
    text = f"Gate 1 (is the simulated arm the real one?): {gate_words(before, after)}"
    console.print(text, highlight=False, markup=False)
    console.print()


def _print_apart(console: Console, item: TellingApart) -> None:
    if item.discrimination is not None:
        pairs = ", ".join(
            f"{first.correlation:.2f} → {last.correlation:.2f}"
            for first, last in zip(
                item.discrimination.separation_before, item.discrimination.separation_after, strict=True
            )
        )
        words = f"Planned a motion that tells them apart: correlation of each pair {pairs}"
        console.print(words, highlight=False, markup=False)
    if item.not_planned:
        words = f"No motion was planned that tells them apart: {item.not_planned}"
        console.print(words, highlight=False, markup=False)
    for pair in item.unsettled:
        words = (
            f"Motion alone does not tell {spaced(pair.first)} from {spaced(pair.second)}: {pair.settled_by}"
        )
        console.print(words, highlight=False, markup=False)


def _error_table(before: ModelCheck, after: ModelCheck) -> Table:
    table = _table(
        "Relative torque error, %, before → after",
        "joint",
        "identified, all rows",
        "identified, moving",
        "not fitted",
    )
    for joint in range(before.moving.size):
        changes = [
            f"{significant(float(a[joint]))} → {significant(float(b[joint]))}"
            for a, b in (
                (before.identified, after.identified),
                (before.moving, after.moving),
                (before.held_out, after.held_out),
            )
        ]
        table.add_row(str(joint + 1), *changes)
    return table


def _table(title: str, *headings: str) -> Table:
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1))
    for position, heading in enumerate(headings):
        table.add_column(heading, justify="left" if position == 0 else "right", no_wrap=position > 0)
    return table


def _finding_table(number: int, finding: Finding) -> Table:
    place = "arm" if not finding.joints else "joint " + ", ".join(map(str, finding.joints))
    title = (
        f"Finding {number}: {spaced(finding.effect)} at {place}"
        f" ({probability(finding.p_value)}, closes {percent(100 * finding.held_out_gain)} of the gap)"
    )
    table = _table(title, "parameter", "value", "σ", "unit")
    for parameter in finding.parameters:
        table.add_row(parameter.name, *with_sigma(parameter.value, parameter.sigma), parameter.unit)
    return table


def _ranking_table(finding: Finding) -> Table:
    table = _table("Ranking", "candidate", "score", "explains", "")
    indistinguishable = {candidate.words() for candidate in finding.indistinguishable_from}
    for candidate in finding.ranking[:6]:
        mark = "cannot be told apart" if candidate.words() in indistinguishable else ""
        if (candidate.effects, candidate.joints) == ((finding.effect,), (finding.joints,)):
            mark = "named"
        table.add_row(
            spaced(candidate.words()), significant(candidate.score), share_words(candidate.explained), mark
        )
    return table


def _candidate_table(diagnosis: Diagnosis) -> Table:
    table = _table("Ranking: none passes", "candidate", "score", "explains")
    for row in candidate_rows(diagnosis)[:6]:
        table.add_row(*row)
    return table


def _unexplained_table(diagnosis: Diagnosis) -> Table:
    table = _table(
        "Torque on data that was not fitted, % of its rms, worst joint first",
        "joint",
        "error",
        "noise",
        "unexplained",
        "nearest candidate",
    )
    joints = [str(number) for number in range(1, len(diagnosis.unexplained) + 1)]
    for row in unexplained_rows(diagnosis, joints):
        table.add_row(row.joint, row.error, row.noise, row.unexplained, row.nearest)
    return table


def _gap_table(title: str, gap: Gap) -> Table:
    table = _table(title, "joint", "before", "after", "floor")
    for joint, (before, after, floor) in enumerate(
        zip(gap.before, gap.after, gap.floor, strict=True), start=1
    ):
        table.add_row(
            str(joint),
            significant(float(before)),
            significant(float(after)),
            significant(float(floor)) if np.isfinite(floor) else "not known",
        )
    return table
