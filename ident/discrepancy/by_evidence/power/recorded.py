"""What recordings could have shown, whichever search is asked about them."""

from __future__ import annotations

from ident.discrepancy.align import lag_is_known
from ident.discrepancy.by_evidence.decide.present_with import PresentWith
from ident.discrepancy.by_evidence.decide.state import Found
from ident.discrepancy.by_evidence.library.candidates import candidates
from ident.discrepancy.by_evidence.power.planned import sizes_beside
from ident.discrepancy.by_evidence.power.smallest import Smallest
from ident.discrepancy.by_evidence.workflow import posed
from ident.discrepancy.question import Question


def recorded_sizes(question: Question) -> tuple[Smallest, ...]:
    """The smallest size of each effect that would have been named, beside all that the model leaves.

    Raises:
        IdentificationError: recordings that do not fit the arm.
    """
    problem = posed(question)
    nothing = Found((), problem.level, problem.score, problem.posterior)
    present = PresentWith(problem.present, (), problem.prepared.repeats)
    wanted = candidates(problem.prepared.robot, question.families)
    return sizes_beside(problem, nothing, present, question.fit, wanted, lag_is_known(question.robot))
