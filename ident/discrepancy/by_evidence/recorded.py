"""What a recording would have shown, whatever it shows."""

from __future__ import annotations

from ident.discrepancy.align import lag_is_known
from ident.discrepancy.by_evidence.decide.present_with import PresentWith
from ident.discrepancy.by_evidence.decide.state import without_effects
from ident.discrepancy.by_evidence.library.candidates import candidates
from ident.discrepancy.by_evidence.power.planned import BesideModel, sizes_beside
from ident.discrepancy.by_evidence.power.smallest import Smallest
from ident.discrepancy.by_evidence.workflow import posed
from ident.discrepancy.question import Question


def recorded_sizes(question: Question) -> tuple[Smallest, ...]:
    """The smallest size of each effect that would have been named, beside all that the model leaves.

    Raises:
        IdentificationError: recordings that do not fit the arm.
    """
    problem = posed(question)
    nothing = without_effects(problem)
    present = PresentWith(problem.present, (), problem.prepared.apart)
    wanted = candidates(problem.prepared.robot, question.families)
    return sizes_beside(
        BesideModel.of(problem),
        nothing,
        present,
        wanted,
        recordings=question.fit,
        judging=question.validation,
        lag_known=lag_is_known(question.robot),
    )
