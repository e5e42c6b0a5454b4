"""One log with what is known to be missing in its model: what the search is asked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ident import BaseParameters, Recording, RegressorModel
from ident.discrepancy import Prior, Question
from ident.discrepancy.by_evidence import prior_by_evidence
from ident.effects.vocabulary import VOCABULARY
from robots import Robot

Truth = tuple[tuple[str, tuple[int, ...]], ...]
"""Names with joints from 1; none for the whole arm."""

UNKNOWN = "outside the vocabulary"
"""In place of a name that the vocabulary does not have."""


@dataclass(frozen=True)
class Case:
    """A question with its answer.

    Attributes:
        name: of the log.
        kind: "foreign" or "real".
        robot: as described.
        fit, validation: recordings.
        truth: what is missing; None where nobody knows all of it.
        accepted: a clean recording of the same arm that the prior is made of.
        prior: another one; without any the search is after a refit.
        without: effects that the examined model is without.
    """

    name: str
    kind: str
    robot: Robot
    fit: Recording
    validation: Recording
    truth: Truth | None
    accepted: Recording | None = None
    without: tuple[str, ...] = ()
    prior: Callable[[BaseParameters], Prior] | None = None

    def question(self) -> Question:
        """What the search is asked."""
        usual = RegressorModel.of(self.robot)
        left = tuple(effect for effect in usual.effects if effect.name not in self.without)
        model = RegressorModel(self.robot, left)
        prior = self.prior if self.accepted is None else self._accepted
        return Question(self.robot, (self.fit,), (self.validation,), VOCABULARY, prior, model)

    def _accepted(self, base: BaseParameters) -> Prior:
        assert self.accepted is not None
        return prior_by_evidence(base, (self.accepted,))
