"""The links of the physically consistent model in the report."""

from __future__ import annotations

from dataclasses import dataclass

from daq.text.numbers import significant
from daq.text.verdict_words import words_of
from ident.results import Consistency


@dataclass(frozen=True)
class LinkRow:
    """One link; ``remark`` says whether it is at the edge of what a body can be, and what it was before."""

    name: str
    mass: str
    center: tuple[str, ...]
    margin: str
    remark: str


@dataclass(frozen=True)
class ConsistencyView:
    """How far the nearest arm that can exist is, in a sentence, and its links."""

    sentence: str
    links: tuple[LinkRow, ...]


def consistency_view(consistency: Consistency | None) -> ConsistencyView | None:
    """Texts and figures; None where no consistent fit was asked for."""
    if consistency is None:
        return None
    rows = []
    for link in consistency.links:
        remarks = ["no body before"] if link.impossible_before else []
        remarks += ["at the limit"] if link.at_limit else []
        center = tuple(significant(float(x)) for x in link.center)
        rows.append(
            LinkRow(
                link.name, significant(link.mass), center, significant(link.margin, 2), ", ".join(remarks)
            )
        )
    sentence = (
        f"The arm of rigid bodies nearest to the estimate by {words_of(consistency.nearest_to)}:"
        f" {consistency.sentence}."
    )
    return ConsistencyView(sentence, tuple(rows))
