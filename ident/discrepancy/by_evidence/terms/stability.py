"""How many halves of a recording say the same as the whole (Meinshausen and Bühlmann 2010).

Terms that are next to the same function over a motion take each other's place from half to half. Such halves
agree: they choose the same variables, or terms that make the same torque.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.screening import information_beside
from ident.discrepancy.by_evidence.decide.state import Found, Member, found_set
from ident.discrepancy.by_evidence.evidence.rows import Rows
from ident.discrepancy.by_evidence.library.candidates import Entry
from ident.discrepancy.by_evidence.terms.chosen import Terms, chosen_terms, variables
from ident.effects.terms import Term
from robots.arrays import FloatArray

_HALVES = 10
STABLE = 0.8
"""Share of halves of the recording that have to say the same."""

_OTHERWISE = 0.3
"""Of a torque: as much may be otherwise where it is the same, beside what chance makes at 95 %."""

_BLOCK = 1.0
"""s, of recording that stays together in a half: longer than any memory of the noise."""

_LEADERS = 4
"""Sets of each size that are tried on a half at each level."""


def stability(
    problem: Problem,
    found: Found,
    entries: Sequence[Entry],
    terms: Sequence[Term],
    whole: tuple[Terms, Found],
    joint: int,
) -> float:
    """Share of random halves of the recording that agree with what the whole chose.

    Args:
        problem: the data.
        found: the set without terms.
        entries, terms: the dictionary's.
        whole: what was chosen, and the set with it.
        joint: whose terms these are, from 0.
    """
    which, chosen = whole
    metric, _ = information_beside(problem.rows, chosen.level, found.members, entries)
    torque, wanted = _factors(chosen, which, len(entries)), variables(terms, which)
    hits = 0
    for seed in range(_HALVES):
        part = replace(problem, rows=_half(problem.rows, seed))
        own = [_on(part.rows, entry) for entry in entries]
        start = found_set(part, [_member_on(part.rows, one) for one in found.members], found.level, (joint,))
        again, other = (*chosen_terms(part, start, own, terms, joint, _LEADERS), ((), start))[0]
        same = bool(again) and variables(terms, again) == wanted
        hits += same or _same_torque(metric, torque, _factors(other, again, len(entries)), len(which))
    return hits / _HALVES


def _factors(found: Found, which: Terms, count: int) -> FloatArray:
    """(count,) of all entries, in units of their scales."""
    factors = np.zeros(count)
    factors[list(which)] = found.posterior.theta[found.posterior.theta.size - len(which) :]
    return factors


def _same_torque(metric: FloatArray, whole: FloatArray, half: FloatArray, terms: int) -> bool:
    """Whether two sets of factors make the same torque, in what the rows show of it (metric)."""
    apart = whole - half
    by_chance = float(chi2.ppf(0.95, terms))
    return float(apart @ metric @ apart) <= _OTHERWISE**2 * float(whole @ metric @ whole) + by_chance


def _half(rows: Rows, seed: int) -> Rows:
    """A random half of the blocks of all recordings."""
    random, parts = np.random.default_rng(seed), []
    for part in rows.prepared.parts:
        assert part.own.time is not None
        block = ((part.own.time - part.own.time[0]) / _BLOCK).astype(np.int64)
        kept = random.permutation(int(block[-1]) + 1) < (int(block[-1]) + 1) // 2
        parts.append(replace(part, used=part.used & kept[block][:, np.newaxis]))
    return replace(rows, prepared=replace(rows.prepared, parts=tuple(parts)))


def _member_on(rows: Rows, member: Member) -> Member:
    return Member(_on(rows, member.entry), member.volume)


def _on(rows: Rows, entry: Entry) -> Entry:
    return replace(entry, white=rows.effect(entry.placed))
