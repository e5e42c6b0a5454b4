"""Instrumental variables: β̂ = (ZᵀΩ⁻¹X)⁻¹ZᵀΩ⁻¹y with as many instruments as parameters (method.md 4)."""

from __future__ import annotations

import numpy as np

from ident.estimators.fit import LinearFit, Stacked
from robots.arrays import FloatArray


def instrumental_variables(stacked: Stacked, z: FloatArray, sigma: FloatArray) -> LinearFit:
    """One IV solution; Ω of its covariance is made of its own residuals.

    Args:
        stacked: rows joint by joint.
        z: (r, b) instruments, the columns at the simulated states.
        sigma: (n,) deviations for Ω in the estimate.

    Raises:
        numpy.linalg.LinAlgError: ZᵀΩ⁻¹X is singular.
    """
    weights = stacked.spread(1.0 / sigma)
    x = stacked.x * weights[:, np.newaxis]
    instruments = z * weights[:, np.newaxis]
    cross = instruments.T @ x
    beta = np.asarray(np.linalg.solve(cross, instruments.T @ (stacked.y * weights)), dtype=np.float64)
    lost = stacked.x.shape[1] / stacked.joints
    residuals = stacked.split(stacked.y - stacked.x @ beta)
    fresh = np.array([np.sqrt(e @ e / (e.size - lost)) for e in residuals])
    scaled = instruments * stacked.spread(fresh / sigma)[:, np.newaxis]
    inverse = np.linalg.inv(cross)
    covariance = inverse @ (scaled.T @ scaled) @ inverse.T
    return LinearFit(beta, covariance, fresh, float(np.linalg.cond(x)))
