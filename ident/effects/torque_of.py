"""Torque of an effect for given values of its parameters, without columns where it can do without.

Columns of terms that act on one joint each are zeros but for one in n: of six joints they take five times as
long to be made as all that is asked of them here.
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np

from ident.effects.family import Effect
from ident.effects.state import State
from robots.arrays import FloatArray


@runtime_checkable
class HasTorque(Protocol):
    """An effect that makes its torque without its columns."""

    def torque(self, state: State, values: FloatArray) -> FloatArray: ...


def torque_of(effect: Effect, state: State, values: FloatArray) -> FloatArray:
    """Joint torque of an effect, samples × joints, N·m (or N).

    Args:
        effect: of a model.
        state: the motion.
        values: (p,) of its parameters.
    """
    if isinstance(effect, HasTorque):
        return effect.torque(state, values)
    return np.asarray(np.tensordot(effect.columns(state), values, axes=1))
