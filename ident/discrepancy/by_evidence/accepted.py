"""An accepted model as prior: of its file, or of the run that it is accepted on by the same evidence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.discrepancy.by_evidence.decide.instruments import fitted_motion
from ident.discrepancy.by_evidence.decide.problem import Problem, pose
from ident.discrepancy.by_evidence.decide.state import TEMPERATURE
from ident.discrepancy.prior import Prior
from ident.parameters.base import BaseParameters
from ident.recording import Recording
from robots.arrays import FloatArray

RUN_TO_RUN = 0.002
"""Of each parameter: what two identifications of an unchanged arm may differ by beyond their deviations."""

_LEAST_MISFIT = 0.3
"""Of the noise: a κ below it is not told from none, so an accepted one is not taken for less."""


def widened(values: FloatArray, covariance: FloatArray) -> FloatArray:
    """A covariance (b, b) of accepted parameters (b,), with what differs from run to run.

    The search takes the evidence to the power T, since rows are worth less than the model of the data has
    them. The prior is a factor of it, and what runs differ by is no row, so T is taken out of its square.
    """
    return np.asarray(covariance + TEMPERATURE * np.diag((RUN_TO_RUN * values) ** 2))


def accepted_prior(values: FloatArray, covariance: FloatArray, noise: FloatArray | None = None) -> Prior:
    """A model that was identified and accepted.

    Args:
        values: (b,) estimates.
        covariance: (b, b) theirs.
        noise: (n,) of the accepted recording, see ``noise_level``; louder joints are then noticed.
    """
    return Prior(values, widened(values, covariance), "accepted model", noise)


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
    covariance = widened(values, problem.beta.covariance(posterior.covariance))
    noise = np.array([one.marginal for one in problem.rows.noise])
    misfit = np.maximum(problem.level.kappa, _LEAST_MISFIT * noise)
    return Prior(values, covariance, "accepted run", noise, misfit)
