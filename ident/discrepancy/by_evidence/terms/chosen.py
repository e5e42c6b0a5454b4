"""Which one or two terms describe what a joint leaves, by the search's own evidence.

What the misfit takes for its own while no term is there is no measure of what a term explains once it is: the
size of the misfit is learned again beside every set that is tried. All pairs are many, so those that are
tried are the best at several sizes of the misfit, from that beside no term down to the accepted one, by small
solves from one Gram matrix. Terms are not taken one after the other: of two that make up a law neither need
be the best alone.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.discrepancy.by_evidence.decide.names import HELD, SURE
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.screening import information_beside
from ident.discrepancy.by_evidence.decide.state import TEMPERATURE, Found, Member, found_set
from ident.discrepancy.by_evidence.evidence.gram import Level
from ident.discrepancy.by_evidence.library.candidates import Entry
from ident.effects.terms import Term
from robots.arrays import FloatArray, IntArray

MOST = 2
"""Terms of one joint: more is no description."""

_LEVELS = 3
"""Sizes of the misfit at which all are compared."""

Terms = tuple[int, ...]
"""Which of the dictionary's entries."""


def chosen_terms(
    problem: Problem,
    found: Found,
    entries: Sequence[Entry],
    terms: Sequence[Term],
    joint: int,
    leaders: int,
) -> list[tuple[Terms, Found]]:
    """What describes a joint, and the set with it: two terms, then one, as far as each is as sure as a name.

    Of sets that the data do not tell apart at 95 % the one of the fewest variables is taken: what more a
    formula says is then not shown.

    Args:
        problem: the data.
        found: the set without terms.
        entries: the dictionary's.
        terms: of the entries, in their order.
        joint: whose misfit is learned beside each.
        leaders: sets of each size that are tried at each level.
    """
    needed, open_to = float(np.log(SURE / (1.0 - SURE))), float(np.log(HELD / (1.0 - HELD)))
    levels = _levels(problem, found, joint)
    wanted = dict.fromkeys(
        which for level in levels for which in _best(problem, found, entries, level, leaders)
    )
    starts = (levels[0], levels[-1])
    tried = {
        which: _with_terms(problem, found, [entries[i] for i in which], starts, joint) for which in wanted
    }
    choices: list[tuple[Terms, Found]] = []
    least = found.log_posterior + needed
    for size in range(1, MOST + 1):
        sized = {which: one for which, one in tried.items() if len(which) == size}
        best = max((one.log_posterior for one in sized.values()), default=-np.inf)
        if best >= least:
            alike = [which for which, one in sized.items() if one.log_posterior >= max(least, best - open_to)]
            which = min(alike, key=lambda one: (len(variables(terms, one)), -tried[one].log_posterior))
            choices.insert(0, (which, tried[which]))
        least = max(least, best + needed)
    return choices


def variables(terms: Sequence[Term], which: Terms) -> frozenset[str]:
    """Of all these terms."""
    return frozenset[str]().union(*(terms[i].variables for i in which))


def _with_terms(
    problem: Problem, found: Found, entries: Sequence[Entry], starts: Sequence[Level], joint: int
) -> Found:
    """Fitted from several levels, of which the likeliest: each leads to the nearest."""
    members = (*found.members, *(Member(entry, 0.0) for entry in entries))
    fitted = [found_set(problem, members, one, (joint,)) for one in starts]
    return max(fitted, key=lambda one: one.score)


def _levels(problem: Problem, found: Found, joint: int) -> list[Level]:
    """From that of a set down to the accepted one at a joint."""
    kappa, excess = float(found.level.kappa[joint]), float(found.level.excess[joint])
    accepted = min(float(problem.misfit.accepted[joint]), kappa)
    sizes = zip(np.geomspace(kappa, accepted, _LEVELS), np.geomspace(excess, 1.0, _LEVELS), strict=True)
    return [found.level.changed(joint, kappa=float(one), excess=float(other)) for one, other in sizes]


def _best(
    problem: Problem, found: Found, entries: Sequence[Entry], level: Level, leaders: int
) -> list[Terms]:
    """The best single terms and pairs at a level."""
    if not entries:
        return []
    own, score = information_beside(problem.rows, level, found.members, entries)
    prior = np.array([Member(entry, 0.0).log_prior for entry in entries])
    single = TEMPERATURE * _gain_of_one(np.diag(own), score) + prior
    first, second = np.triu_indices(len(entries), 1)
    pair = TEMPERATURE * _gain_of_two(own, score, first, second) + prior[first] + prior[second]
    pairs = np.argsort(-pair)[:leaders]
    alone = [(int(i),) for i in np.argsort(-single)[:leaders]]
    return [*alone, *((int(first[i]), int(second[i])) for i in pairs)]


def _gain_of_one(own: FloatArray, score: FloatArray) -> FloatArray:
    """Log evidence of each by itself, its factor of unit deviation before the data."""
    return np.asarray(0.5 * score**2 / (1.0 + own) - 0.5 * np.log1p(own))


def _gain_of_two(own: FloatArray, score: FloatArray, first: IntArray, second: IntArray) -> FloatArray:
    """The same of pairs."""
    a, b, c = 1.0 + own[first, first], 1.0 + own[second, second], own[first, second]
    x, y, volume = score[first], score[second], a * b - c**2
    return np.asarray(0.5 * (b * x**2 - 2.0 * c * x * y + a * y**2) / volume - 0.5 * np.log(volume))
