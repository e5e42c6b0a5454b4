"""M-estimators on whitened rows: contacts and spikes weigh less (Huber 1981, chapter 7)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ident.estimators.fit import LinearFit, Stacked
from ident.estimators.least_squares import ErrorDeviation, joint_deviations, require_full_rank
from robots.arrays import FloatArray

_STILL = 1e-8
_ITERATIONS = 200
_QUARTILE = 0.6744897501960817
"""Of the standard normal distribution, Φ⁻¹(3/4)."""

Function = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class RobustFit(LinearFit):
    """A linear fit with the weight that each row was given.

    Attributes:
        weights: (r,) 1 where a row is believed, below 1 where its residual is large.
    """

    weights: FloatArray = field(kw_only=True)


@dataclass(frozen=True)
class MEstimator:
    """An estimator by iteratively reweighted least squares.

    Attributes:
        name: by which it is asked for.
        words, short: as people and table headings call it.
        method: what the covariance is said to be of, e.g. ``Huber's, 1.345``.
        weight: w(u) of residuals in robust σ; ψ(u) = u·w(u).
        slope: ψ'(u).
        start: the estimator whose answer it begins from; least squares where None. One whose ψ falls again
            has more than one solution, and needs a good one to begin from.
    """

    name: str
    words: str
    short: str
    method: str
    weight: Function
    slope: Function
    start: MEstimator | None = None

    def fit(self, stacked: Stacked, names: tuple[str, ...], kind: ErrorDeviation = "unbiased") -> RobustFit:
        """Rows far off by robust σ of their joint weigh less.

        The scale of each joint is its median absolute residual, so the joints are weighed against each other
        by what most of their rows say. Covariance: Huber's first proposal with the correction for b.

        Args:
            stacked: rows joint by joint.
            names: (b,) base parameter names, to say which cannot be seen.
            kind: how the first σ_j is estimated, see :func:`joint_deviations`.

        Raises:
            IdentificationError: the rows do not determine every parameter; the message names those.
        """
        if self.start is None:
            scale = joint_deviations(stacked, kind)
            require_full_rank(stacked.x / stacked.spread(scale)[:, np.newaxis], names)
            beta = _solve(stacked, scale, np.ones(stacked.y.size))
        else:
            beta = self.start.fit(stacked, names, kind).beta
        residual = stacked.y - stacked.x @ beta
        iteration, moved = 0, np.inf
        while moved >= _STILL and iteration < _ITERATIONS:
            iteration += 1
            scale = robust_deviations(stacked, residual)
            weights = self.weight(residual / stacked.spread(scale))
            fresh = _solve(stacked, scale, weights)
            residual = stacked.y - stacked.x @ fresh
            moved = float(np.max(np.abs(fresh - beta)))
            beta = fresh
        whitened = stacked.x / stacked.spread(scale)[:, np.newaxis]
        return RobustFit(
            beta,
            self._covariance(whitened, residual / stacked.spread(scale)),
            scale,
            float(np.linalg.cond(whitened)),
            f"{self.method} robust σ per joint, errors independent in time",
            iteration,
            moved < _STILL,
            weights=weights,
        )

    def _covariance(self, whitened: FloatArray, u: FloatArray) -> FloatArray:
        """k² Σψ²/(r − b) / m² · (XᵀΩ⁻¹X)⁻¹ with m the mean of ψ' and k = 1 + b/r · var ψ'/m²."""
        rows, b = whitened.shape
        influence, slope = u * self.weight(u), self.slope(u)
        mean = float(slope.mean())
        correction = 1.0 + b / rows * float(slope.var()) / mean**2
        variance = correction**2 * float(influence @ influence) / (rows - b) / mean**2
        return np.asarray(variance * np.linalg.inv(whitened.T @ whitened))


def robust_deviations(stacked: Stacked, residual: FloatArray) -> FloatArray:
    """(n,) median |ε| of each joint over that of a standard normal variable."""
    return np.array([np.median(np.abs(part)) / _QUARTILE for part in stacked.split(residual)])


def _solve(stacked: Stacked, scale: FloatArray, weights: FloatArray) -> FloatArray:
    root = np.sqrt(weights) / stacked.spread(scale)
    return np.asarray(
        np.linalg.lstsq(stacked.x * root[:, np.newaxis], stacked.y * root, rcond=None)[0], dtype=np.float64
    )
