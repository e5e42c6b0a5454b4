"""What a set says of motion all over the travel, and whether another set says the same there.

Friction that falls with speed has Coulomb friction in its limit, a stiffening cable a straight spring. Where
the recordings have looked for what the one has more, and it is as good as nothing, the two say the same of
any motion and are one name. Where an arm has moved slowly, or over a tenth of its travel, the fits agree
there and nowhere else: then they are two names, and a motion tells which is right.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.discrepancy.by_evidence.decide.instruments import predicted
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.state import Found
from ident.discrepancy.by_evidence.evidence.known import known_columns
from ident.discrepancy.by_evidence.evidence.prepared import Prepared, prepare
from ident.discrepancy.by_evidence.evidence.rows import Known, effect_rows
from ident.recording import Recording
from robots.arrays import FloatArray
from robots.description import Robot

_DURATION = 24.0
"""s, as a motion is that is planned to tell names apart."""

_OF_LIMITS = 0.9
"""Of travel, speed and acceleration: what a motion comes to that keeps to them."""


@dataclass(frozen=True, eq=False)
class Elsewhere:
    """Rows of a motion all over the travel, as the model under examination predicts them.

    Attributes:
        problem: the model.
        prepared: the motion.
        known: columns of what every model has.
    """

    problem: Problem
    prepared: Prepared
    known: Known

    @classmethod
    def of(cls, problem: Problem) -> Elsewhere:
        """For the arm and the sampling of the recordings that are fitted."""
        robot, present = problem.prepared.robot, problem.present
        swings = all_over(robot, problem.prepared.parts[0].sample_time)
        prepared = predicted(prepare(robot, (swings,)), present)
        known, _ = known_columns(prepared, problem.base, problem.prior, problem.start, present)
        return cls(problem, prepared, known)

    def same(self, found: Found, other: Found) -> bool:
        """Whether two sets differ by less torque than an accepted model leaves, on every joint."""
        change = self._torque(found) - self._torque(other)
        used = self.prepared.used
        squares = np.sum(np.where(used, change, 0.0) ** 2, axis=0) / np.maximum(used.sum(axis=0), 1)
        return bool(np.all(np.sqrt(squares) <= self.problem.misfit.accepted))

    def _torque(self, found: Found) -> FloatArray:
        """Rows × joints, N·m (or N), of a set and what is known beside it."""
        total = self.known.columns @ found.posterior.known
        for number, member in enumerate(found.members):
            total = total + effect_rows(self.prepared, member.entry.placed) @ found.theta(number)[0]
        return np.asarray(total)


def all_over(robot: Robot, step: float) -> Recording:
    """Every joint swings over its travel, as fast as it may, each in its own time; no torque.

    Args:
        robot: its limits. No collision is looked for: nothing moves.
        step: between samples, s.
    """
    time = np.asarray(step * np.arange(round(_DURATION / step)), dtype=np.float64)
    half = _OF_LIMITS * 0.5 * (robot.upper - robot.lower)
    rate = _OF_LIMITS * np.minimum(robot.velocity_limits / half, np.sqrt(robot.acceleration_limits / half))
    position = 0.5 * (robot.upper + robot.lower) + half * np.sin(np.multiply.outer(time, rate))
    return Recording("all over the travel", time, None, position, np.zeros_like(position))
