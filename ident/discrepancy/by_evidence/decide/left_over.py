"""What a set leaves unexplained at each joint, and whether that is more than an accepted run left."""

from __future__ import annotations

import numpy as np

from ident.discrepancy.by_evidence.decide.problem import Problem, root_mean_square
from ident.discrepancy.by_evidence.decide.state import TEMPERATURE, Found
from ident.discrepancy.by_evidence.evidence.gram import Gram
from ident.discrepancy.by_evidence.evidence.kappa import SPREAD, OneJoint
from ident.discrepancy.by_evidence.evidence.rows import Rows
from robots.arrays import FloatArray

ABOVE = 0.5
"""Probability from which on a joint's misfit is taken to be above the accepted one."""


def above_accepted(problem: Problem, found: Found) -> FloatArray:
    """(n,) probability that a joint's misfit is above the accepted one by more than its prior's width."""
    limit = problem.misfit.accepted * np.exp(SPREAD)
    return np.where(_not_smooth(problem, found) > limit, 1.0, smooth_above_accepted(problem, found))


def smooth_above_accepted(problem: Problem, found: Found) -> FloatArray:
    """(n,) the same of what is smooth alone, κ."""
    gram = Gram(problem.rows, tuple(member.entry.white for member in found.members))
    shares, limit = np.empty(problem.rows.n), problem.misfit.accepted * np.exp(SPREAD)
    for joint in range(problem.rows.n):
        grid = problem.misfit.grid(joint)
        excess = np.full(grid.size, found.level.excess[joint])
        evidence = OneJoint(gram, found.level, joint).log_evidences(grid, excess)
        scores = TEMPERATURE * evidence + problem.misfit.log_prior_at(joint, grid, excess)
        weights = np.exp(scores - scores.max())
        shares[joint] = weights[grid > limit[joint]].sum() / weights.sum()
    return shares


def _not_smooth(problem: Problem, found: Found) -> FloatArray:
    """(n,) rms of what repeats and is not smooth, N·m (or N); rows are so many that s is as good as known.

    White rows of what is quicker than the noise are as many times as noisy, and it is no more than all that
    is left of the torque beside what does not repeat: of a foot that rocks at 11 Hz they made 266 N·m, where
    57 were left. A column of the other periods' motion has their noise in it, and the noise was read off what
    the model leaves without that column: beside a lag of 5 ms rows were 1.24 times as noisy, and of the four
    times the usual misfit that this would be nothing repeated.
    """
    noise = np.array([one.marginal for one in problem.rows.noise])
    left = residual_rows(problem.rows, found)
    whole, chance = root_mean_square(problem.prepared, left), noise
    if problem.prepared.repeats:
        chance = root_mean_square(problem.prepared, problem.prepared.not_repeating(left))
    rough = np.minimum(noise**2 * (found.level.excess**2 - 1.0), np.maximum(whole**2 - chance**2, 0.0))
    return np.asarray(np.sqrt(rough))


def residual_rows(rows: Rows, found: Found) -> FloatArray:
    """Rows × joints, N·m (or N), that a set leaves of the torque."""
    left = rows.known.target - rows.known.columns @ found.posterior.known
    for number, member in enumerate(found.members):
        left = left - rows.thin(member.entry.placed) @ found.theta(number)[0]
    return np.asarray(left)


def misfit_of(problem: Problem, found: Found) -> FloatArray:
    """(n,) rms of all that stays unexplained, N·m (or N)."""
    return np.asarray(np.hypot(found.level.kappa, _not_smooth(problem, found)))


def usual_at(problem: Problem, found: Found, joint: int) -> float:
    """Misfit of a joint, N·m (or N): what is accepted, or what is there where that is more.

    What explains less than an arm leaves that nothing has happened to is not told from that.
    """
    accepted = float(problem.misfit.accepted[joint])
    above = above_accepted(problem, found)[joint]
    return max(float(misfit_of(problem, found)[joint]), accepted) if above > ABOVE else accepted


def torque_of(problem: Problem, found: Found, number: int) -> FloatArray:
    """(n,) root mean square of a member's torque where the joints move, N·m (or N)."""
    torque = problem.rows.thin(found.members[number].entry.placed) @ found.theta(number)[0]
    return root_mean_square(problem.prepared, torque)


def own_joint(found: Found, number: int, torque: FloatArray) -> int:
    """Of the joints whose misfit a member can take the place of, the one at which its torque is largest."""
    return max(found.members[number].joints, key=lambda joint: float(torque[joint]))
