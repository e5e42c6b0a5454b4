"""Covariance of errors with any correlation inside a group of rows and none between groups."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.covariances.problem import EstimatedRows
from ident.errors import IdentificationError
from robots.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Cluster:
    """One group per repetition of the motion, or per recording where the motion is not periodic.

    With G groups at most G − 1 directions are seen: fewer groups than parameters give a singular matrix, good
    for σ of single parameters, not for tests of many at once.

    Attributes:
        small_sample: scale by G/(G − 1) · (r − 1)/(r − b).
    """

    small_sample: bool = True
    name: str = "cluster"

    def score_covariance(self, rows: EstimatedRows) -> FloatArray:
        labels = groups(rows)
        names = np.unique(labels)
        if names.size < 2:
            raise IdentificationError(
                'covariance "cluster" needs at least two recordings or repetitions; here is one'
            )
        per_sample = rows.scores.sum(axis=1)
        sums = np.array([per_sample[labels == name].sum(axis=0) for name in names])
        factor = 1.0
        if self.small_sample:
            factor = names.size / (names.size - 1) * (rows.count - 1) / (rows.count - rows.parameters)
        return np.asarray(factor * (sums.T @ sums))

    def describe(self, rows: EstimatedRows) -> str:
        kind = "recordings" if rows.period is None else "repetitions"
        return f"clusters: {np.unique(groups(rows)).size} {kind}, any correlation inside each"


def groups(rows: EstimatedRows) -> IntArray:
    """(samples,) the group of each sample; repetitions of different recordings are different groups."""
    if rows.period is None:
        return rows.segment
    pairs = np.column_stack([rows.segment, rows.period])
    return np.asarray(np.unique(pairs, axis=0, return_inverse=True)[1].reshape(-1))
