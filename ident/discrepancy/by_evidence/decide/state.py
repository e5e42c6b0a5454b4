"""A set of placed effects beside the model, with its evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.evidence.gram import Gram, Level
from ident.discrepancy.by_evidence.evidence.kappa import fitted
from ident.discrepancy.by_evidence.evidence.solved import Posterior
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry
from ident.effects.usual import SYMBOLS
from robots.arrays import FloatArray

TEMPERATURE = 0.5
"""T of evidence^T: what the model of the data is trusted for (Miller and Dunson 2019); set by calibration."""

ONE_MORE = 0.2
"""Prior odds of one effect more: of six arms that are looked at five are clean."""


OF_JOINT = 2
"""Frictions of one joint: three names together describe any law there is, and none of them is there."""


@dataclass(frozen=True, eq=False)
class Member:
    """One effect of a set.

    Attributes:
        entry: with its shape.
        volume: log of the share of its shapes' prior that the data leave: what integrating over them costs.
    """

    entry: Entry
    volume: float

    @property
    def candidate(self) -> Candidate:
        return self.entry.candidate

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints whose misfit an effect can take the place of."""
        return self.candidate.place.joints or self.entry.white.at

    @property
    def is_friction(self) -> bool:
        return self.entry.is_friction

    @property
    def log_prior(self) -> float:
        """Log odds of this effect being there, before any data."""
        return float(np.log(ONE_MORE * self.candidate.share))


@dataclass(frozen=True, eq=False)
class Found:
    """A set with everything that is fitted to it.

    Attributes:
        members: in the order in which they came.
        level: of the misfit.
        score: log evidence with the prior of κ and s.
        posterior: of known factors and θ.
        possible: log probability that friction of the drives is not below nothing (:mod:`.possible`).
    """

    members: tuple[Member, ...]
    level: Level
    score: float
    posterior: Posterior
    possible: float = 0.0

    @property
    def log_evidence(self) -> float:
        """Shapes, κ and impossible sizes counted in."""
        return self.score + self.possible + sum(member.volume for member in self.members)

    @property
    def log_posterior(self) -> float:
        """Coarsened, with the prior of the set; up to a constant."""
        return TEMPERATURE * self.log_evidence + sum(member.log_prior for member in self.members)

    def theta(self, number: int) -> tuple[FloatArray, FloatArray]:
        """Values and covariance of a member's parameters, in their units."""
        start = sum(member.entry.white.count for member in self.members[:number])
        scale = self.members[number].entry.white.scale
        part = slice(start, start + scale.size)
        k = self.posterior.known.size
        inside = slice(k + part.start, k + part.stop)
        covariance = self.posterior.covariance[inside, inside] * np.outer(scale, scale)
        return self.posterior.theta[part] * scale, covariance


def stands(problem: Problem, entry: Entry, members: Sequence[Member]) -> bool:
    """Whether what an effect is on top of is there, in the model or among the members of a set.

    Friction that falls with speed is a rise of dry friction by its own equation; in its stead it would be dry
    friction that is gone at speed, which no bearing has. And friction of a drive that moves several joints
    goes with all of them: a model that has it along one lacks the coupling, whatever else that friction does.
    """
    here = {member.candidate.key for member in members}
    joints = entry.candidate.place.joints
    if not all(
        (name, joints) in here or problem.present.has(SYMBOLS[name], joints[0])
        for name in entry.candidate.family.on_top_of
    ):
        return False
    coupled = {drives[-1] for name, drives in here if name == "wrist_coupling"}
    lacking = problem.uncoupled - coupled
    return len(joints) != 1 or joints[0] not in lacking or not entry.is_friction


def has_room(members: Sequence[Member], one: Member) -> bool:
    """Whether a set may have one effect more: of each joint a few are friction."""
    joints = set(one.candidate.place.joints)
    beside = [other for other in members if joints & set(other.candidate.place.joints)]
    if len(beside) < OF_JOINT or not one.is_friction:
        return True
    taken = [joint for other in beside if other.is_friction for joint in other.candidate.place.joints]
    return all(taken.count(joint) < OF_JOINT for joint in joints)


def likelier(sets: Sequence[Found], found: Found) -> Found | None:
    """The likeliest of some sets; None where none is likelier than the one there is."""
    best = max(sets, key=lambda one: one.log_posterior, default=found)
    return best if best.log_posterior > found.log_posterior else None


def without_effects(problem: Problem) -> Found:
    """The set without any effect."""
    return Found((), problem.level, problem.score, problem.posterior)


def found_set(problem: Problem, members: Sequence[Member], level: Level, joints: Sequence[int]) -> Found:
    """Fit a set, the misfit of some joints anew."""
    gram = Gram(problem.rows, tuple(member.entry.white for member in members))
    score, level, posterior = fitted(gram, level, joints, problem.misfit)
    possible = problem.friction.log_possible(members, posterior)
    return Found(tuple(members), level, score, posterior, possible)


def rough_beside(found: Found, asked: Sequence[Member]) -> set[int]:
    """Joints at which what is not smooth is another member's: one is rough there, and none that is asked.

    Args:
        found: a set.
        asked: those that are asked about, of this set or of another.
    """
    if any(one.candidate.family.rough for one in asked):
        return set()
    return {joint for one in found.members if one.candidate.family.rough for joint in one.entry.white.at}
