"""What shows at reversals: the same evidence, of the simulated closed loop.

Rows at which a joint hardly moves are no part of the moving arm's evidence. In the simulated loop they count,
and what differs there alone (sticking, a small play) is named by the same model of the data, the same misfit
and the same prior as what the moving arm shows.
"""

from __future__ import annotations

import logging
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, zip_longest

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.discrepancy.by_evidence.decide.left_over import misfit_of, residual_rows, usual_at
from ident.discrepancy.by_evidence.decide.names import NOTHING, SURE, Key, Slot, as_limit, probabilities
from ident.discrepancy.by_evidence.decide.no_name import AS_NOT, NO_NAME, OUTSIDE
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
from ident.discrepancy.by_evidence.library.candidates import (
    Candidate,
    Entry,
    candidates,
    is_friction,
    library,
)
from ident.discrepancy.loop import Standstill
from ident.discrepancy.step import LoopStep, Step
from ident.effects.family import EffectFamily, PlacedEffect
from robots.arrays import BoolArray, FloatArray

_log = logging.getLogger(__name__)

_OF_BEST = 0.5
"""Of the nats that an effect has with its best shape, what the best of its grid has at least."""

_HARDLY = 1e-6
"""Of its speed, at which viscous friction is nothing and dry friction is all there."""


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
) -> AtReversals | None:
    """The likeliest effect at some joints beside a model in closed loop; None where nothing is as likely.

    One at a time: its columns hold for the model as it is, and one that has it is simulated before the next.

    Args:
        problem: a model in closed loop (:func:`posed_in_loop`).
        families: that show at reversals.
        found: names and places that are no further effect.
        joints: from 0.
        beside: what motion has shown, each with its parameters (p,).
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
    asked = zip(quickest, at_once(lambda one: _simulated(exact, empty, one, present), quickest), strict=True)
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
    if first not in sets or names.something < SURE or not _explains(exact, sets[first]):
        return None
    _log.info("the loop shows %s at %s, %.1f nats", *first, names.log_odds(first))
    odds[NO_NAME, first[1]] = odds[first] + _odds_of_no_name(exact, sets[first], beside)
    return AtReversals(forms[first], Slot(as_limit(probabilities(odds, forms), first)))


def _odds_of_no_name(
    problem: Problem, found: Found, beside: Sequence[tuple[PlacedEffect, FloatArray]]
) -> float:
    """Log odds of something without a name against the only effect of a set, before other motion is asked.

    What every arm leaves is on all rows, and an effect of reversals on few: what it takes off the residual
    where it acts is compared with that. (A static friction of 0.25 N·m was 0.02 N·m on all rows, where 0.03
    are usual, and left 0.08 of 0.18 where it acts; one that was not there left 0.068 of 0.069.) How a
    friction that motion has shown turns its sign no moving row says, and the law of its drive is that of the
    friction before it: what is more at the same drive's reversals is as likely as not that, where it is no
    more than what of that friction turns (a Stribeck friction is more than one that cools and is viscous for
    the most).
    """
    (member,), on = found.members, _where_it_acts(problem, found)
    at = member.candidate.key[1]
    on_it = [pair for pair in beside if pair[0].place.joints == at and is_friction(pair[0])]
    turns = sum(_most_as_it_turns(problem, *pair) for pair in on_it)
    turned = member.is_friction and turns > float(np.sqrt(on.squares.max()))
    as_usual = _closed(problem, found, on) <= usual_at(problem, found, on.joint) ** 2
    return float(np.log(AS_NOT if turned or as_usual else OUTSIDE))


def _closed(problem: Problem, found: Found, on: _Acting) -> float:
    """(N·m)² (or N²) that an effect takes off the mean square of the residual where it acts."""
    sets = without_effects(problem), found
    before, after = (residual_rows(problem.rows, one)[:, on.joint] for one in sets)
    return float(np.average(before**2 - after**2, weights=on.squares))


def _most_as_it_turns(problem: Problem, placed: PlacedEffect, values: FloatArray) -> float:
    """The most that a friction with its parameters (p,) comes to where drives hardly move, N·m (or N)."""
    assert isinstance(problem.rows, LoopRows)
    loop = problem.rows.loop
    variant, motion = loop.variant(placed), loop.motion_of_rows()
    slow = [replace(one, velocity=_HARDLY * one.velocity) for one in motion]
    return max(float(np.abs(variant.columns(one) @ values).max()) for one in slow)


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


def _explains(problem: Problem, found: Found) -> bool:
    """Whether an effect explains more than stays unexplained, on the rows where it acts."""
    on = _where_it_acts(problem, found)
    rough = problem.rows.noise[on.joint].marginal ** 2 * (found.level.excess[on.joint] ** 2 - 1.0)
    explained = float(np.average(on.squares, weights=on.squares))
    return explained > float(found.level.kappa[on.joint] ** 2 + rough)


@dataclass(frozen=True)
class _Acting:
    """Where an effect acts.

    Attributes:
        joint: where it shows most.
        squares: (rows,) of its torque there, (N·m)² (or N²), by which a row counts; 0 of what is not used.
    """

    joint: int
    squares: FloatArray


def _where_it_acts(problem: Problem, found: Found) -> _Acting:
    """Of the only effect of a set."""
    (member,) = found.members
    torque = problem.rows.thin(member.entry.placed) @ found.theta(0)[0]
    joint = max(member.joints, key=lambda j: float(np.sum(torque[:, j] ** 2)))
    return _Acting(joint, np.where(problem.prepared.used[:, joint], torque[:, joint], 0.0) ** 2)


def beyond_margin(problem: Problem) -> bool:
    """Whether any law of friction at standstill leaves more of a drive's torque than gate 1's margin.

    Its columns hold to first order, so noise is no measure of what they leave.
    """
    left = misfit_of(problem, without_effects(problem)) / root_mean_square(problem.prepared)
    _log.info("any law leaves at most %.1f %% of a drive's torque", 100.0 * left.max())
    return bool(left.max() > problem.prepared.robot.identification.torque_margin)
