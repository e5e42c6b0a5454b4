"""A prior from the run that a model is accepted on: parameters, noise and misfit by the same evidence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.discrepancy.by_evidence.decide.instruments import fitted_motion
from ident.discrepancy.by_evidence.decide.problem import Problem, pose
from ident.discrepancy.prior import Prior
from ident.parameters.base import BaseParameters
from ident.recording import Recording

SPREAD = 0.002
"""Of each parameter: what two identifications of an unchanged arm may differ by beyond their deviations."""

_LEAST_MISFIT = 0.3
"""Of the noise: a κ below it is not told from none, so an accepted one is not taken for less."""


def prior_by_evidence(base: BaseParameters, recordings: Sequence[Recording]) -> Prior:
    """The posterior of a model without any further effect, widened, as the prior of a later search.

    Args:
        base: of an arm with the settings of the evidence (:func:`settings_for`).
        recordings: that the model is accepted on.

    Raises:
        IdentificationError: recordings that do not fit the arm.
    """
    return prior_of(pose(base, None, fitted_motion(base, None, recordings), None))


def prior_of(problem: Problem) -> Prior:
    """The same of a run that is fitted already."""
    posterior = problem.posterior
    values = problem.beta.mean(posterior.known)
    covariance = problem.beta.covariance(posterior.covariance) + np.diag((SPREAD * values) ** 2)
    noise = np.array([one.marginal for one in problem.rows.noise])
    misfit = np.maximum(problem.level.kappa, _LEAST_MISFIT * noise)
    return Prior(values, covariance, "accepted run", noise, misfit)
