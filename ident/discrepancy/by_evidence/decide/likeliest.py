"""A set in which every name is the likeliest of its place by both motions, not by the fitted rows alone."""

from __future__ import annotations

import logging
from dataclasses import replace

from ident.discrepancy.by_evidence.decide.names import OtherMotion, slot, with_name
from ident.discrepancy.by_evidence.decide.screening import screen
from ident.discrepancy.by_evidence.decide.search import Search, Searched, key_of

_log = logging.getLogger(__name__)


def likeliest(search: Search, searched: Searched, held: OtherMotion) -> Searched:
    """A set with the likeliest name in each place, fitted again.

    The search goes by the rows that were fitted. Two names that are even there can be far apart on other
    motion, and what the search ended with was shown, with no probability left to it: a dead zone of a drive
    where all of it was Coulomb friction's.

    Args:
        search: that found it.
        searched: where it ended.
        held: recordings that were not fitted.
    """
    asked = set()
    while key_of(searched.found) not in asked:
        asked.add(key_of(searched.found))
        places = range(len(searched.found.members))
        others = (_likelier(search, searched, held, number) for number in places)
        searched = next((one for one in others if one is not None), searched)
    return searched


def _likelier(search: Search, searched: Searched, held: OtherMotion, number: int) -> Searched | None:
    """With a likelier name in one place; None where the likeliest stands there."""
    found = searched.found
    without = search.without(found, number)
    first = slot(search, searched, number, without, held).names[0]
    if first.placed is None or first.key == found.members[number].candidate.key:
        return None
    entries = screen(search.problem, without, searched.entries)
    _log.info("%s at %s is likelier by both motions than %s", *first.key, found.members[number].candidate.key)
    fitted, present = search.settled(with_name(search, without, entries, first.key))
    return replace(searched, found=fitted, present=present)
