"""Two-stage least squares: more instruments than parameters (method.md 4)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ident.errors import IdentificationError
from ident.estimators.fit import LinearFit, Stacked
from robots.arrays import FloatArray


@dataclass(frozen=True)
class TwoStageFit(LinearFit):
    """A linear fit with the projected regressors that gave it.

    Attributes:
        projected: (r, b) X̂ = ZΠ̂, not weighted; the instruments of any other covariance.
    """

    projected: FloatArray = field(kw_only=True)


def two_stage_least_squares(stacked: Stacked, z: FloatArray, sigma: FloatArray) -> TwoStageFit:
    """β̂ = (X̂ᵀΩ⁻¹X̂)⁻¹X̂ᵀΩ⁻¹y with X̂ = ZΠ̂, Π̂ by weighted least squares.

    Its covariance is Ω's, of the residuals y − Xβ̂ (those of y − X̂β̂ hold V̂β̂ as well).

    Args:
        stacked: rows joint by joint.
        z: (r, m) instruments, m ≥ b.
        sigma: (n,) deviations for Ω in both stages.

    Raises:
        IdentificationError: the instruments do not span as many directions as there are parameters.
    """
    b = stacked.x.shape[1]
    if z.shape[1] < b:
        raise IdentificationError(f"{z.shape[1]} instruments for {b} parameters; at least as many are needed")
    weights = stacked.spread(1.0 / sigma)[:, np.newaxis]
    x, instruments, y = stacked.x * weights, z * weights, stacked.y * weights[:, 0]
    projected = instruments @ np.linalg.lstsq(instruments, x, rcond=None)[0]
    q, r = np.linalg.qr(projected)
    diagonal = np.abs(np.diag(r))
    if diagonal.min() < 1e-10 * np.linalg.norm(x, axis=0).max():
        raise IdentificationError("the instruments do not move every regressor; the estimate is not defined")
    beta = np.asarray(np.linalg.solve(r, q.T @ y), dtype=np.float64)
    residuals = stacked.split(stacked.y - stacked.x @ beta)
    fresh = np.array([np.sqrt(e @ e / (e.size - b / stacked.joints)) for e in residuals])
    scaled = projected * stacked.spread(fresh / sigma)[:, np.newaxis]
    inverse = np.linalg.inv(projected.T @ projected)
    return TwoStageFit(
        beta,
        inverse @ (scaled.T @ scaled) @ inverse,
        fresh,
        float(np.linalg.cond(x)),
        projected=projected / weights,
    )
