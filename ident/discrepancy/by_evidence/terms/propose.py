"""Terms for what stays unexplained, chosen by the search's own evidence and kept where resampling keeps them.

A term enters as an effect does: with a prior of its own, the misfit of its joint learned again beside it, and
the odds of one more effect divided among the kinds of the dictionary, and in each among its terms. It is
proposed where halves of the recording say the same, and where recordings that were not fitted bear it out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.discrepancy.by_evidence.confirm.held_out import HeldOut
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.state import Found
from ident.discrepancy.by_evidence.evidence.prepared import Prepared
from ident.discrepancy.by_evidence.evidence.rows import effect_rows
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.discrepancy.by_evidence.terms.chosen import chosen_terms
from ident.discrepancy.by_evidence.terms.proposal import Proposal
from ident.discrepancy.by_evidence.terms.stability import STABLE, stability
from ident.effects.family import Place, PresentModel
from ident.effects.scales import dry_friction
from ident.effects.term_family import family_of
from ident.effects.terms import Term, dictionary
from robots.arrays import FloatArray

_LEADERS = 12
"""Sets of one and of two terms that are tried at each level of the misfit."""

_CLOSED = 0.5
"""Of what is unexplained on other motion (its power): more than that has to go."""


def propose(
    problem: Problem, found: Found, present: PresentModel, validation: Prepared, joints: Sequence[int]
) -> tuple[Proposal, ...]:
    """Terms beside a set; none where nothing is likely, stable and borne out.

    Args:
        problem: the data.
        found: effects that have a name.
        present: the model with them.
        validation: recordings that nothing was fitted to.
        joints: from 0, whose torque stays unexplained.
    """
    held = HeldOut.of(problem, validation)
    return tuple(proposal for joint in joints for proposal in _of_joint(problem, found, present, held, joint))


def _of_joint(
    problem: Problem, found: Found, present: PresentModel, held: HeldOut, joint: int
) -> list[Proposal]:
    """Two terms, or one where it alone is stable and borne out."""
    terms, entries = _entries(problem, present, joint)
    for choice in chosen_terms(problem, found, entries, terms, joint, _LEADERS):
        before, after = (float(held.unexplained(one)[joint]) for one in (found, choice[1]))
        if after**2 >= _CLOSED * before**2:
            continue
        share = stability(problem, found, entries, terms, choice, joint)
        if share >= STABLE:
            numbers = enumerate(choice[0], start=len(found.members))
            return [
                _proposal(terms[i], choice[1].theta(number), share, before, after) for number, i in numbers
            ]
    return []


def _proposal(
    term: Term, fitted: tuple[FloatArray, FloatArray], share: float, before: float, after: float
) -> Proposal:
    value, covariance = fitted
    return Proposal(
        joint=term.joint + 1,
        formula=term.formula,
        unit=term.unit,
        value=float(value[0]),
        sigma=float(np.sqrt(covariance[0, 0])),
        variables=tuple(sorted(term.variables)),
        stability=share,
        before=before,
        after=after,
        looks_like=term.looks_like,
    )


def _entries(
    problem: Problem, present: PresentModel, joint: int
) -> tuple[tuple[Term, ...], tuple[Entry, ...]]:
    """Of the dictionary of a joint what the data show, and the same as candidates of one name.

    Before the torque is seen a term makes as much of it as the joint's dry friction, on the motion that was
    driven: a power of an angle that stays small may have any factor.
    """
    robot, used = problem.prepared.robot, problem.prepared.used[:, joint]
    friction = dry_friction(robot, Place("drive", (joint,)))
    terms = dictionary(robot, joint)
    kinds = Counter(term.kind for term in terms)
    shown, entries = [], []
    for term in terms:
        family, place = family_of(term), Place("joint", (joint,))
        placed = family.effect(robot, place, (), present)
        size = float(np.sqrt(np.mean(effect_rows(problem.prepared, placed)[used, joint, 0] ** 2)))
        if size == 0.0:
            continue
        placed = replace(placed, scale=(friction / size,))
        white = problem.rows.effect(placed)
        if white.there:
            candidate = Candidate(family, place, (), len(kinds), robot.n, kinds[term.kind])
            shown.append(term)
            entries.append(Entry(candidate, placed, white))
    return tuple(shown), tuple(entries)
