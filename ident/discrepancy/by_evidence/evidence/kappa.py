"""How large the misfit is: κ and s of each joint by marginal likelihood, an accepted run's κ as its prior."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from ident.discrepancy.by_evidence.evidence.gram import Gram, Level, Posterior
from robots.arrays import FloatArray

_STEPS = 18
"""Values of κ that are tried, evenly in log κ."""

_LOWEST = 0.1
"""Of the accepted κ: less misfit than that is none."""

_SWEEPS = 2

_LARGEST_EXCESS = 1e4
"""s of rows that nothing of the model holds for."""

_FINE = 0.005
"""Of ln s: finer is not looked for."""

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
    """

    accepted: FloatArray
    largest: FloatArray

    def grid(self, joint: int) -> FloatArray:
        """Values of κ that are tried."""
        low, high = _LOWEST * self.accepted[joint], max(self.largest[joint], self.accepted[joint])
        return np.geomspace(low, high, _STEPS)

    def log_prior(self, level: Level) -> float:
        """Cauchy in ln κ and ln s: an arm that has changed may have any misfit, but most are as they were."""
        away = np.log(level.kappa / self.accepted) / SPREAD
        more = np.log(level.excess) / SPREAD
        return float(-np.log1p(away**2).sum() - np.log1p(more**2).sum())


def fitted(
    gram: Gram, chosen: Sequence[int], level: Level, joints: Iterable[int], misfit: Misfit
) -> tuple[float, Level, Posterior]:
    """Log of evidence times prior of κ and s at its largest, the level there, and the posterior.

    Args:
        gram: of the library.
        chosen: effects of the set.
        level: to begin with.
        joints: whose misfit may change, one after the other.
        misfit: prior and grids.
    """
    order = list(joints)
    best = gram.posterior(level, chosen).log_evidence + misfit.log_prior(level)
    for _ in range(_SWEEPS):
        before = best
        for joint in order:
            best, level = _OneJoint(gram, chosen, level, joint, misfit).best(best)
        if best - before < _STILL:
            break
    return best, level, gram.posterior(level, chosen)


class _OneJoint:
    """The misfit of one joint, that of the others held."""

    def __init__(self, gram: Gram, chosen: Sequence[int], level: Level, joint: int, misfit: Misfit) -> None:
        self.gram, self.chosen, self.level, self.joint, self.misfit = gram, chosen, level, joint, misfit
        self.columns = gram.columns_of(chosen)
        others = [j for j in range(gram.rows.n) if j != joint]
        self.others, self.volume = gram.reduced(level, self.columns, others)

    def score(self, level: Level) -> float:
        """Log of evidence times prior."""
        own, volume = self.gram.reduced(level, self.columns, (self.joint,))
        solved = self.gram.solved(self.others + own, self.volume + volume, self.chosen)
        return solved.log_evidence + self.misfit.log_prior(level)

    def best(self, score: float) -> tuple[float, Level]:
        """The best κ of the grid at the present s, then s, then κ again."""
        level = self.level
        for _ in range(2):
            for value in self.misfit.grid(self.joint):
                tried = level.changed(self.joint, kappa=float(value))
                found = self.score(tried)
                if found > score:
                    score, level = found, tried
            kappa = float(level.kappa[self.joint])
            log_excess = minimize_scalar(
                lambda x, kappa=kappa: (
                    -self.score(self.level.changed(self.joint, kappa=kappa, excess=float(np.exp(x))))
                ),
                bounds=(0.0, np.log(_LARGEST_EXCESS)),
                method="bounded",
                options={"xatol": _FINE},
            ).x
            tried = level.changed(self.joint, excess=float(np.exp(log_excess)))
            found = self.score(tried)
            if found <= score + _STILL:
                break
            score, level = found, tried
        return score, level
