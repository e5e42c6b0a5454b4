"""How large the misfit is: κ and s of each joint by marginal likelihood, an accepted run's κ as its prior."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ident.discrepancy.by_evidence.evidence.gram import Gram, Level
from ident.discrepancy.by_evidence.evidence.solved import Posterior, log_evidences
from robots.arrays import BoolArray, FloatArray, IntArray

_STEPS = 18
"""Values of κ that are tried, evenly in log κ."""

_LOWEST = 0.1
"""Of the accepted κ: less misfit than that is none."""

_SWEEPS = 2

_LARGEST_EXCESS = 1e4
"""s of rows that nothing of the model holds for."""

_FINE = 0.005
"""Of ln s: finer is not looked for."""

_EXCESSES = 13
"""Values of ln s that are tried at once."""

_STILL = 0.05
"""Nats; less is no news."""

SPREAD = 1.0
"""Of ln κ about ln κ accepted, where a Cauchy prior is half as high; of ln s about 0."""


@dataclass(frozen=True)
class Misfit:
    """Prior and grid of κ and s.

    Attributes:
        accepted: (n,) N·m (or N), of the run that the model was accepted on, or of its noise.
        largest: (n,) N·m (or N), root mean square of the torque.
        of_run: whether a run that the model was accepted on says so.
    """

    accepted: FloatArray
    largest: FloatArray
    of_run: bool = True

    def grid(self, joint: int) -> FloatArray:
        """Values of κ that are tried."""
        low, high = _LOWEST * self.accepted[joint], max(self.largest[joint], self.accepted[joint])
        return np.geomspace(low, high, _STEPS)

    def log_prior(self, level: Level) -> float:
        """Cauchy in ln κ and ln s: an arm that has changed may have any misfit, but most are as they were."""
        joints = np.arange(self.accepted.size)
        return float(np.sum(self.log_prior_at(joints, level.kappa, level.excess)))

    def log_prior_at(
        self, joint: int | IntArray | BoolArray, kappa: FloatArray, excess: FloatArray
    ) -> FloatArray:
        """The same of one joint at K levels, or of each joint at its own."""
        away = np.log(kappa / self.accepted[joint]) / SPREAD
        more = np.log(excess) / SPREAD
        return np.asarray(-np.log1p(away**2) - np.log1p(more**2))


def fitted(gram: Gram, level: Level, joints: Iterable[int], misfit: Misfit) -> tuple[float, Level, Posterior]:
    """Log of evidence times prior of κ and s at its largest, the level there, and the posterior.

    Args:
        gram: of the set.
        level: to begin with.
        joints: whose misfit may change, one after the other.
        misfit: prior and grids.
    """
    order = list(joints)
    best = gram.posterior(level).log_evidence + misfit.log_prior(level)
    for _ in range(_SWEEPS):
        before = best
        for joint in order:
            best, level = OneJoint(gram, level, joint).best(best, misfit)
        if best - before < _STILL:
            break
    return best, level, gram.posterior(level)


class OneJoint:
    """The misfit of one joint, that of the others held."""

    def __init__(self, gram: Gram, level: Level, joint: int) -> None:
        self.gram, self.level, self.joint = gram, level, joint
        self.others = gram.reduced(level, [j for j in range(gram.rows.n) if j != joint])

    def log_evidences(self, kappa: FloatArray, excess: FloatArray) -> FloatArray:
        """(K,) at K levels of this joint."""
        part, volume = self.gram.joints[self.joint].without_misfit(kappa, excess)
        whole = np.repeat(self.others[0][np.newaxis], kappa.size, axis=0)
        whole[:, *self.gram.joints[self.joint].place] += part
        evidence = log_evidences(whole, self.gram.rows.precision, self.gram.effects)
        return np.asarray(evidence + volume + self.others[1])

    def best(self, score: float, misfit: Misfit) -> tuple[float, Level]:
        """The best κ of the grid at the present s, then s, then κ again.

        Args:
            score: log of evidence times prior at the present level.
            misfit: prior and grid.
        """
        level, joint = self.level, self.joint
        others = np.arange(level.kappa.size) != joint
        of_others = float(misfit.log_prior_at(others, level.kappa[others], level.excess[others]).sum())

        def scores(kappa: FloatArray, excess: FloatArray) -> FloatArray:
            own = misfit.log_prior_at(joint, kappa, excess)
            return np.asarray(self.log_evidences(kappa, excess) + own + of_others)

        for _ in range(2):
            grid = misfit.grid(joint)
            found = scores(grid, np.full(grid.size, level.excess[joint]))
            number = int(np.argmax(found))
            if found[number] > score:
                score, level = float(found[number]), level.changed(joint, kappa=float(grid[number]))
            excess, value = _best_excess(scores, float(level.kappa[joint]))
            if value <= score + _STILL:
                break
            score, level = value, level.changed(joint, excess=excess)
        return score, level


def _best_excess(scores: Callable[[FloatArray, FloatArray], FloatArray], kappa: float) -> tuple[float, float]:
    """s of the largest score and that score: on a grid that gets finer about it."""
    grid = np.append(0.0, np.geomspace(_FINE, np.log(_LARGEST_EXCESS), _EXCESSES - 1))
    while True:
        found = scores(np.full(grid.size, kappa), np.exp(grid))
        number = int(np.argmax(found))
        low, high = grid[max(number - 1, 0)], grid[min(number + 1, grid.size - 1)]
        if high - low <= 2.0 * _FINE:  # most rows are as noisy as what does not repeat: s is 1 at once
            return float(np.exp(grid[number])), float(found[number])
        grid = np.linspace(low, high, _EXCESSES)
