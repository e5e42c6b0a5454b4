"""Effects that score, as a ranking lists them, and what else a chosen one could be."""

from __future__ import annotations

from collections.abc import Sequence

from ident.discrepancy.library import Trial
from ident.discrepancy.results import Candidate
from ident.discrepancy.scoring import Score


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
