"""What an effect was settled for on: its odds, and what else it could be."""

from __future__ import annotations

from dataclasses import dataclass

from ident.discrepancy.results import Candidate, Possible


@dataclass(frozen=True)
class Basis:
    """Of one effect, as the search that found it says.

    Attributes:
        p_value: that nothing is missing in its place.
        score, threshold: log odds against nothing, and those that are enough for a name.
        probability: of the name at its place.
        indistinguishable_from: what these recordings cannot tell from it.
        ranking: candidates for its place in the model, best first.
        held: what is possible there, the likeliest first, as far as it takes for 95 %.
        unsure: what of its sizes the search itself does not tell from nothing, in words, empty where it tells
            all; None where it has no sizes of its own.
        doubt: why the search itself does not take it for confirmed, in words; empty where it does.
    """

    p_value: float
    score: float
    threshold: float
    probability: float
    indistinguishable_from: tuple[Candidate, ...]
    ranking: tuple[Candidate, ...]
    unsure: str | None = None
    doubt: str = ""
    held: tuple[Possible, ...] = ()
