"""Per joint, how much of the torque on recordings that were not fitted a model leaves unexplained."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.discrepancy.deviations import BLOCK
from ident.discrepancy.prepared_recording import PreparedRecording
from robots.arrays import BoolArray, FloatArray

_INTERVAL = 1.644854
"""Standard deviations of a one-sided 95 % bound."""


@dataclass(frozen=True)
class Unexplained:
    """What a model leaves of one joint's torque where the joint moves, as shares of its rms.

    Attributes:
        joint: from 0.
        error: of the whole residual, noise included.
        noise: of what no model explains: what does not repeat, or where nothing repeats what differs from row
            to row (half the mean squared difference of neighbours; Rice 1984).
        share: of the rest, √(error² − noise²).
        least: what that is at least, at 95 %, from its spread over blocks of time.
        repeats: whether noise was told from repeats.
    """

    joint: int
    error: float
    noise: float
    share: float
    least: float
    repeats: bool


def unexplained_of(
    prepared: Sequence[PreparedRecording], residuals: Sequence[FloatArray]
) -> tuple[Unexplained, ...]:
    """Worst joint first; a joint that stands still leaves nothing.

    Args:
        prepared: recordings that were not fitted.
        residuals: per piece, of the model, samples × joints at the full rate, N·m (or N).
    """
    repeats = all(piece.period is not None for piece in prepared)
    left = [piece.thin(residual) for piece, residual in zip(prepared, residuals, strict=True)]
    noise = [
        piece.noise_of(residual) ** 2 if repeats else _between_rows(thin, piece.moving)
        for piece, residual, thin in zip(prepared, residuals, left, strict=True)
    ]
    joints = range(prepared[0].torque.shape[1])
    found = [_of_joint(joint, prepared, left, noise, repeats) for joint in joints]
    return tuple(sorted(found, key=lambda one: -one.share))


def _between_rows(residual: FloatArray, used: BoolArray) -> FloatArray:
    """Rows × joints of squares whose mean is the variance of what differs from row to row."""
    squares = np.zeros_like(residual)
    both = used[1:] & used[:-1]
    squares[1:] = np.where(both, 0.5 * np.diff(residual, axis=0) ** 2, 0.0)
    share = np.maximum(both.sum(axis=0), 1) / np.maximum(used.sum(axis=0), 1)
    return np.asarray(squares / share)


def _of_joint(
    joint: int,
    prepared: Sequence[PreparedRecording],
    left: Sequence[FloatArray],
    noise: Sequence[FloatArray],
    repeats: bool,
) -> Unexplained:
    keep = [piece.moving[:, joint] for piece in prepared]

    def pick(parts: Sequence[FloatArray]) -> FloatArray:
        return np.concatenate([part[mask, joint] for part, mask in zip(parts, keep, strict=True)])

    torque = pick([piece.torque for piece in prepared])
    whole = float(np.sum(torque**2))
    if whole == 0.0:
        return Unexplained(joint, 0.0, 0.0, 0.0, 0.0, repeats)
    squares, floor = pick(left) ** 2, pick(noise)
    beyond = (squares - floor) / whole
    blocks = np.concatenate(
        [
            k * 10**6 + piece.time[mask] // BLOCK
            for k, (piece, mask) in enumerate(zip(prepared, keep, strict=True))
        ]
    )
    sums = np.bincount(np.unique(blocks, return_inverse=True)[1], beyond)
    total, spread = float(sums.sum()), float(np.sqrt(sums.size) * sums.std(ddof=1)) if sums.size > 1 else 0.0
    return Unexplained(
        joint,
        float(np.sqrt(squares.sum() / whole)),
        float(np.sqrt(floor.sum() / whole)),
        float(np.sqrt(max(total, 0.0))),
        float(np.sqrt(max(total - _INTERVAL * spread, 0.0))),
        repeats,
    )
