"""Terms for recordings whose gap has no name, whichever search was asked about them."""

from __future__ import annotations

import numpy as np

from ident.discrepancy.by_evidence.decide.instruments import prepared_beside
from ident.discrepancy.by_evidence.decide.left_over import ABOVE, above_accepted
from ident.discrepancy.by_evidence.decide.present_with import PresentWith
from ident.discrepancy.by_evidence.decide.state import without_effects
from ident.discrepancy.by_evidence.terms.proposal import Proposal
from ident.discrepancy.by_evidence.terms.propose import propose
from ident.discrepancy.by_evidence.workflow import posed
from ident.discrepancy.question import Question


def proposed_terms(question: Question) -> tuple[Proposal, ...]:
    """Terms beside the model that is examined, at every joint whose misfit is above the accepted one.

    Raises:
        IdentificationError: recordings that do not fit the arm.
    """
    problem = posed(question)
    nothing = without_effects(problem)
    present = PresentWith(problem.present, (), problem.prepared.apart)
    joints = np.flatnonzero(above_accepted(problem, nothing) > ABOVE)
    validation = prepared_beside(problem.base, problem.start, question.validation)
    return propose(problem, nothing, present, validation, [int(joint) for joint in joints])
