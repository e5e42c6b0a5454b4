"""What is asked of the search, and who is told how far it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ident.discrepancy.loop import Standstill
from ident.discrepancy.prior import Prior
from ident.effects.family import EffectFamily
from ident.parameters.base import BaseParameters
from ident.parameters.regressor import RegressorModel
from ident.recording import Recording
from robots.description import Robot

Progress = Callable[[str, float], None]
"""Called with a step in words and the share of the whole that is done, 0 to 1."""


def silent(step: str, share: float) -> None:
    """Nobody watches."""


@dataclass(frozen=True)
class Question:
    """What is asked of the search.

    Attributes:
        robot: the arm.
        fit: recordings that names and parameters are taken from.
        validation: recordings that the gap is shown on, never fitted.
        families: the vocabulary to choose from.
        prior: a function that gives the prior of a base set; None to search after a refit.
        model: the model that is examined; the arm's usual one where None.
        at_reversals: look at reversals and standstills, too, where the loop can be simulated.
        standstill: how each drive's dry friction turns its sign there; None where nobody knows.
    """

    robot: Robot
    fit: tuple[Recording, ...]
    validation: tuple[Recording, ...]
    families: tuple[EffectFamily, ...]
    prior: Callable[[BaseParameters], Prior] | None = None
    model: RegressorModel | None = None
    at_reversals: bool = True
    standstill: Standstill | None = None
