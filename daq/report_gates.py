"""The verdict and the three gates of the revised DWH-test, in the words and figures of the report."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from markupsafe import Markup

from daq.report_numbers import count, percent, probability, setting, significant
from daq.report_pictures import GateState, Tick, dot_row, gate_picture, icon, nice_ticks, scaled, tick_text
from ident.results import ColumnCheck, Estimate, Gate, GateName, Identification, Verdict

VerdictKind = Literal["good", "switch", "bad", "unknown"]
POORLY_SEEN_PERCENT = 30.0

_VERDICT: dict[Verdict, tuple[VerdictKind, str, str]] = {
    "exogenous": ("good", "exogenous", "Trust the least-squares model"),
    "endogenous": ("switch", "endogenous", "Use the instrumental-variable model"),
    "instruments_invalid": (
        "bad",
        "instruments invalid",
        "Do not trust this model: the simulated arm is not the real arm",
    ),
    "not_testable": ("unknown", "not testable", "Not testable"),
}


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
class ColumnView:
    name: str
    picture: Markup
    size: str
    limit: str
    p_value: str
    beyond: bool


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
    largest: ColumnView | None
    size_name: str
    limit_name: str
    detail: str
    summary: str
    ticks: tuple[Tick, ...]
    logarithmic: bool
    groups: tuple[tuple[str, tuple[ColumnView, ...]], ...]
    """Columns beyond the limit, then those within it, each under its word."""


@dataclass(frozen=True)
class _Words:
    title: str
    question: str
    open: str
    closed: str
    size: str
    limit: str
    within: str
    beyond: str
    in_percent: bool


_WORDS: dict[GateName, _Words] = {
    "instruments": _Words(
        "Instruments valid?",
        "Does the simulated arm move like the real one?",
        "Open: valid",
        "Closed: not valid",
        "Largest departure",
        "margin",
        "within margin",
        "beyond margin",
        True,
    ),
    "rank": _Words(
        "Anything to test?",
        "Do measured and simulated regressors differ by more than noise? (QR rank)",
        "Open: columns to test",
        "Closed",
        "Largest |Rₖₖ|",
        "noise floor",
        "null",
        "to test",
        False,
    ),
    "exogeneity": _Words(
        "Exogenous?",
        "Are the measured regressors free of the torque error?",
        "Open: exogenous",
        "Closed: endogenous",
        "Largest",
        "limit",
        "exogenous",
        "endogenous",
        False,
    ),
}
_NOTHING_TO_TEST = "Nothing left to test: exogenous"


def trusted_estimate(identification: Identification) -> Estimate:
    """The estimate that the verdict tells to use; least squares where it tells to use none."""
    if identification.test.verdict == "endogenous" and identification.instrumental is not None:
        return identification.instrumental
    return identification.least_squares


def verdict_view(identification: Identification, joint_names: tuple[str, ...]) -> VerdictView:
    """The banner: sign, words, advice and headline numbers."""
    test = identification.test
    kind, word, headline = _VERDICT[test.verdict]
    recommendation = test.recommendation
    if test.verdict == "not_testable":
        headline += f": {identification.instrumental_reason or recommendation or 'the test could not be run'}"
        recommendation = recommendation if identification.instrumental_reason else ""
    estimate = trusted_estimate(identification)
    method = "instrumental variables" if estimate.method == "iv" else "least squares"
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
    return VerdictView(kind, icon(kind), word, headline, recommendation, tuple(facts))


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
    limits, logarithmic = _axis(gate.columns)
    columns = _columns(gate, words, limits, logarithmic)
    beyond = tuple(column for column in columns if column.beyond)
    within = tuple(column for column in columns if not column.beyond)
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
        largest=columns[0] if columns else None,
        size_name=words.size,
        limit_name=words.limit,
        detail=gate.detail,
        summary=f"{len(columns)} columns, {len(beyond) or 'none'} {words.beyond}",
        ticks=_ticks(limits, logarithmic, words.in_percent),
        logarithmic=logarithmic,
        groups=tuple(group for group in ((words.beyond, beyond), (words.within, within)) if group[1]),
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


def _beyond(check: ColumnCheck, gate: Gate) -> bool:
    return check.size > check.limit if gate.name == "rank" else not check.passed


def _excess(check: ColumnCheck) -> float:
    """Size over limit, for ordering; what cannot be compared comes first."""
    ratio = check.size / check.limit if check.limit else check.size
    return ratio if math.isfinite(ratio) else math.inf


def _columns(
    gate: Gate, words: _Words, limits: tuple[float, float], logarithmic: bool
) -> tuple[ColumnView, ...]:
    def number(value: float) -> str:
        return percent(100.0 * value) if words.in_percent else significant(value)

    def limit(value: float) -> str:
        return f"{setting(100.0 * value)}\u00a0%" if words.in_percent else setting(value)

    return tuple(
        ColumnView(
            name=check.column,
            picture=dot_row(check.size, check.limit, limits, logarithmic, _beyond(check, gate)),
            size=number(check.size),
            limit=limit(check.limit),
            p_value=significant(check.p_value, 2) if (check.p_value or 1.0) >= 1e-4 else "< 0.0001",
            beyond=_beyond(check, gate),
        )
        for check in sorted(
            gate.columns, key=lambda check: (_beyond(check, gate), _excess(check)), reverse=True
        )
    )


def _axis(columns: tuple[ColumnCheck, ...]) -> tuple[tuple[float, float], bool]:
    """Range of the dot plot, and whether it is logarithmic (sizes over more than a factor of 30)."""
    values = [v for check in columns for v in (check.size, check.limit) if math.isfinite(v) and v > 0.0]
    if not values:
        return (0.0, 1.0), False
    low, high = min(values), max(values)
    if high / low > 30.0:
        return (max(low / 1.5, high * 1e-12), high * 1.5), True
    return (0.0, high * 1.1), False


def _power(value: float) -> str:
    """A power of ten, short: ``0.01``, ``10⁻⁵``."""
    return significant(value, 1).removeprefix("1·")


def _ticks(limits: tuple[float, float], logarithmic: bool, in_percent: bool) -> tuple[Tick, ...]:
    factor = 100.0 if in_percent else 1.0
    suffix = " %" if in_percent else ""
    if not logarithmic:
        values = nice_ticks(factor * limits[0], factor * limits[1], 2)
        scale = (factor * limits[0], factor * limits[1])
        return tuple(Tick(scaled(v, scale), tick_text(v, values) + suffix) for v in values)
    first, last = math.ceil(math.log10(limits[0])), math.floor(math.log10(limits[1]))
    step = max(1, math.ceil((last - first + 1) / 3))
    powers = range(last, first - 1, -step)
    return tuple(Tick(scaled(10.0**k, limits, True), _power(factor * 10.0**k) + suffix) for k in powers)
