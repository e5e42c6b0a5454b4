"""Regressors as a search wants them: columns of the states of a motion."""

from __future__ import annotations

from dataclasses import dataclass

from ident.effects import State
from ident.parameters.base import BaseParameters
from robots.arrays import FloatArray
from trajectories.motions.motion import MotionState


@dataclass(frozen=True)
class BaseRegressor:
    """The base regressor of an arm's model."""

    base: BaseParameters

    def __call__(self, state: MotionState) -> FloatArray:
        """samples × joints × b."""
        return self.base.columns(State(state.position, state.velocity, state.acceleration, state.time))
