"""Shapes of several members of a set fitted at once, by Gauss and Newton's steps.

Where members change each other's resonances, shapes fitted one after the other creep along a ridge: after
four rounds gears of 9 and 11 Hz were 3 % off, six times what their resonances are wide, and what that left
had names. What a set makes of a small change of a shape is a column like any other, and the evidence says how
far to go along all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.discrepancy.by_evidence.decide.as_one import as_one
from ident.discrepancy.by_evidence.decide.present_with import present_with
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.shapes import log_number
from ident.discrepancy.by_evidence.decide.state import Found, Member, found_set
from ident.discrepancy.by_evidence.evidence.gram import Gram
from ident.discrepancy.by_evidence.evidence.rows import WhiteEffects
from ident.discrepancy.component import inner, outer, reach
from ident.effects.family import PlacedEffect, Shape
from ident.effects.placed import ANY, Placed
from ident.effects.state import State
from robots.arrays import FloatArray

_SMALL = 5e-4
"""Of a shape's range: the change that a column is made of."""
_FARTHEST = 0.05
"""Of a shape's range, in one step."""
_STEPS, _HALVED = 8, 3
_ENOUGH = 0.5
"""Nats; a step that gains less is the last."""


@dataclass(frozen=True)
class _Free:
    """A shape that is fitted.

    Attributes:
        number: of the member.
        place: among its shapes.
        shape: its limits.
        column: what a change of the shape's whole range makes, as the change does that is made.
    """

    number: int
    place: int
    shape: Shape
    column: WhiteEffects


def shapes_at_once(problem: Problem, found: Found, numbers: Sequence[int]) -> Found:
    """A set with the shapes of some members fitted at once, κ of all joints.

    Args:
        problem: the data.
        found: the set, whose members' columns are made beside each other.
        numbers: the members.
    """
    found = as_one(problem, found_set(problem, found.members, found.level, range(problem.rows.n)))
    for _ in range(_STEPS):
        free = [one for number in numbers for one in _changes(problem, found, number)]
        step, widths = _step(problem, found, free)
        best = found
        for halved in range(_HALVED):
            tried = _moved(problem, found, free, 0.5**halved * step, widths)
            if tried.score > best.score:
                best = tried
                break
        gained, found = best.score - found.score, best
        if gained < _ENOUGH:
            break
    return found


def _changes(problem: Problem, found: Found, number: int) -> list[_Free]:
    """What a set makes of small changes of a member's shapes."""
    member, robot = found.members[number], problem.prepared.robot
    present, theta = present_with(problem, found, but=number), found.theta(number)[0]
    kind, at = member.candidate, member.entry.placed.shape
    made, here = [], kind.at(robot, at, present)
    assert isinstance(here, Placed)
    for k, shape in enumerate(kind.shapes):
        if shape.fixed:
            continue
        small = _SMALL * reach(shape)
        small = -small if inner(shape, at[k]) + small > inner(shape, shape.upper) else small
        other = kind.at(robot, (*at[:k], outer(shape, inner(shape, at[k]) + small), *at[k + 1 :]), present)

        def law(state: State, other: PlacedEffect = other, small: float = small) -> FloatArray:
            change = (other.columns(state) - here.columns(state)) @ theta
            return np.asarray(change / small)[:, :, np.newaxis]

        placed = replace(
            here, law=law, parameters=here.parameters[:1], bounds=(ANY,), scale=(reach(shape),), centre=(0.0,)
        )
        made.append(_Free(number, k, shape, problem.rows.effect(placed)))
    return [one for one in made if one.column.there]


def _step(problem: Problem, found: Found, free: Sequence[_Free]) -> tuple[FloatArray, FloatArray]:
    """How far to go along each shape, and how wide the posterior is along it."""
    own = [member.entry.white for member in found.members]
    posterior = Gram(problem.rows, (*own, *(one.column for one in free))).posterior(found.level)
    ranges = np.array([reach(one.shape) for one in free])
    step = posterior.theta[posterior.theta.size - len(free) :] * ranges
    part = posterior.covariance[-len(free) :, -len(free) :]
    widths = ranges / np.sqrt(np.diag(np.linalg.inv(part)))
    return step * min(1.0, _FARTHEST / float(np.max(np.abs(step) / ranges))), widths


def _moved(
    problem: Problem, found: Found, free: Sequence[_Free], step: FloatArray, widths: FloatArray
) -> Found:
    """A set with other shapes."""
    shapes = [list(member.entry.placed.shape) for member in found.members]
    for one, way in zip(free, step, strict=True):
        value = outer(one.shape, inner(one.shape, shapes[one.number][one.place]) + way)
        shapes[one.number][one.place] = float(np.clip(value, one.shape.lower, one.shape.upper))
    members, numbers = list(found.members), {one.number for one in free}
    for number in numbers:  # with columns of old: the model beside the others asks for shapes alone
        own, shape = members[number], tuple(shapes[number])
        placed = own.candidate.at(problem.prepared.robot, shape, problem.present)
        volume = _volume(own, number, free, widths)
        members[number] = Member(replace(own.entry, placed=placed), volume)
    made = as_one(problem, replace(found, members=tuple(members)))
    return found_set(problem, made.members, found.level, range(problem.rows.n))


def _volume(member: Member, number: int, free: Sequence[_Free], widths: FloatArray) -> float:
    """Log of the posterior's width over that of the prior, shape by shape; fixed ones by their number."""
    own = [
        np.sqrt(2.0 * np.pi) * width / (inner(one.shape, one.shape.upper) - inner(one.shape, one.shape.lower))
        for one, width in zip(free, widths, strict=True)
        if one.number == number
    ]
    return float(np.log(np.minimum(own, 1.0)).sum()) - log_number(member.candidate)
