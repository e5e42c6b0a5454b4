"""Any law of a drive's speed without a name, in the place of names that describe one.

A power of the speed, friction that falls with it and a little less dry friction are together nearly any
friction there is: an eddy-current brake, of which each name's probability was 0.96; and a power alone was
another with 0.96, of which other motion showed 76 %. So all members of a set that are laws of one speed are
compared with a single odd function of it, normal and smooth over ln|q̇|, as large as they are before any data
(Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006: its evidence is that of a linear model
in the directions of its covariance).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache, partial

import numpy as np

from ident.discrepancy.by_evidence.decide.no_name import OUTSIDE
from ident.discrepancy.by_evidence.decide.problem import Problem, root_mean_square
from ident.discrepancy.by_evidence.decide.search import Searched
from ident.discrepancy.by_evidence.decide.state import TEMPERATURE, Member, found_set
from ident.discrepancy.by_evidence.evidence.rows import effect_rows
from ident.discrepancy.by_evidence.library.candidates import Entry
from ident.effects.family import Place, PresentModel
from ident.effects.placed import (
    ANY,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    each_drive,
    speed_limit,
    torque_unit,
)
from ident.effects.simulated import FrictionTorque, SimulatedParts
from ident.effects.state import State
from ident.statistics.symmetric import eigen_of
from robots.arrays import FloatArray
from robots.description import Robot

_KNOTS = np.geomspace(0.003, 1.0, 60)
"""Of the speed limit: from where rows are left out, so close that a straight line between two is exact."""

_SMOOTH = 1.0
"""Of ln|q̇|: a law has another course over a speed e times as high, as every name of one has."""

_DIRECTIONS = 10
"""Of the function: they hold all but a ten-thousandth of its variance."""


def free_law(problem: Problem, searched: Searched, number: int) -> float:
    """Log odds of one law of the speed without a name against all members of a set that are laws of it.

    Both leave what an accepted model leaves: that a free law fits better than that is no evidence of it. Nor
    is that it is one where they are several: dry and viscous friction of a drive may well have changed both.

    Args:
        problem: the data.
        searched: the set, and the model that its columns are made of.
        number: of one of these members.

    Returns:
        −∞ where the member is no law of its speed alone.
    """
    found = searched.found
    member = found.members[number]
    here = [k for k, one in enumerate(found.members) if one.candidate.key[1] == member.candidate.key[1]]
    laws = [k for k in here if found.members[k].entry.is_law_of_speed]
    if number not in laws:
        return -math.inf
    size = math.hypot(*(_usual(problem, found.members[k]) for k in laws))
    candidate = replace(member.candidate, family=_family(size), shapes=())
    placed = candidate.at(problem.prepared.robot, (), searched.present)
    law = Member(Entry(candidate, placed, problem.rows.effect(placed)), 0.0)
    rest = [one for k, one in enumerate(found.members) if k not in laws]
    level = found.level
    for joint in law.joints:
        level = level.changed(joint, kappa=float(problem.misfit.accepted[joint]))
    either = (found_set(problem, members, level, ()) for members in ((*rest, law), found.members))
    free, named = (one.log_evidence for one in either)
    return TEMPERATURE * (free - named) + math.log(OUTSIDE)


def _usual(problem: Problem, member: Member) -> float:
    """Root mean square of a member's torque where the joints move, N·m (or N), before any data."""
    columns = effect_rows(problem.prepared, member.entry.placed) * member.entry.white.scale
    return float(root_mean_square(problem.prepared, np.linalg.norm(columns, axis=2)).max())


def _family(size: float) -> Family:
    """An odd function of the drive's speed of this deviation, N·m (or N)."""

    def make(
        robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
    ) -> tuple[Parameters, Law, Parts]:
        row = drive_row(robot, place)
        limit, directions = speed_limit(robot, row), _directions()

        def over_speed(speed: FloatArray, course: FloatArray) -> FloatArray:
            at = np.log(np.maximum(np.abs(speed) / limit, _KNOTS[0]))
            return np.asarray(np.sign(speed) * np.interp(at, np.log(_KNOTS), course))

        def law(state: State) -> FloatArray:
            return along(row, *(over_speed(state.velocity @ row, one) for one in directions.T))

        def parts(values: FloatArray) -> SimulatedParts:
            whole = partial(over_speed, course=directions @ values)
            return SimulatedParts(friction=(FrictionTorque(row, row, whole),))

        count = directions.shape[1]
        symbols = tuple(f"law{k}" for k in range(count))
        units = (torque_unit(robot, place),) * count
        return Parameters(symbols, units, (ANY,) * count, (size,) * count), law, parts

    return Family("law_of_speed", "any law of the speed", "drive", each_drive, make)


@cache
def _directions() -> FloatArray:
    """(knots, directions) of a function of variance 1 over the logarithm of the speed."""
    apart = np.subtract.outer(np.log(_KNOTS), np.log(_KNOTS)) / _SMOOTH
    values, vectors = eigen_of(np.exp(-0.5 * apart**2))
    return np.asarray(vectors[:, -_DIRECTIONS:] * np.sqrt(values[-_DIRECTIONS:]))
