"""The present model with one more effect."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.discrepancy.prior import Prior
from ident.effects.family import PlacedEffect
from ident.parameters.base import BaseParameters
from robots.arrays import BoolArray


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
