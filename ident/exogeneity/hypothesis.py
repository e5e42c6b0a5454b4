"""A test as a value: what is claimed, how far the data are from it, and how likely that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.statistics.tails import beyond_f
from robots.arrays import FloatArray


@dataclass(frozen=True)
class HypothesisTest:
    """One test.

    Attributes:
        name: as the literature calls it.
        null: the hypothesis in words.
        statistic: its value.
        distribution: ``χ²`` or ``F``, under the null.
        df: degrees of freedom.
        p_value: probability of at least this statistic under the null.
    """

    name: str
    null: str
    statistic: float
    distribution: str
    df: tuple[float, ...]
    p_value: float

    def rejects(self, level: float = 0.05) -> bool:
        """Whether the null is rejected at that level."""
        return self.p_value < level


def f_test(name: str, null: str, statistic: float, df: int, df_denominator: float) -> HypothesisTest:
    """A statistic that is F(df, df_denominator) under the null."""
    p = beyond_f(statistic, df, df_denominator)
    return HypothesisTest(name, null, statistic, "F", (float(df), float(df_denominator)), p)


def wald_statistic(values: FloatArray, covariance: FloatArray) -> float:
    """θᵀ Σ⁻¹ θ of estimates (k,) and their covariance (k, k)."""
    return float(values @ np.linalg.solve(covariance, values))


def annihilate(values: FloatArray, x: FloatArray) -> FloatArray:
    """What is left of values (r, k) after regression on x (r, b)."""
    q, _ = np.linalg.qr(x)
    return np.asarray(values - q @ (q.T @ values))
