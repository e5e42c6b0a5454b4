"""The search, again where the motion that its columns are made of is that of a simulated model."""

from __future__ import annotations

from collections.abc import Callable

from ident.discrepancy.by_evidence.decide.instruments import with_found
from ident.discrepancy.by_evidence.decide.problem import Problem, pose
from ident.discrepancy.by_evidence.decide.search import Search, Searched
from ident.discrepancy.by_evidence.library.candidates import candidates
from ident.discrepancy.question import Question


def searched_beside_motion(
    problem: Problem, question: Question, progress: Callable[[str, float], None]
) -> tuple[Search, Searched]:
    """A search and where it ended.

    Where nothing repeats and something is found, it is asked again beside the motion of a model that has it:
    without that a delay of 3.7 ms was named a lag.

    Args:
        problem: the question's model against its recordings.
        question: vocabulary and recordings.
        progress: told of each step.

    Raises:
        IdentificationError: recordings that do not fit the arm.
    """
    search = Search(problem, candidates(problem.prepared.robot, question.families), progress)
    searched = search.run()
    if searched.found.members and any(part.simulated for part in problem.prepared.parts):
        prepared = with_found(problem, searched.found, question.fit)
        accepted = None if problem.prior is None else problem.prior.misfit
        search = Search(pose(problem.base, problem.prior, prepared, accepted), search.wanted, progress)
        searched = search.run()
    return search, searched
