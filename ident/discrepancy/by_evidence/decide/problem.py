"""The data, the model under examination, and what is known of both: what every step of the search reads."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ident.discrepancy.by_evidence.decide.possible import UsualFriction
from ident.discrepancy.by_evidence.evidence.gram import Gram, Level
from ident.discrepancy.by_evidence.evidence.kappa import Misfit, fitted
from ident.discrepancy.by_evidence.evidence.known import Beta, known_columns
from ident.discrepancy.by_evidence.evidence.misfit import joined, misfit_columns
from ident.discrepancy.by_evidence.evidence.noise import Noise
from ident.discrepancy.by_evidence.evidence.prepared import Prepared
from ident.discrepancy.by_evidence.evidence.residual import first_noise, noise_beside
from ident.discrepancy.by_evidence.evidence.rows import Rows
from ident.discrepancy.by_evidence.evidence.solved import Posterior
from ident.discrepancy.prior import Prior
from ident.effects.usual import friction_sign
from ident.effects.wrist_coupling import coupled_drives
from ident.parameters.base import BaseParameters
from ident.parameters.present import Present
from robots.arrays import FloatArray

_OF_NOISE = 0.5
"""Misfit of an arm of which no accepted run is known, in deviations of its noise."""

_ROUNDS = 3
"""Noise and misfit are estimated in turn: the one without the other takes all for itself."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A model against recordings, before any effect is added.

    Attributes:
        base: parameters β.
        prior: of β; None after a refit.
        start: β (b,) that flat parameters are counted from.
        present: the model as effects ask it for torques.
        rows: white rows.
        beta: how β is made of the known factors.
        misfit: prior of κ.
        level: of the misfit beside the model without any effect.
        score: its log evidence with the prior of κ.
        posterior: of the same.
    """

    base: BaseParameters
    prior: Prior | None
    start: FloatArray
    present: Present
    rows: Rows
    beta: Beta
    misfit: Misfit
    level: Level
    score: float
    posterior: Posterior

    @property
    def prepared(self) -> Prepared:
        return self.rows.prepared

    @cached_property
    def friction(self) -> UsualFriction:
        """Of the drives, that no set may bring below nothing."""
        return UsualFriction.of(self.base, self.beta)

    @cached_property
    def uncoupled(self) -> frozenset[int]:
        """Drives (from 0) that move several joints, of which the model has friction along one alone."""
        coupled = coupled_drives(self.base.model.robot)
        return frozenset(drive for drive in coupled if not self.present.has(("Fvm", "Fcm"), drive))


def pose(
    base: BaseParameters, prior: Prior | None, prepared: Prepared, accepted: FloatArray | None
) -> Problem:
    """Fit β, noise and κ of the model without any effect.

    Args:
        base: the model's parameters.
        prior: of them; None after a refit.
        prepared: recordings to fit.
        accepted: (n,) κ of an accepted run, N·m (or N); the noise's deviation where None.
    """
    values = first_values(base, prior, prepared)
    present = Present(base.model, base.standard_from(values, base.model.prior()))
    known, beta = known_columns(prepared, base, prior, values, present)
    basis = misfit_basis(prepared, present)
    noise = first_noise(prepared, known, basis)
    kappa = usual_misfit(noise) if accepted is None else accepted
    level = Level(kappa, np.ones_like(kappa))
    for _ in range(_ROUNDS):
        rows = Rows(prepared, known, basis, noise)
        misfit, (score, level, posterior) = level_beside(rows, accepted, level)
        noise = noise_beside(rows, level, posterior)
    return Problem(base, prior, values, present, rows, beta, misfit, level, score, posterior)


def level_beside(
    rows: Rows, accepted: FloatArray | None, level: Level | None = None
) -> tuple[Misfit, tuple[float, Level, Posterior]]:
    """Prior of the misfit, and its level beside the model without any effect with score and posterior.

    Args:
        rows: the data.
        accepted: (n,) κ of an accepted run, N·m (or N); half the noise's deviation where None.
        level: to begin with.
    """
    kappa = usual_misfit(rows.noise) if accepted is None else accepted
    misfit = Misfit(kappa, root_mean_square(rows.prepared), accepted is not None)
    level = level or Level(kappa, np.ones_like(kappa))
    return misfit, fitted(Gram(rows, ()), level, range(rows.n), misfit)


def usual_misfit(noise: tuple[Noise, ...]) -> FloatArray:
    """(n,) κ of an arm of which no accepted run is known: half its noise, N·m (or N)."""
    return np.array([_OF_NOISE * one.marginal for one in noise])


def root_mean_square(prepared: Prepared, torque: FloatArray | None = None) -> FloatArray:
    """(n,) of a torque over the rows used, rows × joints; of the measured one where none is given."""
    used = prepared.used
    squares = np.sum(np.where(used, prepared.torque if torque is None else torque, 0.0) ** 2, axis=0)
    return np.asarray(np.sqrt(squares / np.maximum(used.sum(axis=0), 1)))


def first_values(base: BaseParameters, prior: Prior | None, prepared: Prepared) -> FloatArray:
    """β (b,): that of the prior, and least squares for what it leaves open."""
    regressor = np.concatenate([base.columns(part.own) for part in prepared.parts])
    used, torque = prepared.used, prepared.torque
    held = np.zeros(base.independent.size, dtype=np.bool_)
    values = np.zeros(base.independent.size)
    if prior is not None:
        held = np.isfinite(np.diag(prior.covariance))
        values = np.where(held, prior.values, 0.0)
    if held.all():
        return values
    deviation = torque.std(axis=0)
    for _ in range(2):
        rest = (torque - regressor @ np.where(held, values, 0.0)) / deviation
        columns = (regressor / deviation[:, np.newaxis])[used][:, ~held]
        scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
        values[~held] = np.linalg.lstsq(columns / scale, rest[used], rcond=1e-8)[0] / scale
        left = torque - regressor @ values
        spread = np.array([float(np.std(left[rows, j])) for j, rows in enumerate(used.T) if rows.any()])
        deviation[used.any(axis=0)] = np.maximum(spread, 1e-9)
    return values


def misfit_basis(prepared: Prepared, present: Present) -> tuple[FloatArray, ...]:
    """Φ of each joint, at the motion that effects are evaluated at."""
    robot, used = prepared.robot, prepared.used
    state = joined([part.at_rows for part in prepared.parts])
    load = present.link_torque(state)
    sign = friction_sign(robot)
    return tuple(misfit_columns(j, state, load[:, j], used[:, j], sign) for j in range(robot.n))
