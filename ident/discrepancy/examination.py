"""The present model against the recordings: whitened rows, what it leaves, and the space it spans.

Rows are whitened with the noise that does not repeat from period to period, never with the residual, which
would absorb the effect that is looked for. Where the trajectory repeats, the other periods are the
instruments: their noise is independent of this period's, so process torque that moves the arm is not
mistaken for a delay.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.discrepancy.gap import torque_residual
from ident.discrepancy.prepared_recording import PreparedRecording, regressors
from ident.discrepancy.prior import Prior
from ident.effects.family import PlacedEffect
from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters
from ident.statistics.whitening import (
    Whitening,
    autoregressive_whitening,
    block_whitening,
    cautious_whitening,
)
from robots.arrays import BoolArray, FloatArray, IntArray

DEPENDENT = 1e-12
"""Singular values below this share of the largest are no information."""


@dataclass(frozen=True)
class Examination:
    """A model on whitened rows; rows of the prior, if there is one, follow those of the data.

    Attributes:
        base: the present model.
        prepared: the recordings.
        whitening: of the noise.
        used, segment: rows × joints and (rows,) over all recordings, as the whitening wants them.
        torque: whitened (N,).
        regressor: whitened (N, b), at the measured motion.
        instruments: whitened (N, b), at the instruments' motion.
        beta: (b,) solves instrumentsᵀ(torque − regressor·β) = 0.
        noise: rows × joints, N·m: what does not repeat (or the residual, where nothing repeats).
        repeats: whether the noise was told from repeats.
    """

    base: BaseParameters
    prepared: tuple[PreparedRecording, ...]
    whitening: Whitening
    used: BoolArray
    segment: IntArray
    torque: FloatArray
    regressor: FloatArray
    instruments: FloatArray
    beta: FloatArray
    noise: FloatArray
    repeats: bool
    prior: Prior | None
    self_simulated: Callable[[], FloatArray | None] | None = None
    """Whitened (N,), made once it is asked for: what the model leaves on a simulation of itself, the work of
    filters and sampling."""
    placed: dict[object, tuple[object, PlacedEffect, FloatArray | None]] = field(
        default_factory=dict, repr=False, compare=False
    )
    """Effects that were asked for last, with their columns (N, p) beyond the model: those of ``solve``."""

    simulated: ClassVar[bool] = False
    """Whether columns are those of a simulated loop."""

    @cached_property
    def residual(self) -> FloatArray:
        """Whitened (N,), what the present model leaves; unit variance where only noise is left."""
        left = self.torque - self.regressor @ self.beta
        of_itself = None if self.self_simulated is None else self.self_simulated()
        return np.asarray(left if of_itself is None else left - of_itself)

    @property
    def data_rows(self) -> int:
        """How many of the rows are data; those of the prior follow."""
        held = 0 if self.prior is None else int(np.isfinite(np.diag(self.prior.covariance)).sum())
        return int(self.torque.shape[0]) - held

    def whiten(self, thin: Sequence[FloatArray]) -> FloatArray:
        """Decimated columns per piece (rows × joints × p) as whitened rows (N, p), zero on the prior's."""
        white = self.whitening.apply(np.concatenate(thin), self.segment, self.used)
        return np.concatenate([white, np.zeros((self.torque.shape[0] - white.shape[0], white.shape[1]))])

    def columns_of(self, effect: PlacedEffect) -> FloatArray | None:
        """Whitened columns (N, p) of an effect; None where it cannot be simulated."""
        return self.whiten([piece.columns_of(effect) for piece in self.prepared])

    def measured_columns_of(self, effects: Sequence[PlacedEffect]) -> FloatArray | None:
        """The same (N, all p) at the measured motion; None where that is its own instrument."""
        if all(piece.period is None for piece in self.prepared):
            return None
        columns = [[piece.columns_of(one, measured=True) for piece in self.prepared] for one in effects]
        return np.concatenate([self.whiten(thin) for thin in columns], axis=1)

    @property
    def shown(self) -> FloatArray:
        """Base parameters (b,) that the gap is shown with.

        Against a prior these are the prior's own, with free what the prior leaves free and what was found;
        otherwise the fitted ones.

        Raises:
            ArithmeticError: two that are free have a column in common, so neither has a size.
        """
        if self.prior is None:
            return self.beta
        held = np.isfinite(np.diag(self.prior.covariance))
        rows = self.data_rows
        x, y, z = self.regressor[:rows], self.torque[:rows], self.instruments[:rows]
        beta = np.where(held, self.prior.values, 0.0)
        free = ~held
        scale = np.linalg.norm(x[:, free], axis=0)
        cross = (z[:, free] / scale).T @ (x[:, free] / scale)
        try:
            beta[free] = np.linalg.solve(cross, (z[:, free] / scale).T @ (y - x @ beta)) / scale
        except np.linalg.LinAlgError:
            raise ArithmeticError("effects of the model have a column in common") from None
        return beta

    def partial_out(self, columns: FloatArray) -> FloatArray:
        """What of columns (N, p) the present model cannot explain (Frisch, Waugh, Lovell)."""
        q, back = self._projector
        return np.asarray(columns - q @ (back @ columns))

    def taken_up(self, columns: FloatArray) -> FloatArray:
        """(b, p) parameters of the present model that take up columns (N, p), fitted with its instruments."""
        q = self._projector[0]
        return np.asarray(np.linalg.lstsq(q.T @ self.regressor, q.T @ columns, rcond=DEPENDENT)[0])

    @cached_property
    def of_noise(self) -> Whitening:
        """By what does not repeat beside this very model; that of :attr:`whitening` where nothing repeats.

        What one model takes for noise another explains where it does not repeat: a brake that rubs now and
        then, the warmth of a drive.
        """
        return self.by(self.noise) if self.repeats else self.whitening

    def by(self, noise: FloatArray) -> Whitening:
        """Of noise that was told from repeats, rows × joints."""
        return autoregressive_whitening(noise, self.segment, self.used, 0)

    def left_of(self, columns: FloatArray) -> FloatArray:
        """What the present model, fitted with its instruments, leaves of columns (N, p)."""
        return np.asarray(columns - self.regressor @ self.taken_up(columns))

    @cached_property
    def covariance(self) -> FloatArray:
        """Of β̂ (b, b), rows being white up to what is left; an IdentificationError where none can be had."""
        left = float(self.residual @ self.residual / max(1, self.residual.size - self.beta.size))
        scale = np.linalg.norm(self.instruments, axis=0)
        inverse = -np.eye(scale.size)
        if scale.all():  # a drive that saturates has no rows in the simulated loop
            z = self.instruments / scale
            with suppress(np.linalg.LinAlgError):
                inverse = np.linalg.inv(z.T @ z)
        if not (np.diag(inverse) > 0.0).all():
            raise IdentificationError(
                "rows that are fitted do not determine every parameter; allowed: longer recordings, --prior"
            )
        return np.asarray(max(1.0, left) * inverse / np.outer(scale, scale))

    @cached_property
    def _projector(self) -> tuple[FloatArray, FloatArray]:
        q, _ = np.linalg.qr(self.instruments)
        # Not solve: an effect that was added may be all but dependent on what was there.
        return q, np.linalg.pinv(self.regressor.T @ q, rcond=DEPENDENT) @ self.regressor.T


def examine(
    base: BaseParameters,
    prepared: Sequence[PreparedRecording],
    prior: Prior | None = None,
    whitening: Whitening | None = None,
    only: tuple[BoolArray, ...] | None = None,
) -> Examination:
    """Fit the present model to recordings and whiten what it leaves.

    Args:
        base: the model.
        prepared: one or more recordings.
        prior: what is known of its parameters.
        whitening: of the noise, where it is known already (the noise does not change with the model).
        only: rows × joints per piece that count, in place of those where the joints move.

    Raises:
        IdentificationError: no recording, or rows that do not determine the parameters.
    """
    if not prepared:
        raise IdentificationError("no recording to examine")
    used = np.concatenate([piece.moving for piece in prepared] if only is None else only)
    segment = np.repeat(np.arange(len(prepared)), [piece.rows for piece in prepared])
    torque = np.concatenate([piece.torque for piece in prepared])
    regressor, instruments = regressors(prepared, base)
    beta = _first_fit(torque, regressor, used, segment, prior)
    noise, repeats = noise_of(prepared, base, beta)
    if whitening is None:
        if repeats:
            whitening = autoregressive_whitening(noise, segment, used, 0)
        else:
            whitening = cautious_whitening(noise, used, base.independent.size)
    apply, rows = whitening.apply, (torque[:, :, np.newaxis], regressor, instruments)
    white = at_once(lambda values: apply(values, segment, used), rows)
    y, x, z = with_prior(white[0][:, 0], white[1], white[2], prior)
    scale = np.linalg.norm(x, axis=0)
    cross = (z / scale).T @ (x / scale)
    beta = np.linalg.lstsq(cross, (z / scale).T @ y, rcond=DEPENDENT)[0] / scale
    return Examination(base, tuple(prepared), whitening, used, segment, y, x, z, beta, noise, repeats, prior)


def _first_fit(
    torque: FloatArray, regressor: FloatArray, used: BoolArray, segment: IntArray, prior: Prior | None
) -> FloatArray:
    """Weighted least squares, good enough to see the noise beside it."""
    weights = block_whitening(torque, used, 0)
    for _ in range(2):
        y = weights.apply(torque[:, :, np.newaxis], segment, used)[:, 0]
        x = weights.apply(regressor, segment, used)
        y, x, _ = with_prior(y, x, x, prior)
        scale = np.linalg.norm(x, axis=0)
        if not scale.all():
            raise IdentificationError("the motion does not excite every parameter of the model")
        beta = np.linalg.lstsq(x / scale, y, rcond=None)[0] / scale
        weights = block_whitening(torque - regressor @ beta, used, regressor.shape[2])
    return np.asarray(beta)


def with_prior(
    y: FloatArray, x: FloatArray, z: FloatArray, prior: Prior | None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    if prior is None:
        return y, x, z
    rows, target = prior.rows()
    return np.concatenate([y, target]), np.concatenate([x, rows]), np.concatenate([z, rows])


def noise_of(
    prepared: Sequence[PreparedRecording], base: BaseParameters, beta: FloatArray
) -> tuple[FloatArray, bool]:
    """Rows × joints of torque noise, N·m, and whether it was told from repeats of the trajectory."""
    repeats = all(piece.period is not None for piece in prepared)
    if not repeats:
        return np.concatenate([piece.residual(base, beta) for piece in prepared]), False
    return np.concatenate([piece.noise_of(torque_residual(base, beta, piece)) for piece in prepared]), True
