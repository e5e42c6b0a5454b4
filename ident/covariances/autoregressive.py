"""Covariance of errors that are an autoregressive process per joint, fitted to the residuals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.covariances.problem import EstimatedRows
from ident.statistics.covariance import weighted_score_covariance
from ident.statistics.restricted import regression_whitening
from ident.statistics.whitening import Whitening
from robots.arrays import FloatArray


@dataclass(frozen=True)
class Autoregressive:
    """The same estimate, its σ wide enough for residuals that are correlated along time; the default."""

    name: str = "ar"

    def score_covariance(self, rows: EstimatedRows) -> FloatArray:
        return weighted_score_covariance(rows.z, np.ones(rows.joints), _errors(rows), rows.segment)

    def describe(self, rows: EstimatedRows) -> str:
        return _errors(rows).describe()


def _errors(rows: EstimatedRows) -> Whitening:
    """Of the residuals on the instruments: Zᵀε̂ = 0, so Z is what the estimate has taken from the errors."""
    return regression_whitening(rows.residual, rows.z, rows.segment, rows.used)
