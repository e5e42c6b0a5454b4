"""What a person sees of a diagnosis on the terminal: the answer, a line per joint, what is odd."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console

from daq.diagnosis.apart import TellingApart
from daq.diagnosis.blind_spots import BlindSpot
from daq.diagnosis.diagnosis_json import trajectory_names
from daq.diagnosis.diagnosis_words import (
    confirmed_words,
    gate_words,
    headline,
    recommendation,
    spaced,
    sure_words,
)
from daq.diagnosis.ranking_table import candidate_rows, probability_words
from daq.diagnosis.unexplained_table import unexplained_remarks, unexplained_rows
from daq.text.numbers import percent, significant, with_sigma
from daq.text.wrapped import Column, write, write_table
from ident.discrepancy import Diagnosis, Finding, Gap
from ident.discrepancy.before_after import ModelCheck
from ident.effects.entry import joint_words

_RANKED = 6
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
    model: Path | None = None,
    details: bool = False,
) -> None:
    """The answer first, then a line per joint, then what is odd.

    Args:
        console: where a person reads.
        diagnosis: of the search.
        checks: of the model before anything was found and after each finding.
        apart: what to do about each ambiguous finding.
        blind: what these recordings could not have shown.
        model: the model file that was written; None where there is none.
        details: print the parameters of each finding, the rankings and the gaps too.
    """
    console.print()
    write(console, f"{headline(diagnosis)}.", style=f"bold {_COLOURS[diagnosis.verdict]}")
    write(console, recommendation(diagnosis))
    if model is not None and diagnosis.verdict == "named":
        gate = checks[-1].gate
        trusted = gate is None or gate.passed
        write(console, f"Use {model}." if trusted else f"Not to be trusted yet: gate 1 rejects {model}.")
    _write_joints(console, diagnosis, checks)
    _write_odd(console, diagnosis, checks)
    for ambiguous in apart:
        _write_apart(console, ambiguous)
    if blind:
        write(console, "Could be there unseen:")
    for spot in blind:
        write(console, f"  {spot.words()}", indent="    ")
    if details:
        _write_details(console, diagnosis, checks)


def _write_joints(console: Console, diagnosis: Diagnosis, checks: Sequence[ModelCheck]) -> None:
    """What stays of each joint's torque on data that was not fitted, worst joint first."""
    columns = [Column("joint", right=False), Column("before"), Column("after"), Column("noise")]
    columns += [Column("unexplained"), Column("nearest candidate", right=False, wraps=True)]
    joints = [str(number) for number in range(1, len(diagnosis.unexplained) + 1)]
    rows = [
        [
            row.joint,
            percent(float(checks[0].held_out[int(row.joint) - 1])),
            percent(float(checks[-1].held_out[int(row.joint) - 1])),
            row.noise,
            row.unexplained,
            row.nearest,
        ]
        for row in unexplained_rows(diagnosis, joints)
    ]
    write_table(console, "Torque error on data that was not fitted, % of torque", columns, rows)


def _write_odd(console: Console, diagnosis: Diagnosis, checks: Sequence[ModelCheck]) -> None:
    """What the model does not have, does not explain, or was not tested for."""
    odd = [
        f"Finding {number}: {spaced(finding.effect)} at {joint_words(finding.joints)}"
        f" ({sure_words(finding)}; closes {percent(100 * finding.held_out_gain)} of the gap);"
        f" {_confirmed(diagnosis, finding)}."
        for number, finding in enumerate(diagnosis.findings, start=1)
    ]
    odd += [
        f"Left out of the model: {spaced(finding.words())}; {confirmed_words(finding)}."
        for finding in diagnosis.rejected
    ]
    gate = gate_words(checks[0], checks[-1])
    odd.append(f"Gate 1 (is the simulated arm the real one?): {gate}.")
    if diagnosis.position is None and diagnosis.loop_reason and diagnosis.loop_reason not in gate:
        odd.append(f"Closed loop not simulated: {diagnosis.loop_reason}.")
    odd += [f"Does not repeat: {item.sentence}" for item in diagnosis.unrepeated]
    odd += [remarks] if (remarks := unexplained_remarks(diagnosis)) else []
    for sentence in odd:
        write(console, f"- {sentence}", indent="  ")


def _confirmed(diagnosis: Diagnosis, finding: Finding) -> str:
    """A reason that is the recommendation already is not said again."""
    said = diagnosis.verdict == "not_confirmed" and not finding.confirmation.passed
    return "not confirmed" if said else confirmed_words(finding)


def _write_details(console: Console, diagnosis: Diagnosis, checks: Sequence[ModelCheck]) -> None:
    for number, finding in enumerate(diagnosis.findings, start=1):
        console.print()
        _write_finding(console, number, finding)
        _write_ranking(console, finding)
        _write_errors(console, checks[number - 1], checks[number])
        if len(diagnosis.findings) > 1:
            write(console, f"Gate 1: {gate_words(checks[number - 1], checks[number])}")
    if not diagnosis.findings:
        _write_errors(console, checks[0], checks[0])
        columns = [Column("candidate", right=False, wraps=True), Column("score"), Column("probability")]
        write_table(console, "Ranking: none passes", columns, candidate_rows(diagnosis)[:_RANKED])
    _write_gap(console, "Torque gap on the validation recordings, rms", diagnosis.torque)
    if diagnosis.position is not None:
        _write_gap(console, "Position gap of the closed loop, rms", diagnosis.position)


def _write_apart(console: Console, item: TellingApart) -> None:
    if item.parts:
        pairs = ", ".join(f"{first.correlation:.2f} → {last.correlation:.2f}" for first, last in item.pairs)
        fit, validate = trajectory_names(item.number)
        write(
            console,
            f"Planned a motion that tells them apart, in two parts: {fit} to fit with all recordings so far,"
            f" {validate} alone to --validate; correlation of each pair {pairs}",
        )
    if item.not_planned:
        write(console, f"No motion was planned that tells them apart: {item.not_planned}")
    for pair in item.unsettled:
        write(
            console,
            f"Motion alone does not tell {spaced(pair.first)} from {spaced(pair.second)}: {pair.settled_by}",
        )


def _write_errors(console: Console, before: ModelCheck, after: ModelCheck) -> None:
    columns = [Column("joint", right=False), Column("identified, all rows", spare=1)]
    columns += [Column("identified, moving"), Column("not fitted")]
    rows = []
    for joint in range(before.moving.size):
        changes = [
            f"{significant(float(a[joint]))} → {significant(float(b[joint]))}"
            for a, b in (
                (before.identified, after.identified),
                (before.moving, after.moving),
                (before.held_out, after.held_out),
            )
        ]
        rows.append([str(joint + 1), *changes])
    write_table(console, "Relative torque error, %, before → after", columns, rows)


def _write_finding(console: Console, number: int, finding: Finding) -> None:
    columns = [Column("parameter", right=False), Column("value"), Column("σ"), Column("unit", right=False)]
    rows = [
        [parameter.name, *with_sigma(parameter.value, parameter.sigma), parameter.unit]
        for parameter in finding.parameters
    ]
    title = f"Finding {number}: {spaced(finding.effect)} at {joint_words(finding.joints)}"
    write_table(console, title, columns, rows)


def _write_ranking(console: Console, finding: Finding) -> None:
    columns = [Column("candidate", right=False, wraps=True), Column("score"), Column("probability")]
    columns += [Column("", right=False)]
    indistinguishable = {candidate.words() for candidate in finding.indistinguishable_from}
    rows = []
    for candidate in finding.ranking[:_RANKED]:
        mark = "cannot be told apart" if candidate.words() in indistinguishable else ""
        if (candidate.effect, candidate.joints) == (finding.effect, finding.joints):
            mark = "named"
        words, sure = spaced(candidate.words()), probability_words(candidate)
        rows.append([words, significant(candidate.score), sure, mark])
    write_table(console, "Ranking", columns, rows)


def _write_gap(console: Console, title: str, gap: Gap) -> None:
    columns = [Column("joint", right=False), Column("before"), Column("after"), Column("floor")]
    rows = [
        [
            str(joint),
            significant(float(before)),
            significant(float(after)),
            significant(float(floor)) if np.isfinite(floor) else "not known",
        ]
        for joint, (before, after, floor) in enumerate(
            zip(gap.before, gap.after, gap.floor, strict=True), start=1
        )
    ]
    write_table(console, title, columns, rows)
