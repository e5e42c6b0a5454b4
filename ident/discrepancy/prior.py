"""What was known of the arm before: what a payload, a wrong gain or a new spring has to contradict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.effects.family import PlacedEffect
from ident.parameters.base import BaseParameters
from robots.arrays import BoolArray, FloatArray

_FRICTION = ("Fv", "Fc", "Fvp", "Fcp", "Fvn", "Fcn", "Fvm", "Fcm")


@dataclass(frozen=True)
class Prior:
    """Base parameters (b,) with their covariance (b, b), from CAD or from an accepted model.

    An infinite variance leaves a parameter free.
    """

    values: FloatArray
    covariance: FloatArray
    source: str
    noise: FloatArray | None = None
    """(n,) rms torque noise of the recording that the model was accepted on, N·m (or N), where known."""
    misfit: FloatArray | None = None
    """(n,) rms misfit κ of that recording, N·m (or N), where known; the search by evidence starts from it."""

    def rows(self) -> tuple[FloatArray, FloatArray]:
        """Rows R β = t of unit variance that say the same: R (k, b) and t (k,), k the parameters held."""
        held = np.isfinite(np.diag(self.covariance))
        part = self.covariance[np.ix_(held, held)]
        root = np.linalg.inv(np.linalg.cholesky(part))
        rows = np.zeros((int(held.sum()), self.values.size))
        rows[:, held] = root
        return rows, np.asarray(rows @ np.where(held, self.values, 0.0))


def described_prior(base: BaseParameters, relative_spread: float = 0.1) -> Prior:
    """The description as prior: inertias of URDF and rotors, each known to so much of itself."""
    standard = base.model.prior()
    small = np.array([_smallest_spread(base, column) for column in range(standard.size)])
    spread = np.maximum(relative_spread * np.abs(standard), small)
    covariance = (base.relation * spread**2) @ base.relation.T
    return Prior(base.regroup(standard), _with_free_friction(base, covariance), "description")


def _smallest_spread(base: BaseParameters, column: int) -> float:
    """A zero in CAD is known no better than a hundredth of what the largest parameter of its unit is."""
    parameters, standard = base.model.parameters, np.abs(base.model.prior())
    unit = parameters[column].unit
    same = [value for value, other in zip(standard, parameters, strict=True) if other.unit == unit]
    return 0.01 * max(same) or 1.0


def _is_friction(base: BaseParameters) -> BoolArray:
    """(b,) which base parameters are friction."""
    return np.array([parameter.is_usual(_FRICTION) for parameter in base.leading])


def _with_free_friction(base: BaseParameters, covariance: FloatArray) -> FloatArray:
    free, friction = covariance.copy(), _is_friction(base)
    free[friction, :] = free[:, friction] = 0.0
    free[friction, friction] = np.inf
    return free


def extended(
    base: BaseParameters, effects: Sequence[PlacedEffect], seen: Sequence[BoolArray]
) -> BaseParameters:
    """Base parameters of the model with effects added; each of theirs is a base parameter of its own.

    A payload or a drive gain lies in the span of the links' columns. It is kept all the same, because a
    prior can tell it from them; without a prior the search does not ask for such effects.

    Args:
        base: the model without them.
        effects: what is added.
        seen: per effect, which of its parameters the data show; the others stay zero.
    """
    return base.with_effects(effects, np.concatenate(list(seen)))


def extended_prior(prior: Prior | None, more: int) -> Prior | None:
    """The same knowledge of a model with so many more parameters, which are free."""
    if prior is None or more == 0:
        return prior
    b = prior.values.size
    covariance = np.zeros((b + more, b + more))
    covariance[:b, :b] = prior.covariance
    covariance[np.arange(b, b + more), np.arange(b, b + more)] = np.inf
    return Prior(np.concatenate([prior.values, np.zeros(more)]), covariance, prior.source, prior.noise)
