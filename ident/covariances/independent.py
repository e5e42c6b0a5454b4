"""Covariances of errors that are independent from row to row: one variance, one per joint, or any (White)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.covariances.problem import EstimatedRows
from robots.arrays import FloatArray


@dataclass(frozen=True)
class Independent:
    """One variance for all the weighted rows, s² = εᵀε / (r − b)."""

    name: str = "iid"

    def score_covariance(self, rows: EstimatedRows) -> FloatArray:
        z = rows.z[rows.used]
        variance = np.sum(rows.residual**2) / (rows.count - rows.parameters)
        return np.asarray(variance * (z.T @ z))

    def describe(self, rows: EstimatedRows) -> str:
        return "errors independent, one variance for all rows weighted by Ω"


@dataclass(frozen=True)
class Block:
    """The paper's Ω (eq. 7): one variance per joint, independent in time."""

    name: str = "block"

    def score_covariance(self, rows: EstimatedRows) -> FloatArray:
        total = np.zeros((rows.parameters, rows.parameters))
        for joint in range(rows.joints):
            z, residual = rows.z[:, joint], rows.residual[:, joint]
            freedom = rows.used[:, joint].sum() - rows.parameters / rows.joints
            total += (residual @ residual / freedom) * (z.T @ z)
        return total

    def describe(self, rows: EstimatedRows) -> str:
        return "Ω per joint, errors independent in time"


@dataclass(frozen=True)
class White:
    """Any variance in any row (White 1980): HC0, or HC1 with the factor r / (r − b)."""

    small_sample: bool = True
    name: str = "hc"

    def score_covariance(self, rows: EstimatedRows) -> FloatArray:
        scores = rows.scores[rows.used]
        factor = rows.count / (rows.count - rows.parameters) if self.small_sample else 1.0
        return np.asarray(factor * (scores.T @ scores))

    def describe(self, rows: EstimatedRows) -> str:
        return f"HC{int(self.small_sample)} (White): errors independent, any variance in any row"
