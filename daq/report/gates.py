"""The verdict and the three gates of the revised DWH-test, in the words and figures of the report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from daq.report.columns import ColumnPlot, column_plot
from daq.report.pictures import GateState, gate_picture, icon
from daq.text.numbers import count, percent, probability, significant
from daq.text.verdict_words import VERDICTS, VerdictKind, asked_for, headline_of, kind_of, words_of
from ident.results import Identification
from ident.verdicts import Gate, GateName, Verdict

POORLY_SEEN_PERCENT = 30.0


@dataclass(frozen=True)
class Fact:
    """One headline number: what it is, its value, and a note below it."""

    label: str
    value: str
    note: str


@dataclass(frozen=True)
class VerdictView:
    kind: VerdictKind
    icon: Markup
    word: str
    headline: str
    recommendation: str
    facts: tuple[Fact, ...]


@dataclass(frozen=True)
class GateView:
    number: int
    title: str
    question: str
    state: GateState
    word: str
    picture: Markup
    null: str
    statistic: str
    p_value: str
    detail: str
    columns: ColumnPlot | None


@dataclass(frozen=True)
class _Words:
    title: str
    question: str
    open: str
    closed: str


_WORDS: dict[GateName, _Words] = {
    "instruments": _Words(
        "Instruments valid?",
        "Does the simulated arm move like the real one?",
        "Open: valid",
        "Closed: not valid",
    ),
    "rank": _Words(
        "Anything to test?",
        "Do measured and simulated regressors differ by more than noise? (QR rank)",
        "Open: columns to test",
        "Closed",
    ),
    "exogeneity": _Words(
        "Exogenous?",
        "Are the measured regressors free of the torque error?",
        "Open: exogenous",
        "Closed: endogenous",
    ),
}
_NOTHING_TO_TEST = "Nothing left to test: exogenous"


def verdict_view(identification: Identification, joint_names: tuple[str, ...]) -> VerdictView:
    """The banner: sign, words, advice and headline numbers."""
    test = identification.test
    words = VERDICTS[test.verdict]
    headline, recommendation, kind = headline_of(identification), test.recommendation, kind_of(identification)
    if identification.impossible:
        recommendation = " ".join(f"{words[:1].upper()}{words[1:]}." for words in identification.impossible)
    elif test.verdict == "not_testable":
        headline += f": {identification.instrumental_reason or recommendation or 'the test could not be run'}"
        recommendation = recommendation if identification.instrumental_reason else ""
    estimate = identification.recommended
    if not identification.impossible:
        recommendation = f"{recommendation} {asked_for(identification)}".strip()
    method = words_of(estimate.method)
    poor = sum(not p.percent_sigma <= POORLY_SEEN_PERCENT for p in estimate.parameters)
    facts = [Fact("Relative torque error", percent(estimate.relative_error_percent), method)]
    per_joint = np.asarray(estimate.relative_error_percent_per_joint, dtype=np.float64)
    if per_joint.size > 1 and bool(np.any(np.isfinite(per_joint))):
        worst = int(np.nanargmax(per_joint))
        facts.append(Fact("Worst joint", percent(float(per_joint[worst])), joint_names[worst]))
    seen = f"{poor} poorly seen" if poor else "all well seen"
    facts.append(Fact("Base parameters", count(len(estimate.parameters)), seen))
    per_parameter = identification.rows // max(len(estimate.parameters), 1)
    facts.append(Fact("Rows", count(identification.rows), f"{count(per_parameter)} per parameter"))
    return VerdictView(kind, icon(kind), words.word, headline, recommendation, tuple(facts))


def gate_views(identification: Identification) -> tuple[GateView, ...]:
    """The three gates in the order of the test."""
    gates = identification.test.gates
    reached_last = any(gate.name == "exogeneity" and gate.passed is not None for gate in gates)
    return tuple(
        gate_view(gate, number, reached_last, identification.test.verdict)
        for number, gate in enumerate(gates, start=1)
    )


def gate_view(gate: Gate, number: int, reached_last: bool, verdict: Verdict) -> GateView:
    """One gate in words and pictures.

    The rank gate lets the evidence through where columns are left to test. Where none is left the answer is
    already there, so it is an exit and not a closed gate.
    """
    words = _WORDS[gate.name]
    state, word = _state(gate, reached_last, verdict, words)
    return GateView(
        number=number,
        title=words.title,
        question=words.question,
        state=state,
        word=word,
        picture=gate_picture(state, last=gate.name == "exogeneity"),
        null=gate.null,
        statistic=statistic_text(gate),
        p_value=probability(gate.p_value),
        detail=gate.detail if gate.passed is not None else "",
        columns=column_plot(gate),
    )


def statistic_text(gate: Gate) -> str:
    """The test statistic as it is written in the field, e.g. ``F(48, 5294) = 1.07``."""
    if gate.statistic is None:
        return ""
    name = gate.distribution or "statistic"
    if gate.df and "(" not in name:
        name += (
            f"({', '.join(count(int(d)) if float(d).is_integer() else significant(d, 4) for d in gate.df)})"
        )
    return f"{name} = {significant(gate.statistic)}"


def _state(gate: Gate, reached_last: bool, verdict: Verdict, words: _Words) -> tuple[GateState, str]:
    if gate.passed is None:
        return "none", "Not reached"
    if gate.name == "rank":
        if reached_last:
            return "open", words.open
        return ("exit", _NOTHING_TO_TEST) if verdict == "exogenous" else ("closed", words.closed)
    return ("open", words.open) if gate.passed else ("closed", words.closed)
