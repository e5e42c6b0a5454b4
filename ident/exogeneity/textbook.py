"""The textbook Durbin-Wu-Hausman test: y = Xβ + V̂γ + e, H0: γ = 0 (method.md 5.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.statistics.tails import beyond_f, each_beyond_f
from ident.verdicts import Gate
from robots.arrays import FloatArray, IntArray

_MACHINE_NULL = 1e-9
"""A column whose part orthogonal to the rest is below this share of its norm carries no information."""


@dataclass(frozen=True)
class WhiteRows:
    """Whitened rows: y (r,), X (r, b), Z (r, m)."""

    y: FloatArray
    x: FloatArray
    z: FloatArray

    def first_stage(self) -> tuple[FloatArray, FloatArray]:
        """Π̂ (m, b) and V̂ = X − ZΠ̂ (r, b)."""
        projection = np.asarray(np.linalg.lstsq(self.z, self.x, rcond=None)[0], dtype=np.float64)
        return projection, self.x - self.z @ projection


def residual_sum(y: FloatArray, x: FloatArray) -> float:
    """Sum of squares that is left of y (r,) after regression on x (r, k)."""
    q, _ = np.linalg.qr(x)
    rest = y - q @ (q.T @ y)
    return float(rest @ rest)


def trailing_diagonal(x: FloatArray, v: FloatArray) -> FloatArray:
    """|R_kk| of V̂'s columns in the QR of [X V̂]: what each adds to X and to the columns before it, (b,)."""
    scale = np.linalg.norm(x, axis=0)
    r = np.linalg.qr(np.hstack([x / scale, v / scale]), mode="r")
    return np.asarray(np.abs(np.diag(r))[x.shape[1] :])


def informative(x: FloatArray, v: FloatArray) -> IntArray:
    """Indices of V̂'s columns that are not null to machine precision in [X V̂]."""
    return np.flatnonzero(trailing_diagonal(x, v) > _MACHINE_NULL)


def wald_f(y: FloatArray, x: FloatArray, extra: FloatArray) -> tuple[float, tuple[float, float], float]:
    """F statistic that ``extra`` (r, k) adds nothing to y on x; with its degrees of freedom and p-value."""
    augmented = np.hstack([x, extra])
    freedom = y.size - augmented.shape[1]
    without, with_extra = residual_sum(y, x), residual_sum(y, augmented)
    statistic = ((without - with_extra) / extra.shape[1]) / (with_extra / freedom)
    df = (float(extra.shape[1]), float(freedom))
    return float(statistic), df, beyond_f(statistic, *df)


def single_p_values(y: FloatArray, x: FloatArray, extra: FloatArray) -> FloatArray:
    """p-values (k,) of the F-test of each column of ``extra`` (r, k) on its own, by one factorisation."""
    q, _ = np.linalg.qr(x)
    rest = y - q @ (q.T @ y)
    new = extra - q @ (q.T @ extra)
    gain = (new.T @ rest) ** 2 / np.sum(new**2, axis=0)
    freedom = y.size - x.shape[1] - 1
    return each_beyond_f(gain * freedom / (rest @ rest - gain), 1, freedom)


def textbook_test(rows: WhiteRows, level: float = 0.05) -> Gate:
    """F-test of γ = 0 with errors taken as independent (Hausman 1978; Davidson and MacKinnon 1993).

    Columns of V̂ that are null to machine precision are left out, since [X V̂] would not have full rank.

    Args:
        rows: whitened by Ω.
        level: nominal size.
    """
    _, v = rows.first_stage()
    kept = informative(rows.x, v)
    null = "γ = 0: the regressors are uncorrelated with the errors"
    if kept.size == 0:
        return Gate(
            "exogeneity", null, True, 0.0, "none", None, 1.0, "V̂ is null: X and Z span the same space"
        )
    statistic, df, p = wald_f(rows.y, rows.x, v[:, kept])
    detail = f"i.i.d. errors; {v.shape[1] - kept.size} null columns of V̂ left out"
    return Gate("exogeneity", null, p >= level, statistic, "F", df, p, detail)
