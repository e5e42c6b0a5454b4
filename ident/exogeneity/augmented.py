"""The Durbin-Wu-Hausman test with any covariance: Wald of γ = 0 in y = Xβ + V̂γ + e (method.md 5.1, 5.3)."""

from __future__ import annotations

import numpy as np

from ident.covariances import Covariance, covariance_of, estimated_rows
from ident.exogeneity.hypothesis import HypothesisTest, f_test, wald_statistic
from ident.exogeneity.textbook import WhiteRows, informative
from robots.arrays import BoolArray, FloatArray, IntArray


def augmented_wald(
    torque: FloatArray,
    regressor: FloatArray,
    instruments: FloatArray,
    sigma: FloatArray,
    segment: IntArray,
    used: BoolArray,
    kind: Covariance,
) -> HypothesisTest:
    """Wald test over its number of coefficients, against F(k, r − b − k).

    With ``iid`` this is the textbook F-test. Columns of V̂ that are null to machine precision are left out.

    Args:
        torque: samples × joints, N·m (or N).
        regressor: samples × joints × b.
        instruments: samples × joints × m.
        sigma: (n,) deviations that make Ω.
        segment: (samples,) recordings.
        used: samples × joints.
        kind: the covariance of the augmented regression.

    Raises:
        numpy.linalg.LinAlgError: the covariance of γ̂ is singular, as with fewer clusters than coefficients.
    """
    weight = used / sigma
    x, z = regressor * weight[:, :, np.newaxis], instruments * weight[:, :, np.newaxis]
    y, flat = torque * weight, WhiteRows((torque * weight)[used], x[used], z[used])
    projection, v = flat.first_stage()
    kept = informative(flat.x, v)
    b = regressor.shape[2]
    augmented = np.concatenate([x, (x - z @ projection)[:, :, kept]], axis=2)
    estimate = np.linalg.lstsq(augmented[used], flat.y, rcond=None)[0]
    ones = np.ones(sigma.size)
    rows = estimated_rows(augmented, augmented, y - augmented @ estimate, ones, segment, used)
    covariance = covariance_of(rows, kind)
    statistic = wald_statistic(estimate[b:], covariance[b:, b:]) / kept.size
    freedom = flat.y.size - b - kept.size
    null = "γ = 0: the regressors are uncorrelated with the errors"
    return f_test(f"Durbin-Wu-Hausman, {kind.name}", null, statistic, int(kept.size), freedom)
