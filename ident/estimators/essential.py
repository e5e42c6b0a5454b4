"""Essential parameters: leave out those that the data do not need (Gautier 1997)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ident.estimators.fit import stack
from ident.estimators.least_squares import ErrorDeviation, joint_deviations, require_full_rank
from ident.preparation.observation import Rows
from ident.statistics.restricted import regression_whitening
from ident.statistics.tails import beyond_f
from robots.arrays import FloatArray

_LARGE = 10.0
"""%σ above which a parameter is worth a test; better seen ones are needed beyond doubt."""


@dataclass(frozen=True)
class Dropped:
    """A parameter that was left out, and what the F-test said when it was.

    Attributes:
        name: of the base parameter.
        percent_sigma: 100·σ/|β| just before.
        statistic: F of the fit without it and all dropped before it, against the full fit.
        df: degrees of freedom.
        p_value: probability of at least this F if none of them is needed.
    """

    name: str
    percent_sigma: float
    statistic: float
    df: tuple[float, float]
    p_value: float


@dataclass(frozen=True)
class EssentialFit:
    """Least squares on the essential parameters, on the rows that the F-tests saw.

    Attributes:
        names: of those kept.
        beta: (k,) their values; feasible GLS where the rows are prewhitened.
        covariance: (k, k).
        errors: what was assumed of the errors, in words.
        dropped: in the order in which they were.
        refused: the first that the F-test did not let go, None where no parameter with large %σ is left.
    """

    names: tuple[str, ...]
    beta: FloatArray
    covariance: FloatArray
    errors: str
    dropped: tuple[Dropped, ...]
    refused: Dropped | None


def essential_parameters(
    rows: Rows,
    names: tuple[str, ...],
    level: float = 0.05,
    percent_sigma: float = _LARGE,
    errors: Literal["ar", "block"] = "ar",
    kind: ErrorDeviation = "unbiased",
) -> EssentialFit:
    """Drop the parameter with the largest %σ, one at a time, while the fit is not worse.

    Each step tests all that was dropped so far against the full model, so many small losses do not add up
    unseen. An F-test is right on white rows only: correlated residuals claim more rows than there are, and
    would keep what is not needed.

    Args:
        rows: samples × joints.
        names: (b,) base parameter names.
        level: of the F-test.
        percent_sigma: parameters that are seen better than this stay without a test.
        errors: ``ar`` prewhitens the rows of each joint; ``block`` takes errors as independent in time.
        kind: how ``block`` estimates σ_j, see :func:`joint_deviations`.

    Raises:
        IdentificationError: the rows do not determine every parameter; the message names those.
    """
    x, y, words = _white(rows, errors, kind)
    require_full_rank(x, names)
    kept = list(range(len(names)))
    full = _Solution.of(x, y)
    current = full
    dropped: list[Dropped] = []
    refused = None
    while len(kept) > 1:
        with np.errstate(divide="ignore"):
            percent = 100.0 * np.sqrt(np.diag(current.covariance)) / np.abs(current.beta)
        worst = int(np.argmax(percent))
        if percent[worst] < percent_sigma:
            break
        fewer = [k for place, k in enumerate(kept) if place != worst]
        candidate = _Solution.of(x[:, fewer], y)
        verdict = _compare(full, candidate, names[kept[worst]], float(percent[worst]))
        if verdict.p_value < level:
            refused = verdict
            break
        dropped.append(verdict)
        kept, current = fewer, candidate
    chosen = tuple(names[k] for k in kept)
    return EssentialFit(chosen, current.beta, current.covariance, words, tuple(dropped), refused)


def _white(
    rows: Rows, errors: Literal["ar", "block"], kind: ErrorDeviation
) -> tuple[FloatArray, FloatArray, str]:
    """X and y on which errors have unit deviation, and in words how they became so."""
    if errors == "block":
        stacked = stack(rows)
        weights = stacked.spread(1.0 / joint_deviations(stacked, kind))
        return stacked.x * weights[:, np.newaxis], stacked.y * weights, "Ω per joint, independent in time"
    whitening = regression_whitening(rows.torque, rows.regressor, rows.segment, rows.used)
    y = whitening.apply(rows.torque[:, :, np.newaxis], rows.segment, rows.used)[:, 0]
    return whitening.apply(rows.regressor, rows.segment, rows.used), y, whitening.describe()


@dataclass(frozen=True)
class _Solution:
    beta: FloatArray
    covariance: FloatArray
    residual_sum: float
    freedom: int

    @classmethod
    def of(cls, x: FloatArray, y: FloatArray) -> _Solution:
        q, r = np.linalg.qr(x)
        beta = np.asarray(np.linalg.solve(r, q.T @ y), dtype=np.float64)
        residual = y - x @ beta
        inverse = np.linalg.inv(r)
        freedom = int(y.size - x.shape[1])
        covariance = inverse @ inverse.T * float(residual @ residual) / freedom
        return cls(beta, covariance, float(residual @ residual), freedom)


def _compare(full: _Solution, fewer: _Solution, name: str, percent: float) -> Dropped:
    df = (float(fewer.freedom - full.freedom), float(full.freedom))
    statistic = (fewer.residual_sum - full.residual_sum) / df[0] / (full.residual_sum / df[1])
    return Dropped(name, percent, statistic, df, beyond_f(statistic, *df))
