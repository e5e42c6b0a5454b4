"""Covariance by the moving-block bootstrap of residuals (Künsch 1989): no model of their correlation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.covariances.problem import EstimatedRows
from ident.statistics.whitening import lag1_autocorrelation
from robots.arrays import FloatArray


@dataclass(frozen=True)
class BlockBootstrap:
    """Residuals are drawn in blocks within each joint and recording; the regressors stay as they are.

    So no resample is singular, however many parameters there are. Errors have to be stationary in time.

    Attributes:
        replicates: resamples.
        block: rows in a block; by Carlstein's rule (1986) from the lag-1 autocorrelation where None.
        seed: of the resampling.
    """

    replicates: int = 400
    block: int | None = None
    seed: int = 0
    name: str = "bootstrap"

    def score_covariance(self, rows: EstimatedRows) -> FloatArray:
        generator = np.random.default_rng(self.seed)
        total = np.zeros((rows.parameters, rows.parameters))
        for z, residual in _pieces(rows):
            drawn = self._draw(residual - residual.mean(), generator)
            scores = drawn @ z
            total += scores.T @ scores / self.replicates
        return total * rows.count / (rows.count - rows.parameters)

    def blocks(self, rows: EstimatedRows) -> list[int]:
        """Rows in a block of each joint and recording."""
        return [self._length(residual) for _, residual in _pieces(rows)]

    def describe(self, rows: EstimatedRows) -> str:
        lengths = self.blocks(rows)
        return (
            f"moving-block bootstrap of residuals, {self.replicates} resamples, blocks of {min(lengths)} to"
            f" {max(lengths)} rows, seed {self.seed}"
        )

    def _length(self, residual: FloatArray) -> int:
        length = carlstein_length(residual) if self.block is None else self.block
        return max(1, min(length, residual.size // 2))

    def _draw(self, residual: FloatArray, generator: np.random.Generator) -> FloatArray:
        """(replicates, samples) resampled series; blocks wrap around the end, so that all weigh the same."""
        length = self._length(residual)
        count = -(-residual.size // length)
        starts = generator.integers(0, residual.size, size=(self.replicates, count))
        index = (starts[:, :, np.newaxis] + np.arange(length)) % residual.size
        return np.asarray(residual[index.reshape(self.replicates, -1)[:, : residual.size]])


def carlstein_length(series: FloatArray) -> int:
    """Block length that is best for an AR(1) series (samples,): (√6·ρ/(1 − ρ²))^⅔ n^⅓ (Carlstein 1986)."""
    rho = min(abs(lag1_autocorrelation(series)), 0.99)
    return int(np.ceil((np.sqrt(6.0) * rho / (1.0 - rho**2)) ** (2.0 / 3.0) * series.size ** (1.0 / 3.0)))


def _pieces(rows: EstimatedRows) -> list[tuple[FloatArray, FloatArray]]:
    """Used rows of each joint and recording: z (samples, b) and residual (samples,)."""
    parts = zip(
        rows.series(rows.z),
        rows.series(rows.residual),
        rows.series(rows.used.astype(np.float64)),
        strict=True,
    )
    return [(z[used > 0], residual[used > 0]) for z, residual, used in parts if used.any()]
