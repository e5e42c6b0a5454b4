"""Terms for what stays unexplained, chosen by the search's own evidence and kept where resampling keeps them.

Forward selection over the dictionary of each joint whose misfit is above the accepted one. A term enters as
an effect does: with a prior of its own, the misfit of its joint learned again beside it, and the odds of one
more effect divided among all terms of all joints. It is proposed where halves of the recording choose it, too
(stability selection, Meinshausen and Bühlmann 2010), and where recordings that were not fitted bear it out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.discrepancy.by_evidence.confirm.held_out import HeldOut
from ident.discrepancy.by_evidence.decide.names import SURE
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.screening import screen
from ident.discrepancy.by_evidence.decide.state import Found, Member, found_set
from ident.discrepancy.by_evidence.evidence.prepared import Prepared
from ident.discrepancy.by_evidence.evidence.rows import Rows
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.discrepancy.by_evidence.terms.proposal import Proposal
from ident.effects.family import Place, PresentModel
from ident.effects.term_family import family_of
from ident.effects.terms import Term, dictionary

MOST = 2
"""Terms of one joint: more is no description."""

_LEADERS = 8
"""Terms whose misfit is learned with them, of each step."""

_LIKELY = 30
"""Terms of which halves of the recording may choose."""

_HALVES = 10
STABLE = 0.8
"""Share of halves of the recording that choose a term's variables again: with at most two chosen of 98,
at most 0.07 wrong ones are expected to be that stable (MOST² / ((2 · 0.8 − 1) · 98), their theorem 1).
"""

_BLOCK = 1.0
"""s, of recording that stays together in a half: longer than any memory of the noise."""


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
    terms, entries = _entries(problem, present, joint)
    chosen = _selected(problem, found, entries, joint)
    added = chosen.members[len(found.members) :]
    if not added:
        return []
    by_name = {family_of(term).name: term for term in terms}
    names = [_term_of(member, by_name) for member in added]
    shares = _stability(problem, found, entries, names, by_name, joint)
    before, after = (float(held.unexplained(one)[joint]) for one in (found, chosen))
    if min(shares) < STABLE or after >= before:
        return []
    proposals = []
    for number, (term, share) in enumerate(zip(names, shares, strict=True), start=len(found.members)):
        value, covariance = chosen.theta(number)
        proposals.append(
            Proposal(
                joint=joint + 1,
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
        )
    return proposals


def _term_of(member: Member, by_name: dict[str, Term]) -> Term:
    return by_name[member.candidate.family.name]


def _entries(
    problem: Problem, present: PresentModel, joint: int
) -> tuple[tuple[Term, ...], tuple[Entry, ...]]:
    """The dictionary of a joint, and what of it the data show, as candidates of one name."""
    robot = problem.prepared.robot
    terms = dictionary(robot, joint)
    found = []
    for term in terms:
        family, place = family_of(term), Place("joint", (joint,))
        placed = family.effect(robot, place, (), present)
        white = problem.rows.effect(placed)
        if white.there:
            found.append(Entry(Candidate(family, place, (), len(terms), robot.n, 1), placed, white))
    return terms, tuple(found)


def _selected(problem: Problem, found: Found, entries: Sequence[Entry], joint: int) -> Found:
    """Terms one after the other, as long as one is as sure as a name has to be."""
    needed = float(np.log(SURE / (1.0 - SURE)))
    chosen = found
    while len(chosen.members) < len(found.members) + MOST:
        taken = {member.candidate.family.name for member in chosen.members}
        free = [entry for entry in entries if entry.candidate.family.name not in taken]
        leaders = [one.best for one in screen(problem, chosen, free)[:_LEADERS]]
        tried = [found_set(problem, (*chosen.members, one), chosen.level, (joint,)) for one in leaders]
        best = max(tried, key=lambda one: one.log_posterior, default=chosen)
        if best.log_posterior < chosen.log_posterior + needed:
            break
        chosen = best
    return chosen


def _stability(
    problem: Problem,
    found: Found,
    entries: Sequence[Entry],
    names: Sequence[Term],
    by_name: dict[str, Term],
    joint: int,
) -> list[float]:
    """Per term, the share of random halves of the recording that choose its variables."""
    likely = [one.best.entry for one in screen(problem, found, entries)[:_LIKELY]]
    hits = np.zeros(len(names))
    for seed in range(_HALVES):
        part = replace(problem, rows=_half(problem.rows, seed))
        own = tuple(Member(_on(part.rows, one.entry), one.volume) for one in found.members)
        start = found_set(part, own, found.level, (joint,))
        again = _selected(part, start, [_on(part.rows, one) for one in likely], joint)
        seen = {_term_of(one, by_name).variables for one in again.members[len(own) :]}
        hits += [term.variables in seen for term in names]
    return [float(one) for one in hits / _HALVES]


def _half(rows: Rows, seed: int) -> Rows:
    """A random half of the blocks of all recordings."""
    random, parts = np.random.default_rng(seed), []
    for part in rows.prepared.parts:
        assert part.own.time is not None
        block = ((part.own.time - part.own.time[0]) / _BLOCK).astype(np.int64)
        kept = random.permutation(int(block[-1]) + 1) < (int(block[-1]) + 1) // 2
        parts.append(replace(part, used=part.used & kept[block][:, np.newaxis]))
    return replace(rows, prepared=replace(rows.prepared, parts=tuple(parts)))


def _on(rows: Rows, entry: Entry) -> Entry:
    return replace(entry, white=rows.effect(entry.placed))
