"""What identification will make of a motion, before anything moves: rows, σ and %σ of each parameter.

The rows are made by identification's own code from the sampled positions: the same low-pass, differences,
decimation and trim, and without the rows that are too slow. The deviations are those of the estimator
and the errors that identification reports by default: weighted least squares, errors autoregressive
along time where an earlier identification says so.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np

from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters
from ident.preparation.observation import Rows, observe
from ident.recording import Recording
from ident.statistics.covariance import weighted_score_covariance
from robots.arrays import BoolArray, FloatArray
from robots.description import Identification
from trajectories.errors import PlanError
from trajectories.information.expected import ExpectedValues
from trajectories.information.matrix import ROW_RATE, Information
from trajectories.information.noise import TorqueNoise

_LOG = logging.getLogger(__name__)

_BLIND = 1e-12
"""Eigenvalues of the information of columns of unit norm below this share of the largest are rounding."""

_PART = 1e-4
"""A parameter with a larger part in what is not seen is not seen."""

_BELOW_NYQUIST = 0.8


@dataclass(frozen=True)
class Prediction:
    """What identification will say of each base parameter.

    Attributes:
        names, units: of the base parameters (b,).
        expected: what they are expected to be, SI.
        sigma: (b,) standard deviation of their estimates, SI; inf for what the motion does not show.
        information: G at 100 rows per second, of rows weighted by each joint's σ.
        used: (n,) share of each joint's rows that are fast enough to be used.
        rows: how many are.
        row_time: s between rows.
        noise: the errors assumed, in words.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    expected: ExpectedValues
    sigma: FloatArray
    information: Information
    used: FloatArray
    rows: int
    row_time: float
    noise: str

    @property
    def percent_sigma(self) -> FloatArray:
        """(b,) the 100·σ/|β̂| to expect; inf where nothing is known of the value or nothing is seen of it."""
        return self.expected.percent_sigma(self.sigma)

    @property
    def values(self) -> FloatArray:
        """(b,) what the parameters are expected to be, SI."""
        return self.expected.value

    @property
    def unseen(self) -> tuple[str, ...]:
        """Parameters that the motion does not show or not tell apart."""
        return tuple(name for name, sigma in zip(self.names, self.sigma, strict=True) if np.isinf(sigma))


@dataclass(frozen=True)
class Shown:
    """What the rows of a motion add up to.

    Attributes:
        matrix: G = XᵀΩ⁻¹X (b × b) of rows weighted by each joint's σ.
        score: (b × b) covariance of XᵀΩ⁻¹ε.
        used: (n,) rows of each joint that are fast enough to be used.
        samples: rows of each joint.
        row_time: s between rows.
    """

    matrix: FloatArray
    score: FloatArray
    used: FloatArray
    samples: float
    row_time: float

    def with_more_of(self, shorter: Shown, times: float) -> Shown:
        """With so many periods more, each as the last one here: what ``shorter`` has not."""

        def more(name: str) -> Any:
            here = getattr(self, name)
            return here + times * (here - getattr(shorter, name))

        return Shown(more("matrix"), more("score"), more("used"), more("samples"), self.row_time)


def shown(base: BaseParameters, time: FloatArray, position: FloatArray, noise: TorqueNoise) -> Shown:
    """What a recording of a motion would show of the base parameters.

    Args:
        base: the parameters; its robot's ``identification`` settings make the rows.
        time: (N,) s, the instants of the samples.
        position: N × joints.
        noise: the errors to expect.

    Raises:
        PlanError: the motion is too short to be identified from.
    """
    rows = _rows(base, time, position)
    x = np.where(rows.used[:, :, np.newaxis], rows.regressor, 0.0)
    row_time = float(np.median(np.diff(rows.time)))
    matrix = np.einsum("sja,j,sjb->ab", x, noise.sigma**-2, x, optimize=True)
    process, score = noise.process(row_time), matrix
    if process.kind == "ar":
        score = weighted_score_covariance(x, noise.sigma, process, rows.segment)
    return Shown(matrix, score, rows.used.sum(axis=0).astype(float), float(len(rows.time)), row_time)


def predict(base: BaseParameters, seen: Shown, noise: TorqueNoise, expected: ExpectedValues) -> Prediction:
    """Predict the deviations of the base parameters.

    Args:
        base: the parameters.
        seen: of the motion.
        noise: the errors to expect.
        expected: what the parameters are expected to be.
    """
    return Prediction(
        names=base.names,
        units=base.units,
        expected=expected,
        sigma=_deviations(seen),
        information=Information(seen.matrix * (ROW_RATE * seen.row_time)),
        used=seen.used / seen.samples,
        rows=round(float(seen.used.sum())),
        row_time=seen.row_time,
        noise=noise.describe(seen.row_time),
    )


def _rows(base: BaseParameters, time: FloatArray, position: FloatArray) -> Rows:
    settings = _possible(base.model.robot.identification, float(time[1] - time[0]))
    try:
        recording = Recording("trajectory", time, None, position, np.zeros_like(position))
        return observe(base, (recording,), settings)
    except IdentificationError as error:
        raise PlanError(
            f"{error}; allowed: a longer duration or a shorter cycle", constraint="duration"
        ) from error


def _possible(settings: Identification, sample_time: float) -> Identification:
    """The settings, with a cut-off that samples so far apart allow."""
    highest = _BELOW_NYQUIST * 0.5 / sample_time
    if settings.cutoff_hz <= highest:
        return settings
    _LOG.warning(
        "cut-off %g Hz is too high for samples %g s apart; predicted with %g Hz",
        settings.cutoff_hz,
        sample_time,
        highest,
    )
    return settings.model_copy(update={"cutoff_hz": highest})


def _deviations(seen: Shown) -> FloatArray:
    """(b,) of G⁻¹ S G⁻¹ with S the covariance of XᵀΩ⁻¹ε; inf for parameters that G does not see."""
    inverse, blind = inverse_of(seen.matrix)
    variance = np.einsum("ab,bc,ca->a", inverse, seen.score, inverse, optimize=True)
    return np.asarray(np.where(blind, np.inf, np.sqrt(np.maximum(variance, 0.0))))


def inverse_of(matrix: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Inverse on what an information matrix sees, and the parameters with a part in what it does not."""
    scale = np.sqrt(np.diag(matrix))
    scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    seen = values > _BLIND * values[-1]
    inverse = (vectors[:, seen] / values[seen]) @ vectors[:, seen].T / np.outer(scale, scale)
    blind = (vectors[:, ~seen] ** 2).sum(axis=1) > _PART**2
    return inverse, blind
