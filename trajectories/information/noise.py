"""The torque error that rows of an identification are expected to have.

Identification reports the deviations of its estimates for the errors that it finds in its residuals: one
deviation per joint, and, by default, an autoregressive process along time. A prediction is as good as its
guess of those errors, so an earlier identification of the same arm is the best source of both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ident.estimators import LinearFit
from ident.preparation.observation import Rows
from ident.statistics.restricted import regression_whitening
from ident.statistics.whitening import Whitening
from robots.arrays import FloatArray
from robots.description import Robot
from trajectories.errors import PlanError

DEFAULT_SHARE = 0.01
"""Deviation of a row per joint as a share of the torque limit, where nothing better is known."""

_SAME_RATE = 0.02
"""Relative difference of two row intervals within which an AR process of one serves the other."""


@dataclass(frozen=True)
class TorqueNoise:
    """Errors of the rows per joint: white, or autoregressive along time.

    Attributes:
        sigma: (n,) standard deviation of a row, N·m (or N).
        coefficients: per joint (order,) of e_t = a₁e_{t−1} + … + u_t; empty where white.
        innovation: (n,) standard deviation of u_t.
        row_time: s between the rows that it was found on; NaN where it does not matter.
        source: where it comes from, in words.
    """

    sigma: FloatArray
    coefficients: tuple[FloatArray, ...]
    innovation: FloatArray
    row_time: float
    source: str

    @classmethod
    def white(cls, robot: Robot, sigma: ArrayLike | None = None) -> TorqueNoise:
        """Independent errors of given deviations (n,); the description's where not given, else 1 % of torque.

        Raises:
            PlanError: sigma is not one positive number per joint.
        """
        if sigma is None:
            noise, source = _described(robot)
        else:
            noise, source = np.asarray(sigma, dtype=np.float64), "as given, white"
        if noise.shape != (robot.n,) or not (noise > 0.0).all() or not np.isfinite(noise).all():
            raise PlanError(
                f"sigma is {noise.tolist()}; allowed: {robot.n} positive numbers, one per joint",
                constraint="sigma",
            )
        empty = tuple(np.empty(0) for _ in range(robot.n))
        return cls(noise, empty, noise, float("nan"), source)

    @classmethod
    def of_rows(cls, rows: Rows, fit: LinearFit, source: str = "an earlier identification") -> TorqueNoise:
        """The errors that least squares left on rows: its Ω, and an AR process per joint."""
        residual = rows.torque - rows.regressor @ fit.beta
        process = regression_whitening(residual, rows.regressor, rows.segment, rows.used)
        first = rows.time[rows.segment == rows.segment[0]]
        return cls(
            sigma=fit.sigma,
            coefficients=process.coefficients,
            innovation=process.sigma,
            row_time=float(np.median(np.diff(first))),
            source=source,
        )

    def process(self, row_time: float) -> Whitening:
        """The errors of rows ``row_time`` s apart.

        An AR process found at another rate is left out: its deviation per row stays, its memory does not
        carry over.
        """
        memory = [a for a in self.coefficients if a.size]
        if not memory or abs(row_time / self.row_time - 1.0) > _SAME_RATE:
            empty = tuple(np.empty(0) for _ in self.coefficients)
            return Whitening("block", empty, self.sigma)
        return Whitening("ar", self.coefficients, self.innovation)

    def describe(self, row_time: float) -> str:
        """The errors of rows ``row_time`` s apart, in words."""
        kind = self.process(row_time).kind
        lost = any(a.size for a in self.coefficients) and kind == "block"
        return self.source + (", taken as white: its rows were at another rate" if lost else "")


def _described(robot: Robot) -> tuple[FloatArray, str]:
    """Deviations (n,) of the description, a share of the torque limit where it has none, and in words."""
    given = [joint.torque_noise for joint in robot.joint]
    noise = [
        DEFAULT_SHARE * joint.torque if value is None else value
        for joint, value in zip(robot.joint, given, strict=True)
    ]
    if all(value is None for value in given):
        return np.array(noise), "1 % of each joint's torque limit, white"
    missing = [joint.name for joint in robot.joint if joint.torque_noise is None]
    rest = f", 1 % of the torque limit for {', '.join(missing)}" if missing else ""
    return np.array(noise), f"torque_noise of the robot's description{rest}, white"
