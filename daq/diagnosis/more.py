"""What is added to a diagnosis: smallest sizes, terms for what has no name, and when findings began."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

from rich.console import Console

from daq.diagnosis.onset_words import onset_json, onset_words
from daq.diagnosis.term_words import term_words
from daq.report.power import power_json, print_power
from daq.text.progress import Steps
from daq.text.wrapped import write
from ident import IdentificationError
from ident.discrepancy import Diagnosis, Question
from ident.discrepancy.by_evidence.power.smallest import Smallest
from ident.discrepancy.by_evidence.recorded import recorded_sizes
from ident.discrepancy.by_evidence.terms.asked import proposed_terms
from ident.discrepancy.by_evidence.terms.fitted import with_terms
from ident.discrepancy.by_evidence.terms.proposal import Proposal
from ident.discrepancy.onset import Onset, onsets

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class More:
    """What is added.

    Attributes:
        power: the smallest size of each effect that would have been named; None where that was not asked.
        terms: for what has no name.
        model: the diagnosis whose model has them; None where there are none.
        onsets: when findings began within the recordings that were fitted.
        names: of these recordings.
    """

    power: tuple[Smallest, ...] | None = None
    terms: tuple[Proposal, ...] = ()
    model: Diagnosis | None = None
    onsets: tuple[Onset, ...] = ()
    names: tuple[str, ...] = ()

    @property
    def when(self) -> tuple[str, ...]:
        """When findings began, a sentence each."""
        return tuple(onset_words(one, self.names) for one in self.onsets)

    def as_json(self) -> dict[str, Any]:
        """Keys of ``diagnose --json``."""
        content: dict[str, Any] = {
            "terms": [one.as_json() for one in self.terms],
            "onsets": [onset_json(one) for one in self.onsets],
        }
        return content if self.power is None else content | {"power": power_json(self.power)}


def more_of(diagnosis: Diagnosis, question: Question, steps: Steps, *, power: bool) -> More:
    """Sizes where they were asked for, terms where the verdict is that no name fits.

    Raises:
        IdentificationError: recordings that do not fit the arm, where sizes were asked for.
    """
    sizes: tuple[Smallest, ...] | None = None
    terms: tuple[Proposal, ...] = ()
    model: Diagnosis | None = None
    if diagnosis.verdict == "unnamed":
        with steps.step("A term for what has no name"):
            terms = _terms(question)
            model = with_terms(question, diagnosis, terms) if terms else None
    if power:
        with steps.step("Smallest sizes that would have been named"):
            sizes = recorded_sizes(question)
    return More(sizes, terms, model, onsets(diagnosis), tuple(one.name for one in question.fit))


def _terms(question: Question) -> tuple[Proposal, ...]:
    try:
        return proposed_terms(question)
    except IdentificationError as error:
        _LOG.warning("no term was looked for: %s", error)
        return ()


def print_more(console: Console, more: More) -> None:
    """When findings began, terms, then the table of sizes."""
    for sentence in more.when:
        write(console, sentence)
    for term in more.terms:
        write(console, term_words(term))
    if more.power is not None:
        print_power(console, more.power)
