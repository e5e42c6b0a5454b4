"""What an effect of the simulated loop explains where it acts, beside what every arm leaves there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.discrepancy.by_evidence.decide.left_over import residual_rows, usual_at
from ident.discrepancy.by_evidence.decide.no_name import AS_NOT, OUTSIDE
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.state import Found, without_effects
from ident.discrepancy.by_evidence.evidence.loop_rows import LoopRows
from ident.discrepancy.by_evidence.library.candidates import is_friction
from ident.effects.family import PlacedEffect
from robots.arrays import FloatArray

_HARDLY = 1e-6
"""Of its speed, at which viscous friction is nothing and dry friction is all there."""


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


def explains_more_than_is_left(problem: Problem, found: Found) -> bool:
    """Whether an effect explains more than stays unexplained, on the rows where it acts."""
    on = _where_it_acts(problem, found)
    rough = problem.rows.noise[on.joint].marginal ** 2 * (found.level.excess[on.joint] ** 2 - 1.0)
    explained = float(np.average(on.squares, weights=on.squares))
    return explained > float(found.level.kappa[on.joint] ** 2 + rough)


def odds_of_no_name(
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
