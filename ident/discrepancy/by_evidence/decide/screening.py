"""Every candidate beside a set, by small solves from one Gram matrix; κ as the set has it, or as accepted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg import cho_solve, cholesky
from scipy.special import logsumexp

from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.state import TEMPERATURE, Found, Member, stands
from ident.discrepancy.by_evidence.evidence.gram import Gram, Level
from ident.discrepancy.by_evidence.evidence.library_products import LibraryProducts
from ident.discrepancy.by_evidence.evidence.rows import Rows
from ident.discrepancy.by_evidence.evidence.solved import mass_within
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.effects.vocabulary import confused_with
from robots.arrays import FloatArray

_ROUGH = 1.1
"""s of rows; beside less an effect is short of a hundredth of a nat per row at most."""


@dataclass(frozen=True, eq=False)
class Screened:
    """A candidate beside a set.

    Attributes:
        best: with the best shape of its grid.
        gain: log evidence over the set without it, its shapes averaged over the grid.
        log_odds: coarsened, with its prior.
    """

    best: Member
    gain: float

    @property
    def candidate(self) -> Candidate:
        return self.best.candidate

    @property
    def log_odds(self) -> float:
        return TEMPERATURE * self.gain + self.best.log_prior


def screen(problem: Problem, found: Found, entries: Sequence[Entry]) -> list[Screened]:
    """All candidates that are not in a set and can be beside it, the likeliest first."""
    gains = _gains(problem, found, entries)
    taken = {member.candidate.key for member in found.members if not member.candidate.family.several}
    grouped: dict[Candidate, list[int]] = {}
    for number, entry in enumerate(entries):
        if entry.candidate.key not in taken and stands(problem, entry, found.members):
            grouped.setdefault(entry.candidate, []).append(number)
    screened = []
    for numbers in grouped.values():
        own = np.array([gains[number] for number in numbers])
        # What was scanned and is no peak has its share of the prior, and next to none of the evidence.
        scanned = entries[numbers[0]].candidate.is_scanned
        tried = entries[numbers[0]].candidate.combinations if scanned else own.size
        mean = float(logsumexp(own) - np.log(tried))
        best = numbers[int(np.argmax(own))]
        member = Member(entries[best], mean - float(own.max()))
        screened.append(Screened(member, mean))
    return sorted(screened, key=lambda one: -one.log_odds)


def with_all_forms(screened: Sequence[Screened], most: int, own: Candidate) -> list[Screened]:
    """The likeliest names at their places, so many, and all that pass for one, each with every form of it.

    A form whose best shape lies between those of its grid comes late, and is the likeliest once it is fitted:
    friction of the load on the motor's side (5th on its grid) was not asked beside a directional efficiency,
    which was sure of its name then.

    Args:
        screened: names for a place, the likeliest first.
        most: of them, whatever they are.
        own: what has the place; what passes for it there counts if it is likelier than nothing.
    """
    (name, joints), here = own.key, [one for one in screened if one.log_odds > 0.0]
    confused = {(other, joints) for other in confused_with(name)}
    names = {one.candidate.key for one in here} & confused
    names |= set(list(dict.fromkeys(one.candidate.key for one in screened))[:most])
    return [one for one in screened if one.candidate.key in names]


def _gains(problem: Problem, found: Found, entries: Sequence[Entry]) -> FloatArray:
    """(entries,) log evidence of the set with each of them, less that of the set.

    At the set's own κ, which is large where something is missing and takes up most of what an effect says;
    and, of a joint where it is above the accepted one, at that, which the right effect would leave: a drive
    that saturates pays for its rows before any other κ is tried, and had −12 nats for the 33 that it has.
    Where rows hold what is not smooth, without that, too: beside rows 26 times as noisy as their noise a
    saturation of 2050 nats was not among the first hundred, and five names stood in its place.
    """
    rows, members = problem.rows, tuple(member.entry.white for member in found.members)
    products: LibraryProducts = rows.kept.of(
        entries, lambda: LibraryProducts.of(rows, tuple(entry.white for entry in entries))
    )
    gram, accepted = Gram(rows, members), problem.misfit.accepted
    gains = _gains_at(products, gram, found.level, entries)
    for level, joint in _as_accepted(found.level, accepted):
        less = gram.posterior(level).log_evidence + problem.misfit.log_prior(level) - found.score
        here = [joint in entry.white.at for entry in entries]
        gains = np.where(here, np.maximum(gains, less + _gains_at(products, gram, level, entries)), gains)
    return gains


def _as_accepted(level: Level, accepted: FloatArray) -> Iterator[tuple[Level, int]]:
    """The level with one joint's κ, s or both as the right effect would leave them, where they are more."""
    for joint, (kappa, excess) in enumerate(zip(level.kappa, level.excess, strict=True)):
        less = {float(kappa), float(np.minimum(kappa, accepted[joint]))}
        calmer = {float(excess), 1.0 if excess > _ROUGH else float(excess)}
        for both in sorted(product(less, calmer))[:-1]:  # the last is the level itself
            yield level.changed(joint, *both), joint


def _gains_at(products: LibraryProducts, gram: Gram, level: Level, entries: Sequence[Entry]) -> FloatArray:
    """(entries,) the same at one level of the misfit."""
    blocks = list(products.beside(gram, level))
    gains, counts = np.empty(len(entries)), [entry.white.count for entry in entries]
    for count in set(counts):
        here = [k for k, one in enumerate(counts) if one == count]
        own, score = (np.stack([blocks[k][part] for k in here]) for part in (0, 1))
        gains[here] = _alike(own, score, [entries[k] for k in here])
    return gains


def information_beside(
    rows: Rows, level: Level, found: Sequence[Member], entries: Sequence[Entry]
) -> tuple[FloatArray, FloatArray]:
    """Information (P, P) and score (P,) of the columns of entries, with all else integrated.

    Args:
        rows: the data.
        level: of the misfit.
        found: members of a set that they stand beside.
        entries: whose columns follow each other, in units of their scales.
    """
    members = [member.entry.white for member in found]
    gram = Gram(rows, (*members, *(entry.white for entry in entries)))
    whole, _ = gram.reduced(level)
    precision = rows.precision
    k, p = precision.size, int(gram.starts[len(members)])
    y = k
    inner = np.concatenate([np.arange(k), np.arange(k + 1, k + 1 + p)])
    centre = np.concatenate([part.centre for part in members]) if members else np.zeros(0)
    outer = slice(k + 1 + p, None)
    system = whole[np.ix_(inner, inner)]
    system[np.arange(k + p), np.arange(k + p)] += np.concatenate([precision, np.ones(p)])
    factor = cholesky(system, lower=True, check_finite=False)
    right = whole[inner, y] - whole[inner, k + 1 : k + 1 + p] @ centre
    beside = whole[inner, outer]
    solved = cho_solve((factor, True), np.column_stack([beside, right]), check_finite=False)
    own = whole[outer, outer]
    own -= beside.T @ solved[:, :-1]
    score = whole[outer, y] - whole[outer, k + 1 : k + 1 + p] @ centre - beside.T @ solved[:, -1]
    return own, score


def gains_beside(rows: Rows, found: Found, entries: Sequence[Entry]) -> FloatArray:
    """(E,) log evidence of a set with each of some entries, less that of the set; κ as the set has it.

    Args:
        rows: the data.
        found: the set.
        entries: with as many parameters each, and rows that show them.
    """
    if not entries:
        return np.zeros(0)
    own, score = information_beside(rows, found.level, found.members, entries)
    each = np.arange(score.size).reshape(len(entries), -1)
    return _alike(own[each[:, :, np.newaxis], each[:, np.newaxis, :]], score[each], entries)


def _alike(own: FloatArray, score: FloatArray, entries: Sequence[Entry]) -> FloatArray:
    """(E,) gains of effects with as many parameters: ½ zᵀA⁻¹z − ½ log |A| about the centre, and bounds.

    Args:
        own: (E, p, p) information of each.
        score: (E, p).
        entries: (E,).
    """
    centre, bounds = (
        np.stack([getattr(one.white, name) for one in entries]) for name in ("centre", "bounds")
    )
    shown = np.einsum("epq,eq->ep", own, centre)
    system = own + np.eye(score.shape[1])
    inverse = np.linalg.inv(system)
    mean = np.einsum("epq,eq->ep", inverse, score - shown)
    gain = 0.5 * np.sum((score - shown) * mean, axis=1) - 0.5 * np.linalg.slogdet(system)[1]
    gain += np.sum(score * centre, axis=1) - 0.5 * np.sum(centre * shown, axis=1)
    deviation = np.sqrt(np.maximum(np.diagonal(inverse, axis1=1, axis2=2), 1e-300))
    gain += mass_within(mean + centre, deviation, centre, bounds)
    return np.asarray(gain - np.array([one.white.unsaid for one in entries]))
