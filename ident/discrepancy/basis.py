"""What an effect was settled for on: scores or probabilities, and what else it could be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ident.discrepancy.decision import Choice
from ident.discrepancy.library import Trial
from ident.discrepancy.results import Candidate, Possible
from ident.discrepancy.scoring import Score

_RANKED = 12
"""Candidates that a ranking lists."""


@dataclass(frozen=True)
class Basis:
    """Of one effect, as the search that found it says.

    Attributes:
        p_value: that an arm that lacks nothing here shows this.
        score, threshold: of the search, and what a score has to exceed.
        indistinguishable_from: what these recordings cannot tell from it.
        ranking: candidates for its place in the model, best first.
        probability: of the name at its place; None where the search gives none.
        held: what is possible there, the likeliest first, as far as it takes for 95 %.
        unsure: what of its sizes the search itself does not tell from nothing, in words, empty where it tells
            all; None where it has no sizes of its own.
        doubt: why the search itself does not take it for confirmed, in words; empty where it does.
    """

    p_value: float
    score: float
    threshold: float
    indistinguishable_from: tuple[Candidate, ...]
    ranking: tuple[Candidate, ...]
    probability: float | None = None
    unsure: str | None = None
    doubt: str = ""
    held: tuple[Possible, ...] = ()

    @classmethod
    def of(cls, choice: Choice, position: int) -> Basis:
        """Of one of the effects that were chosen together.

        Args:
            choice: of the step that chose them.
            position: which of them.
        """
        assert choice.chosen is not None
        return cls(
            choice.p_value,
            choice.chosen.value,
            choice.threshold,
            alternatives(choice.chosen, choice.indistinguishable, position, choice.excess),
            ranking_of(choice),
        )


def ranking_of(choice: Choice) -> tuple[Candidate, ...]:
    """The best candidates of one step of the search."""
    return tuple(candidate_of(score, choice.excess) for score in choice.ranking[:_RANKED])


def alternatives(
    chosen: Score, rivals: Sequence[Score], position: int, excess: float
) -> tuple[Candidate, ...]:
    """What one effect of the chosen ones cannot be told from.

    An effect that stands in a rival set, too, is not in doubt there: only what the two sets differ in is.

    Args:
        chosen: the effects that were chosen together.
        rivals: sets that the data cannot tell from them, best first.
        position: of the effect among the chosen ones.
        excess: residual sum of squares beyond noise.
    """
    own, kept = chosen.trials[position].key, {trial.key for trial in chosen.trials}
    found: dict[str, Candidate] = {}
    for rival in rivals:
        if own in {trial.key for trial in rival.trials}:
            continue
        others = tuple(trial for trial in rival.trials if trial.key not in kept)
        candidate = candidate_of(rival, excess, others)
        found.setdefault(candidate.words(), candidate)
    return tuple(found.values())


def candidate_of(score: Score, excess: float, shown: Sequence[Trial] | None = None) -> Candidate:
    """An entry of a ranking, from 1; of the trials that are shown, where not all are."""
    trials = score.trials if shown is None else shown
    return Candidate(
        tuple(trial.family.name for trial in trials),
        tuple(tuple(joint + 1 for joint in trial.place.joints) for trial in trials),
        score.value,
        score.gain / excess if excess > 0 else 0.0,
        tuple(trial.effect for trial in trials),
    )
