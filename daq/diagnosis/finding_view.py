"""One finding as the page shows it."""

from __future__ import annotations

from dataclasses import dataclass

from daq.diagnosis.apart import TellingApart
from daq.diagnosis.diagnosis_json import trajectory_names
from daq.diagnosis.diagnosis_words import confirmed_words, sentence_of, spaced, sure_words
from daq.diagnosis.gap_tables import ErrorRow, GapRow, GateChange, error_rows, gap_rows, gate_change
from daq.diagnosis.plots import Plot, binned_residual_plot
from daq.diagnosis.ranking_table import RankRow, ranking_rows
from daq.text.numbers import correlation, percent, with_sigma
from ident.discrepancy import Finding, FoundParameter
from ident.discrepancy.before_after import Series
from robots.description import Robot

_MODES = {
    "prior": "against a model that existed before",
    "refit": "after a refit of the base parameters",
}


@dataclass(frozen=True)
class FindingView:
    """One finding as the template shows it."""

    number: int
    words: str
    sentence: str
    mode: str
    sure: str
    closed: str
    confirmed: str
    parameters: tuple[tuple[str, ...], ...]
    here: tuple[Plot, ...]
    elsewhere: tuple[Plot, ...]
    ranking: tuple[RankRow, ...]
    errors: tuple[ErrorRow, ...]
    gate: GateChange
    gap: tuple[GapRow, ...]
    apart: TellingApart | None
    pairs: tuple[tuple[str, str, str], ...]
    files: tuple[str, str]


def finding_view(
    number: int,
    finding: Finding,
    robot: Robot,
    series: Series,
    apart: TellingApart | None,
    joints: list[str],
) -> FindingView:
    """One finding for the page.

    Args:
        number: from 1.
        finding: of the search.
        robot: the arm.
        series: of the whole diagnosis.
        apart: what to do about it where it is ambiguous.
        joints: headings.
    """
    before, after = series.checks[number - 1 : number + 1]
    shown = {joint - 1 for joint in finding.joints} or {finding.binned_residual.joint}
    pictures = [one for one in series.binned_residuals[number - 1] if one.centre.size]
    return FindingView(
        number=number,
        words=sentence_of(finding.words()),
        sentence=finding.sentence,
        mode=_MODES[finding.mode],
        sure=sure_words(finding),
        closed=percent(100.0 * finding.held_out_gain),
        confirmed=confirmed_words(finding),
        parameters=tuple(_parameter_row(p) for p in finding.parameters),
        here=tuple(binned_residual_plot(one, joints, robot) for one in pictures if one.joint in shown),
        elsewhere=tuple(
            binned_residual_plot(one, joints, robot) for one in pictures if one.joint not in shown
        ),
        ranking=ranking_rows(finding),
        errors=error_rows(before, after, joints),
        gate=gate_change(before, after),
        gap=gap_rows(finding.gap, joints, [joint.torque_unit for joint in robot.joint]),
        apart=apart,
        pairs=_pairs(apart),
        files=trajectory_names(number),
    )


def _parameter_row(parameter: FoundParameter) -> tuple[str, ...]:
    unit = "" if parameter.unit == "1" else parameter.unit
    if parameter.value == 0.0 and parameter.sigma == 0.0:
        return parameter.name, "not seen", "", ""
    return (parameter.name, *with_sigma(parameter.value, parameter.sigma), unit)


def _pairs(apart: TellingApart | None) -> tuple[tuple[str, str, str], ...]:
    """What a planned motion does for each pair: the pair, correlation before and after."""
    if apart is None:
        return ()
    return tuple(
        (
            spaced(f"{last.first} – {last.second}"),
            correlation(first.correlation),
            correlation(last.correlation),
        )
        for first, last in apart.pairs
    )
