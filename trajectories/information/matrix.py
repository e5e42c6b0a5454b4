"""How much a motion tells about the base parameters: the information matrix of the weighted regressor.

G = WᵀW with W the base regressor's rows divided by each joint's noise σ_j. The Cramér-Rao bound of the
parameters is C = G⁻¹: its determinant is the volume of the confidence ellipsoid (D-optimal), its trace
the sum of variances (A-optimal). Swevers et al. 1997; Gautier and Khalil 1992 for the condition number.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from robots.arrays import FloatArray

ROW_RATE = 100.0
"""Rows per second that an information matrix stands for, so that figures of motions compare."""

NONE = 1e9
"""Score of a motion that leaves some combination of parameters unseen."""

_SINGULAR = 1e-14
"""Smallest over largest eigenvalue of G below which what is left is rounding."""

EXCESS_COST = 3.0
"""Score per unit of the logarithm of the condition number above its cap: enough to bring it down to it."""

CONDITION_CAP = 150.0
"""Of the weighted regressor, unless asked otherwise."""

Criterion = Literal["determinant", "trace", "condition"]


@dataclass(frozen=True)
class Information:
    """The information matrix G (b × b) of a motion, at 100 rows per second."""

    matrix: FloatArray

    @property
    def condition(self) -> float:
        """Condition number of the weighted regressor W (the square root of that of G)."""
        eigenvalues = np.linalg.eigvalsh(self.matrix)
        if eigenvalues[0] <= _SINGULAR * eigenvalues[-1]:
            return float("inf")
        return float(np.sqrt(eigenvalues[-1] / eigenvalues[0]))

    @property
    def log_det(self) -> float:
        """−log det(G) / b; smaller is better."""
        sign, value = np.linalg.slogdet(self.matrix)
        return float(-value / len(self.matrix)) if sign > 0 else NONE

    @property
    def trace(self) -> float:
        """tr C, the sum of the variances."""
        return float(np.trace(np.linalg.inv(self.matrix)))

    def sigma(self, row_rate: float = ROW_RATE) -> FloatArray:
        """Predicted standard deviation of each base parameter (b,) from ``row_rate`` rows per second."""
        return np.sqrt(np.diag(np.linalg.inv(self.matrix)) * ROW_RATE / row_rate)


@dataclass(frozen=True, eq=False)
class Objective:
    """What the planner minimises; the score is per parameter, so 0.01 is 1 % of a variance.

    Attributes:
        criterion: ``determinant`` (−log det G / b), ``trace`` (log of the mean variance) or ``condition``
            (log of the condition number).
        condition_cap: a condition number above it costs; None for no cap.
        chosen: indices of the parameters that matter; None for all.
        directions: (b × k) what is taken for unknown: β = β₀ + directions · p, with p the parameters
            that ``chosen`` counts; None for the base parameters themselves.
    """

    criterion: Criterion = "determinant"
    condition_cap: float | None = CONDITION_CAP
    chosen: tuple[int, ...] | None = None
    directions: FloatArray | None = None

    def stricter(self, share: float) -> Objective:
        """The same with a lower cap on the condition number."""
        cap = None if self.condition_cap is None else self.condition_cap * share
        return replace(self, condition_cap=cap)

    def score(self, matrix: FloatArray, unless_above: float = NONE) -> float:
        """Score of an information matrix (b × b).

        Args:
            matrix: G.
            unless_above: where a quick look shows that the score is above this, any larger number may be
                returned.
        """
        if self.directions is not None:
            matrix = self.directions.T @ matrix @ self.directions
        scaled, scale = _unit_diagonal(matrix)
        if scaled is None:
            return NONE
        quick = self._quick(scaled, scale)
        if quick > unless_above:
            return quick
        eigenvalues, vectors = self._eigen(matrix)
        if eigenvalues[0] <= _SINGULAR * eigenvalues[-1]:
            return NONE
        log_condition = 0.5 * float(np.log(eigenvalues[-1] / eigenvalues[0]))
        excess = 0.0
        if self.condition_cap is not None:
            excess = max(0.0, log_condition - float(np.log(self.condition_cap)))
        if self.criterion == "condition":
            return log_condition
        return self._precision(eigenvalues, vectors) + EXCESS_COST * excess

    def _quick(self, scaled: FloatArray, scale: FloatArray) -> float:
        """A lower bound of the score that costs only a Cholesky decomposition."""
        try:
            factor = np.linalg.cholesky(scaled)
        except np.linalg.LinAlgError:
            return NONE
        if self.criterion != "determinant" or self.chosen is not None:
            return -NONE
        return float(-2.0 * (np.log(np.diag(factor)).sum() + np.log(scale).sum()) / len(scale))

    def _eigen(self, matrix: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        if self.chosen is None:
            return np.asarray(np.linalg.eigvalsh(matrix), dtype=np.float64), None
        eigenvalues, vectors = np.linalg.eigh(matrix)
        return eigenvalues, vectors[list(self.chosen)]

    def _precision(self, eigenvalues: FloatArray, vectors: FloatArray | None) -> float:
        if vectors is None:
            if self.criterion == "determinant":
                return float(-np.log(eigenvalues).mean())
            return float(np.log((1.0 / eigenvalues).mean()))
        covariance = (vectors / eigenvalues) @ vectors.T
        if self.criterion == "determinant":
            return float(np.linalg.slogdet(covariance)[1] / len(covariance))
        return float(np.log(np.trace(covariance) / len(covariance)))


def _unit_diagonal(matrix: FloatArray) -> tuple[FloatArray | None, FloatArray]:
    diagonal = np.diag(matrix)
    if diagonal.min() <= 0.0:
        return None, diagonal
    scale = np.sqrt(diagonal)
    return matrix / np.outer(scale, scale), scale
