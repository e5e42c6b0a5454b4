"""The present model with one more effect."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ident.base import BaseParameters
from ident.discrepancy.prior import Prior
from ident.effects.family import PlacedEffect
from ident.regressor import RegressorModel


def extended(base: BaseParameters, effects: Sequence[PlacedEffect]) -> BaseParameters:
    """Base parameters of the model with effects added; each of theirs is a base parameter of its own.

    A payload or a drive gain lies in the span of the links' columns. It is kept all the same, because a
    prior can tell it from them; without a prior the search does not ask for such effects.
    """
    old = base.model
    model = RegressorModel(old.robot, (*old.effects, *effects))
    p, b, more = len(old.names), base.independent.size, len(model.names) - len(old.names)
    relation = np.zeros((b + more, p + more))
    relation[:b, :p] = base.relation
    relation[b:, p:] = np.eye(more)
    return BaseParameters(model, np.concatenate([base.independent, np.arange(p, p + more)]), relation)


def extended_prior(prior: Prior | None, more: int) -> Prior | None:
    """The same knowledge of a model with so many more parameters, which are free."""
    if prior is None or more == 0:
        return prior
    b = prior.values.size
    covariance = np.zeros((b + more, b + more))
    covariance[:b, :b] = prior.covariance
    covariance[np.arange(b, b + more), np.arange(b, b + more)] = np.inf
    return Prior(np.concatenate([prior.values, np.zeros(more)]), covariance, prior.source)
