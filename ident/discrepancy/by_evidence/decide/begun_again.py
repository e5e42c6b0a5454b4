"""Where a joint is left with more than usual: sets that begin there with another effect.

The search takes what is likeliest alone and goes on beside that. Of two effects of one joint it may be
neither: of a contact and a friction that differs by direction the corner of the contact was elsewhere without
the friction, and beside that corner no friction was likely, by 73 nats of the pair. Each of the names that
come next alone is asked what is likeliest beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from ident.discrepancy.by_evidence.decide.as_one import part_of
from ident.discrepancy.by_evidence.decide.left_over import ABOVE, smooth_above_accepted
from ident.discrepancy.by_evidence.decide.present_with import present_with
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.scanned import scanned
from ident.discrepancy.by_evidence.decide.screening import Screened, screen
from ident.discrepancy.by_evidence.decide.state import Found, has_room
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry

_FIRST = 8
"""Candidates that a set begins with at a joint, in their best forms."""

_NEXT = 4
"""Candidates that are fitted beside each."""


class Search(Protocol):
    """What sets are fitted by (:mod:`.search`)."""

    problem: Problem
    wanted: Sequence[Candidate]

    def replaced(self, without: Found, others: Sequence[Screened]) -> list[Found]:
        """Sets with each candidate beside one, κ and shapes fitted."""


def begun_again(search: Search, found: Found, entries: Sequence[Entry], most: int) -> list[Found]:
    """Sets with two other effects at a joint that is left with more than usual.

    Args:
        search: that found nothing likelier in its own way.
        found: where it is.
        entries: the vocabulary beside that.
        most: effects of a set.
    """
    joints = np.flatnonzero(smooth_above_accepted(search.problem, found) > ABOVE)
    return [one for joint in joints for one in _begun_at(search, found, entries, int(joint), most)]


def _begun_at(search: Search, found: Found, entries: Sequence[Entry], joint: int, most: int) -> list[Found]:
    others = [one for one in found.members if joint not in one.candidate.place.joints]
    if len(others) + 2 > most:
        return []
    rest = part_of(search.problem, found, others)
    first = search.replaced(rest, _beside(search, rest, entries, joint)[:_FIRST])
    pairs = (search.replaced(one, _beside(search, one, entries, joint)[:_NEXT]) for one in first)
    return [one for sets in pairs for one in sets]


def _beside(search: Search, found: Found, entries: Sequence[Entry], joint: int) -> list[Screened]:
    """Candidates of a joint beside a set, the likeliest first."""
    wanted = [one for one in search.wanted if joint in one.place.joints]
    present = present_with(search.problem, found)
    peaks = scanned(search.problem.rows, found, wanted, present)
    present.forget()
    own = [one for one in entries if joint in one.candidate.place.joints]
    screened = screen(search.problem, found, (*own, *peaks))
    return [one for one in screened if has_room(found.members, one.best)]
