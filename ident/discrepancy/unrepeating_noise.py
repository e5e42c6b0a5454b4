"""The noise of a record in which nothing repeats: what is left when all that has a name is taken away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ident.discrepancy.bounded import within_bounds
from ident.discrepancy.examination import Examination
from ident.discrepancy.library import Library, Trial
from ident.discrepancy.scoring import best_per_place, singles
from ident.statistics.whitening import Whitening, inflated_deviation
from robots.arrays import FloatArray

_TAKEN = 6
"""Effects that are taken away, one after the other, each for what it explains beside those before."""


def noise_beyond_vocabulary(examination: Examination, library: Library) -> Whitening:
    """The whitening with deviations of what the best effects together leave.

    A residual that holds the effect itself would make the effect look small beside it; what no effect of
    the vocabulary explains is the best that can be said of the noise.

    Args:
        examination: with deviations of its own residual.
        library: all trials on it.
    """
    left = _left(examination, library)
    used, order = examination.used, examination.whitening.order
    assert order == 0, "rows of Ω alone are not filtered"
    sizes = used.sum(axis=0)
    per_joint = np.split(left[: int(sizes.sum())], np.cumsum(sizes)[:-1])
    # A joint that stands still has no rows, and its deviation weighs nothing.
    factors = [inflated_deviation(series) if series.size else 1.0 for series in per_joint]
    return replace(examination.whitening, sigma=examination.whitening.sigma * np.array(factors))


def _left(examination: Examination, library: Library) -> FloatArray:
    """Whitened (N,): the residual without the effects that explain it best beside each other."""
    chosen = _best_together(examination, library)
    if not chosen:
        return examination.residual
    columns = [library.columns[:, trial.columns] @ np.linalg.pinv(trial.parameters) for trial in chosen]
    bounds = [trial.effect.bounds for trial in chosen]
    together = np.concatenate(columns, axis=1)
    values = within_bounds(together, examination.residual, np.concatenate(bounds))
    return np.asarray(examination.residual - together @ values)


def _best_together(examination: Examination, library: Library) -> list[Trial]:
    """The effects that are taken away, each the best beside those before.

    The rows' deviations are such that as many rows are independent as the residual has squares.
    """
    rows = max(2, round(float(examination.residual @ examination.residual)))
    alone = best_per_place(singles(library, library.score, rows))
    chosen = [found.trials[0] for found in alone[:1]]
    while chosen and len(chosen) < _TAKEN:
        index = np.concatenate([np.arange(trial.start, trial.end) for trial in chosen])
        solved = np.linalg.lstsq(library.gram[np.ix_(index, index)], library.score[index], rcond=1e-9)[0]
        products = library.score - library.gram[:, index] @ solved
        taken = {trial.key for trial in chosen}
        rest = singles(library, products, rows)
        following = next((found for found in rest if found.trials[0].key not in taken), None)
        if following is None or following.value <= 0.0:
            break
        chosen.append(following.trials[0])
    return chosen
