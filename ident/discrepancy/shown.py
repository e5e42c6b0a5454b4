"""The base parameters that a gap is shown with."""

from __future__ import annotations

import numpy as np

from ident.discrepancy.examination import Examination
from robots.arrays import FloatArray


def shown_values(examination: Examination) -> FloatArray:
    """Base parameters (b,) that the gap is shown with.

    Against a prior these are the prior's own, with free what the prior leaves free and what was found;
    otherwise the fitted ones.
    """
    prior = examination.prior
    if prior is None:
        return examination.beta
    held = np.isfinite(np.diag(prior.covariance))
    if examination.loop is not None:
        return np.where(held, prior.values, examination.beta)
    rows = examination.data_rows
    x, y, z = (m[:rows] for m in (examination.regressor, examination.torque, examination.instruments))
    beta = np.where(held, prior.values, 0.0)
    free = ~held
    scale = np.linalg.norm(x[:, free], axis=0)
    cross = (z[:, free] / scale).T @ (x[:, free] / scale)
    beta[free] = np.linalg.solve(cross, (z[:, free] / scale).T @ (y - x @ beta)) / scale
    return beta
