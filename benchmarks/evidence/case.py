"""One log with what is known to be missing in its model: what both searches are asked."""

from __future__ import annotations

from dataclasses import dataclass

from ident import BaseParameters, Recording, RegressorModel, identify
from ident.discrepancy import Prior, Question, accepted_noise, accepted_prior
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
        accepted: a clean recording of the same arm that the prior is made of; None to search after a refit.
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

    def question(self, search: str) -> Question:
        """What a search is asked; the prior as that search makes it."""
        usual = RegressorModel.of(self.robot)
        left = tuple(effect for effect in usual.effects if effect.name not in self.without)
        model = RegressorModel(self.robot, left)
        prior = None
        if self.accepted is not None:
            prior = self._by_evidence if search == "evidence" else self._by_rules
        return Question(self.robot, (self.fit,), (self.validation,), VOCABULARY, prior, model)

    def _by_evidence(self, base: BaseParameters) -> Prior:
        assert self.accepted is not None
        return prior_by_evidence(base, (self.accepted,))

    def _by_rules(self, base: BaseParameters) -> Prior:
        assert self.accepted is not None
        estimate = identify(self.robot, (self.accepted,)).result.recommended
        noise = accepted_noise(base, (self.accepted,))
        return accepted_prior(base, estimate.values, estimate.covariance, noise=noise)
