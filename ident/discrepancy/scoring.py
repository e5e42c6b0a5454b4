"""How much of the residual a trial takes away, alone or beside others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from ident.discrepancy.library import Library, Trial
from ident.statistics.symmetric import eigen_of
from robots.arrays import FloatArray

_CLEAR = 5.0
"""Standard deviations by which an essential parameter has to differ from zero."""

_RIDGE = 1e-9
"""Of unit columns; keeps nearly equal columns of one trial solvable."""


@dataclass(frozen=True)
class Score:
    """Trials together: what they take off the residual's sum of squares, and with which parameters.

    ``value`` is ``gain`` less the bic_penalty of every parameter and shape (half of it is a log likelihood
    ratio with the penalty of BIC).
    """

    trials: tuple[Trial, ...]
    gain: float
    value: float
    parameters: FloatArray


def bic_penalty(trials: Sequence[Trial], rows: int) -> float:
    """BIC's bic_penalty of the trials' parameters, shapes included."""
    return float(sum(trial.end - trial.start + trial.shapes for trial in trials) * np.log(rows))


def score(library: Library, trials: Sequence[Trial], products: FloatArray, rows: int) -> Score:
    """Score trials together.

    Args:
        library: their columns' products.
        trials: which.
        products: (m,) products of all columns with the residual.
        rows: N, for the bic_penalty.
    """
    index = np.concatenate([np.arange(trial.start, trial.end) for trial in trials])
    gram = library.gram[np.ix_(index, index)] + _RIDGE * np.eye(index.size)
    target = products[index]
    factors = np.linalg.solve(gram, target)
    parameters = block_diag(*(trial.parameters for trial in trials))
    bounds = np.array([limit for trial in trials for limit in trial.effect.bounds])
    values = parameters @ factors
    if ((values < bounds[:, 0]) | (values > bounds[:, 1])).any():
        values = np.clip(values, bounds[:, 0], bounds[:, 1])
        factors = np.linalg.lstsq(parameters, values, rcond=None)[0]
        factors = factors * max(0.0, float(factors @ target) / float(factors @ gram @ factors or 1.0))
        longer = parameters @ factors
        factors = np.linalg.lstsq(parameters, np.clip(longer, bounds[:, 0], bounds[:, 1]), rcond=None)[0]
    gain = float(2 * factors @ target - factors @ gram @ factors)
    if not _has_essentials(trials, values):
        gain = 0.0
    return Score(tuple(trials), gain, gain - bic_penalty(trials, rows), parameters @ factors)


def _has_essentials(trials: Sequence[Trial], values: FloatArray) -> bool:
    """Whether what makes each effect that effect is there beyond its own uncertainty."""
    start = 0
    for trial in trials:
        sigma = np.linalg.norm(trial.parameters, axis=1)
        for index in trial.family.essential:
            if abs(values[start + index]) < _CLEAR * sigma[index] or sigma[index] == 0.0:
                return False
        start += sigma.size
    return True


def singles(library: Library, products: FloatArray, rows: int) -> list[Score]:
    """Every trial alone, best value first."""
    scores = [score(library, (trial,), products, rows) for trial in library.trials]
    return sorted(scores, key=lambda found: -found.value)


def best_per_place(scores: Sequence[Score], each_form: bool = False) -> list[Score]:
    """Of each family at each place (or set of those) the best shape; order is kept.

    Args:
        scores: best first.
        each_form: of each form of a family the best one.
    """
    seen: set[tuple[tuple[object, ...], ...]] = set()
    best = []
    for found in scores:
        key = tuple(
            sorted((*trial.key, trial.effect.shape_names if each_form else ()) for trial in found.trials)
        )
        if key not in seen:
            seen.add(key)
            best.append(found)
    return best


def pairs(library: Library, leaders: Sequence[Score], products: FloatArray, rows: int) -> list[Score]:
    """Each leader with every other trial, best value first.

    Args:
        library: all trials.
        leaders: single scores that may be one half of a pair.
        products, rows: as :func:`score`.
    """
    found = []
    for leader in leaders:
        first = leader.trials[0]
        inside = np.arange(first.start, first.end)
        gram = library.gram[np.ix_(inside, inside)] + _RIDGE * np.eye(inside.size)
        back = np.linalg.solve(gram, library.gram[inside])
        rest = products - back.T @ products[inside]
        left = 1.0 - np.einsum("im,im->m", library.gram[inside], back)
        promise = _promise(library, rest, left)
        for position in np.argsort(-promise)[:40]:
            second = library.trials[position]
            if second.key != first.key:
                found.append(score(library, (first, second), products, rows))
    return sorted(found, key=lambda pair: -pair.value)


def _promise(library: Library, rest: FloatArray, left: FloatArray) -> FloatArray:
    """Upper estimate of each trial's further gain, column by column."""
    single = np.where(left > 1e-4, rest**2 / np.maximum(left, 1e-4), 0.0)
    return np.array([single[trial.columns].sum() for trial in library.trials])


def noise_maxima(library: Library, offset: FloatArray, rows: int, draws: int, seed: int) -> FloatArray:
    """Largest single value in each of many residuals that hold noise alone plus a fixed misfit.

    Args:
        library: all trials.
        offset: (m,) products of the columns with a misfit that is always there (zero for none).
        rows: N, for the bic_penalty.
        draws: how many.
        seed: of the draws.
    """
    values, vectors = eigen_of(library.gram)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    generator = np.random.default_rng(seed)
    sampled = offset + generator.standard_normal((draws, offset.size)) @ root.T
    best = np.full(draws, -np.inf)
    for trial in library.trials:
        inside = np.arange(trial.start, trial.end)
        gram = library.gram[np.ix_(inside, inside)] + _RIDGE * np.eye(inside.size)
        part = sampled[:, inside]
        gain = np.einsum("dp,dp->d", part, np.linalg.solve(gram, part.T).T)
        best = np.maximum(best, gain - bic_penalty((trial,), rows))
    return best
