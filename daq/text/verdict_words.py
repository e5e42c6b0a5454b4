"""The verdict of an identification in words: one headline for terminal and report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ident.estimators import ESTIMATORS
from ident.results import Estimator, Identification
from ident.verdicts import Verdict

VerdictKind = Literal["good", "switch", "bad", "unknown"]


@dataclass(frozen=True)
class VerdictWords:
    """How a verdict reads.

    Attributes:
        kind: what the sign and the colour go by.
        word: the verdict's name.
        headline: what to do, in one line.
    """

    kind: VerdictKind
    word: str
    headline: str


VERDICTS: dict[Verdict, VerdictWords] = {
    "exogenous": VerdictWords("good", "exogenous", "Trust the least-squares model"),
    "endogenous": VerdictWords("switch", "endogenous", "Use the instrumental-variable model"),
    "instruments_invalid": VerdictWords(
        "bad", "instruments invalid", "Do not trust this model yet: the simulated arm is not the real arm"
    ),
    "not_testable": VerdictWords("unknown", "not testable", "Not testable"),
}


def kind_of(result: Identification) -> VerdictKind:
    """What sign and colour go by: that of the verdict; bad where a value is one that no arm can have."""
    return "bad" if result.impossible else VERDICTS[result.test.verdict].kind


def headline_of(result: Identification) -> str:
    """What to do, in one line."""
    if result.impossible:
        return "Do not trust this model: it has values that no arm can have"
    return VERDICTS[result.test.verdict].headline


def words_of(estimator: Estimator) -> str:
    """An estimator as people call it."""
    return ESTIMATORS[estimator].words


def asked_for(identification: Identification) -> str:
    """A sentence where a method was asked for in place of the verdict's; empty where the verdict decides."""
    if identification.method == "auto":
        return ""
    method = identification.recommended.method
    return f"Shown is the estimate by {words_of(method)}, as asked for."
