"""What shows at reversals: the same evidence, of the simulated closed loop.

Rows at which a joint hardly moves are no part of the moving arm's evidence. In the simulated loop they count,
and what differs there alone (sticking, a small play) is named by the same model of the data, the same misfit
and the same prior as what the moving arm shows.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, zip_longest

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.discrepancy.by_evidence.decide.left_over import misfit_of
from ident.discrepancy.by_evidence.decide.names import NOTHING, SURE, Key, Slot, as_limit, probabilities
from ident.discrepancy.by_evidence.decide.no_name import NO_NAME
from ident.discrepancy.by_evidence.decide.present_with import PresentWith, present_with
from ident.discrepancy.by_evidence.decide.problem import Problem, level_beside, root_mean_square
from ident.discrepancy.by_evidence.decide.scanned import scanned
from ident.discrepancy.by_evidence.decide.screening import Screened, screen
from ident.discrepancy.by_evidence.decide.search import LEADERS
from ident.discrepancy.by_evidence.decide.shapes import refined
from ident.discrepancy.by_evidence.decide.state import (
    TEMPERATURE,
    Found,
    Member,
    found_set,
    without_effects,
)
from ident.discrepancy.by_evidence.evidence.loop_rows import LoopRows, loop_rows
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry, candidates, library
from ident.discrepancy.by_evidence.where_it_acts import explains_more_than_is_left, odds_of_no_name
from ident.discrepancy.loop import Standstill
from ident.discrepancy.step import LoopStep, Step
from ident.effects.family import EffectFamily, PlacedEffect
from robots.arrays import BoolArray, FloatArray

_log = logging.getLogger(__name__)

_OF_BEST = 0.5
"""Of the nats that an effect has with its best shape, what the best of its grid has at least."""

Heard = Callable[[Problem, Sequence[Entry]], None]
"""Told of the model, and of simulated effects that show at reversals alone."""


def nobody(problem: Problem, entries: Sequence[Entry]) -> None:
    """Who does not ask."""


@dataclass(frozen=True)
class AtReversals:
    """The likeliest effect that the simulated loop shows.

    Attributes:
        placed: with its shapes.
        names: for it, nothing and something without a name among them; of other motion they know nothing.
    """

    placed: PlacedEffect
    names: Slot

    @property
    def key(self) -> Key:
        return self.placed.name, self.placed.place.joints


def likeliest_in_loop(
    problem: Problem,
    families: Sequence[EffectFamily],
    found: Collection[Key],
    joints: Collection[int],
    beside: Sequence[tuple[PlacedEffect, FloatArray]] = (),
    heard: Heard = nobody,
) -> AtReversals | None:
    """The likeliest effect at some joints beside a model in closed loop; None where nothing is as likely.

    One at a time: its columns hold for the model as it is, and one that has it is simulated before the next.

    Args:
        problem: a model in closed loop (:func:`posed_in_loop`).
        families: that show at reversals.
        found: names and places that are no further effect.
        joints: from 0.
        beside: what motion has shown, each with its parameters (p,).
        heard: told of what was simulated.
    """
    rows = problem.rows
    assert isinstance(rows, LoopRows)
    empty = without_effects(problem)
    present = present_with(problem, empty)
    wanted = [
        one
        for one in candidates(problem.prepared.robot, families)
        if one.key not in found and set(one.place.joints) & set(joints)
    ]
    entries = [*library(rows, wanted, present), *scanned(rows, empty, wanted, present)]
    screened = screen(problem, empty, entries)
    quickest = _quickest(screened, entries)
    odds: dict[Key, float] = {NOTHING: 0.0}
    forms: dict[Key, PlacedEffect] = {}
    sets: dict[Key, Found] = {}
    exact = replace(problem, rows=rows.exactly())
    leaders: set[Key] = set()
    fits = at_once(lambda one: _simulated(exact, empty, one, present), quickest)
    heard(exact, [fit.members[0].entry for fit in fits if fit is not None])
    asked = zip(quickest, fits, strict=True)
    for one, fitted in chain(asked, _with_leaders(exact, empty, screened, present, leaders)):
        key = one.candidate.key
        value = one.log_odds if fitted is None else fitted.log_posterior - empty.log_posterior
        if value > odds.get(key, -np.inf):
            odds[key] = value
            forms[key] = (one.best if fitted is None else fitted.members[0]).entry.placed
            if fitted is not None:
                sets[key] = fitted
        if fitted is not None and one not in quickest:
            leaders.add(key)
    names = Slot(as_limit(probabilities(odds, forms)))
    first = names.names[0].key
    if first not in sets or names.something < SURE or not explains_more_than_is_left(exact, sets[first]):
        return None
    _log.info("the loop shows %s at %s, %.1f nats", *first, names.log_odds(first))
    odds[NO_NAME, first[1]] = odds[first] + odds_of_no_name(exact, sets[first], beside)
    return AtReversals(forms[first], Slot(as_limit(probabilities(odds, forms), first)))


def _quickest(screened: Sequence[Screened], entries: Sequence[Entry]) -> list[Screened]:
    """What shows at reversals alone, with the shape that acts for the shortest way; nothing has screened it.

    Dry friction that is 50 µrad late turns its sign within 2 ms. Columns of rows that are 8 ms apart say
    nothing of that: a sticking of drive 6 had 23 nats once it was simulated, and was the twentieth of them.
    """
    first: dict[Candidate, Entry] = {}
    for entry in entries:
        first.setdefault(entry.candidate, entry)
    alone = [one.candidate for one in screened if one.candidate.family.shows == "reversal"]
    return [Screened(Member(first[one], -float(np.log(one.combinations))), -np.inf) for one in alone]


def _with_leaders(
    problem: Problem,
    empty: Found,
    screened: Sequence[Screened],
    present: PresentWith,
    leaders: Collection[Key],
) -> Iterator[tuple[Screened, Found | None]]:
    """Candidates in their order, each with its set; without one after the leaders, which who asks counts.

    Each is one leader more at most, so as many as are missing are simulated at once, and none in vain.
    """
    while screened:
        missing = LEADERS - len(leaders)
        some, screened = (screened[:missing], screened[missing:]) if missing else (screened, ())
        made = at_once(lambda one: _simulated(problem, empty, one, present), some) if missing else []
        yield from zip_longest(some, made)


def posed_in_loop(step: LoopStep, used: BoolArray | None = None) -> Problem:
    """A model that was examined in closed loop, before any effect is added; its rows are :class:`LoopRows`.

    Args:
        step: with the model.
        used: as of :func:`loop_rows`.

    Raises:
        IdentificationError: the loop cannot be simulated.
    """
    examination = step.examination
    rows, beta = loop_rows(examination, used)
    misfit, fitted = level_beside(rows, None)
    base, start = examination.base, examination.beta
    score, level, posterior = fitted
    return Problem(base, examination.prior, start, step.present, rows, beta, misfit, level, score, posterior)


def by_any_law(moving: Step, problem: Problem) -> Problem | None:
    """A model in closed loop whose friction at standstill follows any law, where that is likelier.

    Args:
        moving: the model.
        problem: the same in closed loop, with the law that the recordings chose.

    Returns:
        None where that law is likelier.

    Raises:
        IdentificationError: the loop cannot be simulated.
    """
    step = moving.in_loop(any_law=True)
    if step is None:
        return None
    other = posed_in_loop(step, problem.prepared.used)
    nats = TEMPERATURE * (other.score - problem.score)
    _log.info("friction at standstill by any law: %.1f nats", nats)
    return other if nats > 0.0 else None


def standstill_in(problem: Problem) -> Standstill:
    """How the dry friction of each drive turns its sign in a model in closed loop."""
    assert isinstance(problem.rows, LoopRows)
    return problem.rows.loop.standstill


def _simulated(problem: Problem, empty: Found, one: Screened, present: PresentWith) -> Found | None:
    """An effect alone with columns that are simulated, its shapes fitted where it can come to be likely.

    Returns:
        None where the loop with it cannot be simulated, or shows nothing of it.
    """
    old = one.best.entry
    placed = old.candidate.at(problem.prepared.robot, old.placed.shape, present)
    member = Member(Entry(old.candidate, placed, problem.rows.effect(placed)), one.best.volume)
    if not member.entry.white.there:
        return None
    found = found_set(problem, (member,), empty.level, member.joints)
    gain = found.log_evidence - empty.log_evidence
    if TEMPERATURE * gain / _OF_BEST + member.log_prior <= 0.0:
        return found
    shaped = refined(problem, found.members, 0, found, present, made=True)
    best = found_set(problem, (shaped,), found.level, shaped.joints)
    return max(best, found, key=lambda one: one.log_posterior)


def beyond_margin(problem: Problem) -> bool:
    """Whether any law of friction at standstill leaves more of a drive's torque than gate 1's margin.

    Its columns hold to first order, so noise is no measure of what they leave.
    """
    left = misfit_of(problem, without_effects(problem)) / root_mean_square(problem.prepared)
    _log.info("any law leaves at most %.1f %% of a drive's torque", 100.0 * left.max())
    return bool(left.max() > problem.prepared.robot.identification.torque_margin)
