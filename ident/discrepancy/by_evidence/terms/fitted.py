"""The model of a diagnosis with the terms that were proposed, all fitted together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ident.discrepancy.by_evidence.terms.proposal import Proposal
from ident.discrepancy.component import Component
from ident.discrepancy.prior import extended, extended_prior
from ident.discrepancy.question import Question
from ident.discrepancy.refine import refit
from ident.discrepancy.results import Diagnosis
from ident.discrepancy.step import Step
from ident.effects.family import Place
from ident.effects.term_family import term_family
from ident.parameters.present import Present


def with_terms(question: Question, diagnosis: Diagnosis, terms: Sequence[Proposal]) -> Diagnosis:
    """The diagnosis with its model, estimate and last examination made with the terms.

    Args:
        question: that the diagnosis answers.
        diagnosis: without terms; its findings stay as they are.
        terms: proposals for its recordings.

    Raises:
        IdentificationError: a term that the arm cannot have, or columns that the data do not show.
    """
    if not terms:
        return diagnosis
    first, last = diagnosis.examinations
    base, robot = diagnosis.base, diagnosis.base.model.robot
    components = [
        Component(term_family(robot, term.formula), Place("joint", (term.joint - 1,)), ()) for term in terms
    ]
    present = Present(base.model, base.standard_from(diagnosis.beta, base.model.prior()))
    refined = refit(last, components, present)
    whole = extended(base, refined.effects, refined.seen)
    prior = question.prior(first.base) if question.prior else None
    prior = extended_prior(prior, len(whole.names) - len(first.base.names))
    step = Step.of(whole, last.prepared, prior, first.whitening, first.base, simulated=False)
    examination = step.examination
    return replace(
        diagnosis,
        base=whole,
        beta=examination.beta,
        covariance=examination.covariance,
        examinations=(first, examination),
    )
