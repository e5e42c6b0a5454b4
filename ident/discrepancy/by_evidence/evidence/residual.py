"""What the known columns and the misfit leave of the torque, and the noise that is read off it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.signal import butter, sosfiltfilt

from ident.discrepancy.by_evidence.evidence.gram import Level
from ident.discrepancy.by_evidence.evidence.noise import Noise, autoregressive
from ident.discrepancy.by_evidence.evidence.prepared import Prepared
from ident.discrepancy.by_evidence.evidence.rows import Known, Rows, WhiteEffects
from ident.discrepancy.by_evidence.evidence.solved import Posterior
from robots.arrays import FloatArray

_MOTION = 1.0 / 16.0
"""Of the cut-off: what is slower is motion, as of other periods (:mod:`.expected_motion`)."""

_ORDER = 2
"""Of the low-pass that takes it off."""

_RIDGE = 1e-3
"""Of a unit column's energy: a first fit has to leave the noise, not to be right."""


def first_noise(prepared: Prepared, known: Known, basis: tuple[FloatArray, ...]) -> tuple[Noise, ...]:
    """Noise beside a ridge fit of everything, before κ is known."""
    left = np.empty_like(known.target)
    for j, misfit in enumerate(basis):
        used = prepared.used[:, j]
        columns = np.concatenate([known.columns[:, j], misfit], axis=1)
        columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
        inside = columns[used]
        system = inside.T @ inside + _RIDGE * np.eye(columns.shape[1])
        left[:, j] = known.target[:, j] - columns @ np.linalg.solve(system, inside.T @ known.target[used, j])
    return _noise(prepared, left, np.zeros(left.shape[1]))


def noise_beside(rows: Rows, level: Level, posterior: Posterior) -> tuple[Noise, ...]:
    """Noise beside the posterior of the known columns and the misfit."""
    left, freedom = residual(rows, level, posterior)
    return _noise(rows.prepared, left, freedom)


def residual(rows: Rows, level: Level, posterior: Posterior) -> tuple[FloatArray, FloatArray]:
    """Rows × joints, N·m (or N), less the known columns and the misfit, and (n,) what was fitted to it."""
    known = rows.known
    left = known.target - known.columns @ posterior.known
    freedom = np.empty(rows.n)
    for j in range(rows.n):
        weights, lost = _misfit_weights(rows, j, level, _white_left(rows, j, posterior, ()))
        left[:, j] -= rows.misfit[j] @ weights
        freedom[j] = lost + known.precision.size / rows.n
    return left, freedom


def white_residual(
    rows: Rows, level: Level, posterior: Posterior, effects: Sequence[WhiteEffects]
) -> list[FloatArray]:
    """Per joint (N,), white rows less the known columns, the effects of a set and the misfit.

    Args:
        rows: the data.
        level: of the misfit.
        posterior: of the set.
        effects: of the set.
    """
    found = []
    k = rows.known.precision.size
    for j, white in enumerate(rows.white):
        left = _white_left(rows, j, posterior, effects)
        weights, _ = _misfit_weights(rows, j, level, left)
        found.append(left - white[:, k:-1] @ weights)
    return found


def _white_left(rows: Rows, j: int, posterior: Posterior, effects: Sequence[WhiteEffects]) -> FloatArray:
    """(N,) white rows of a joint less the known columns and the effects of a set."""
    white, start = rows.white[j], 0
    left = white[:, -1] - white[:, : rows.known.precision.size] @ posterior.known
    for one in effects:
        if one.joints[j] is not None:
            left = left - one.columns(j) @ posterior.theta[start : start + one.count]
        start += one.count
    return np.asarray(left)


def _misfit_weights(rows: Rows, j: int, level: Level, left: FloatArray) -> tuple[FloatArray, float]:
    """Posterior mean of w of a joint from what all else leaves of its white rows, and how many are fitted."""
    k, m = rows.known.precision.size, rows.misfit[j].shape[1]
    white = rows.white[j]
    values, vectors = rows.diagonal[j]
    variance = float(level.kappa[j]) ** 2 / max(m, 1) / float(level.excess[j]) ** 2
    shrunk = variance / (1.0 + variance * values)
    weights = vectors @ (shrunk * (vectors.T @ (white[:, k : k + m].T @ left)))
    return weights, float(np.sum(shrunk * values))


def _noise(prepared: Prepared, left: FloatArray, freedom: FloatArray) -> tuple[Noise, ...]:
    if prepared.repeats:
        left, freedom = prepared.not_repeating(left), np.zeros_like(freedom)
    else:
        left = _quick(prepared, left)
    segment, used = prepared.segment, prepared.used
    return tuple(
        autoregressive(left[:, j], segment, used[:, j], float(freedom[j])) for j in range(left.shape[1])
    )


def _quick(prepared: Prepared, left: FloatArray) -> FloatArray:
    """Rows × joints less what is as slow as motion, where nothing repeats.

    Innovations beside a misfit are not told from it there: each round the noise takes what the misfit leaves
    and leaves it less, until a spring that the model lacks is noise that remembers for seconds, and no effect
    is seen. Rows that do not count are bridged: friction at standstill is not to be spread over its
    neighbours.
    """
    quick = left.copy()
    cutoff = _MOTION * prepared.robot.identification.cutoff_hz
    for index, part in enumerate(prepared.parts):
        rows = np.flatnonzero(prepared.segment == index)
        row_time = part.sample_time * prepared.robot.identification.decimation
        low = butter(_ORDER, cutoff, fs=1.0 / row_time, output="sos")
        for joint in range(left.shape[1]):
            used = np.flatnonzero(part.used[:, joint])
            if used.size:
                bridged = np.interp(np.arange(part.rows), used, left[rows[used], joint])
                quick[rows, joint] -= sosfiltfilt(low, bridged)
    return quick
