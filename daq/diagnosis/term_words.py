"""A term for what has no name, in a sentence."""

from __future__ import annotations

from daq.text.numbers import percent, with_sigma
from ident.discrepancy.by_evidence.terms.proposal import Proposal


def term_words(term: Proposal) -> str:
    """The formula with its factor, what it closes, and what in nature looks like it."""
    value, sigma = with_sigma(term.value, term.sigma)
    unit = "" if term.unit == "1" else f" {term.unit}"
    formula = "" if term.formula == "1" else f" · {term.formula}"
    return (
        f"No name, but a term: joint {term.joint} has ({value} ± {sigma}){unit}{formula}."
        f" On data that was not fitted {percent(100 * term.before)} of its torque stay unexplained without"
        f" terms, {percent(100 * term.after)} with those of this joint;"
        f" {percent(100 * term.stability)} of halves of the recording choose its variables."
        f" What looks like that: {term.looks_like}."
    )
