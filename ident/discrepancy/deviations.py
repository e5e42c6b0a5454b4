"""Parameters of what was found, without the noise of their own columns, and deviations that count misfit.

A column that follows jerk or acceleration is made of measured positions and holds their noise. Least squares
takes such a parameter for smaller than it is: a current loop lag by a tenth to a half. Where the trajectory
repeats, columns at the other periods' motion are the instruments of those at the measured motion, as they are
for the present model.

What a finding leaves is not white either: its form is never quite that of the arm. Deviations are the larger
of those of white rows and of a sandwich over blocks of time (Liang and Zeger 1986). The same place in all
periods is one block, because misfit repeats with them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ident.discrepancy.bounded import DEPENDENT
from ident.discrepancy.examination import Examination
from ident.discrepancy.prepared_recording import PreparedRecording
from ident.statistics.whitening import Whitening
from robots.arrays import BoolArray, FloatArray, IntArray

BLOCK = 0.5
"""s; several times as long as the loop takes to answer, and short enough for two dozen in a usual period."""

_NOTHING = 1e-290
"""Norm of a column that is not there."""


def instrumented(
    instruments: FloatArray, columns: FloatArray, residual: FloatArray, bounds: FloatArray
) -> FloatArray | None:
    """Parameters (p,) that solve instrumentsᵀ(residual − columns·parameters) = 0.

    Args:
        instruments: (N, p) partialled out of the present model.
        columns: (N, p) at the measured motion, whitened.
        residual: (N,) that the present model leaves.
        bounds: (p, 2), lowest and highest.

    Returns:
        None where a parameter would leave its bounds.
    """
    left, right = _unit(instruments), _unit(columns)
    inverse = np.linalg.pinv(left[0].T @ right[0], rcond=np.sqrt(DEPENDENT))
    values = inverse @ (left[0].T @ residual) / right[1]
    within = (values >= bounds[:, 0]) & (values <= bounds[:, 1])
    return values if within.all() else None


def deviations(
    examination: Examination, instruments: FloatArray, columns: FloatArray, residual: FloatArray
) -> FloatArray:
    """Standard deviations (k,) of parameters and shapes; 0 where the data do not show one.

    Args:
        examination: of the present model.
        instruments: (N, k) partialled out of the present model.
        columns: (N, k) whose factors they are; the instruments themselves in least squares.
        residual: (N,) that is left with them.
    """
    freedom = max(1, residual.size - examination.base.independent.size)
    left = max(1.0, float(residual @ residual) / freedom)
    z, size = _unit(instruments)
    x, scale = _unit(columns)
    seen = (size > _NOTHING) & (scale > _NOTHING)
    z, x = z[:, seen], x[:, seen]
    inverse = np.linalg.pinv(z.T @ x, rcond=DEPENDENT)
    white = np.diag(inverse @ (left * z.T @ z) @ inverse.T)
    blocks = np.diag(inverse @ _between_blocks(examination, z * residual[:, np.newaxis]) @ inverse.T)
    sigma = np.zeros(size.size)
    sigma[seen] = np.sqrt(np.maximum(white, blocks)) / scale[seen]
    return sigma


def _unit(columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    norms = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    return columns / norms, norms


def _between_blocks(examination: Examination, moments: FloatArray) -> FloatArray:
    """(k, k) covariance of the sum of moments (N, k) that are independent from block to block."""
    labels = blocks_of(examination)
    sums = np.zeros((int(labels.max()) + 1, moments.shape[1]))
    np.add.at(sums, labels, moments[: labels.size])
    count = sums.shape[0]
    of_prior = moments[labels.size :]  # each row of the prior is a block
    return np.asarray(sums.T @ sums * (count / max(1, count - 1)) + of_prior.T @ of_prior)


def blocks_of(examination: Examination) -> IntArray:
    """Which block of time each whitened row of the data is in: (data rows,)."""
    return block_labels(examination.prepared, examination.segment, examination.used, examination.whitening)


def block_labels(
    prepared: Sequence[PreparedRecording], segment: IntArray, used: BoolArray, whitening: Whitening
) -> IntArray:
    """The same of any rows: (whitened rows,).

    Args:
        prepared: the recordings.
        segment: (rows,) which recording a row is of.
        used: rows × joints that count.
        whitening: what the rows are whitened with.
    """
    labels, first = [], 0
    for k, piece in enumerate(prepared):
        rows = int((segment == k).sum())
        time = np.arange(rows) * piece.recording.sample_time * piece.decimation
        if piece.period is not None:
            time = time % (piece.period * piece.recording.sample_time)
        label = first + (time / BLOCK).astype(np.int64)
        first = int(label.max()) + 1
        labels.append(label)
    whole = np.concatenate(labels)[:, np.newaxis, np.newaxis]
    # The rows that whitening keeps, but not mixed.
    plain = replace(
        whitening,
        coefficients=tuple(np.zeros_like(a) for a in whitening.coefficients),
        sigma=np.ones_like(whitening.sigma),
    )
    kept = plain.apply(np.broadcast_to(whole.astype(np.float64), (*used.shape, 1)), segment, used)
    return np.asarray(np.rint(kept[:, 0]), dtype=np.int64)
