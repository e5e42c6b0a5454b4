"""Which members of a set other motion bears out: of all its parts the likeliest on both motions.

A set is fitted as a whole. What one member makes of the misfit of another, or of noise, is right on the rows
that were fitted and nowhere else, and it stands beside the right name on other motion, too: as long as it is
in the set, that one is judged beside it. Two of them can hold each other up (a delay and a soft gear, with
opposite signs), so it is not asked of each alone, but of every part of the set.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

from ident.discrepancy.by_evidence.confirm.held_out import HeldOut
from ident.discrepancy.by_evidence.decide.as_one import part_of
from ident.discrepancy.by_evidence.decide.search import Search, Searched
from ident.discrepancy.by_evidence.decide.state import TEMPERATURE, Found, Member, stands
from ident.effects.entry import joint_words


@dataclass(frozen=True, eq=False)
class Refuted:
    """A member that other motion speaks against more clearly than the rows that were fitted speak for it.

    Attributes:
        member: as it was fitted.
        nats: by which other motion is predicted better without it, beside what stays.
    """

    member: Member
    nats: float

    def words(self) -> str:
        """As a sentence."""
        place = self.member.entry.placed.place
        name = self.member.entry.placed.name.replace("_", " ")
        return (
            f"{name} ({joint_words(tuple(joint + 1 for joint in place.joints))}) would explain rows that were"
            f" fitted; recordings that were not are predicted better without it, by {self.nats:.0f} nats"
        )


def borne_out(search: Search, searched: Searched, held: HeldOut) -> tuple[Searched, tuple[Refuted, ...]]:
    """A set without the members that other motion refutes, fitted again, and these.

    A part's log evidence on both is that of the rows that were fitted and that of the others, as it predicts
    them. The member that the fitted rows speak for most clearly is in each of them: where other motion does
    not bear it out, it is shown and not confirmed, and what is less likely has no better right to its place.

    Args:
        search: that found it.
        searched: where it ended.
        held: recordings that nothing was fitted to.
    """
    found = searched.found
    if len(found.members) < 2:
        return searched, ()
    excess, numbers = found.level.excess, range(len(found.members))
    first = min(numbers, key=lambda number: search.without(found, number).log_posterior)
    with_first = (kept for kept in _parts(len(found.members)) if first in kept)
    parts = {kept: _part(search, found, kept) for kept in with_first if _can_be(search, found, kept)}
    scores = {kept: held.score(part, excess) for kept, part in parts.items()}
    best = max(parts, key=lambda kept: parts[kept].log_posterior + TEMPERATURE * scores[kept])
    if len(best) == len(found.members):
        return searched, ()
    refuted = tuple(
        Refuted(member, scores[best] - held.score(_part(search, found, (*best, number)), excess))
        for number, member in enumerate(found.members)
        if number not in best
    )
    fitted, present = search.settled(parts[best])
    return replace(searched, found=fitted, present=present), refuted


def _parts(count: int) -> list[tuple[int, ...]]:
    """Every part of a set of so many, the whole among them."""
    return [kept for size in range(1, count + 1) for kept in combinations(range(count), size)]


def _can_be(search: Search, found: Found, kept: tuple[int, ...]) -> bool:
    """Whether each member of a part has what it is on top of."""
    members = [found.members[number] for number in kept]
    return all(stands(search.problem, one.entry, members) for one in members)


def _part(search: Search, found: Found, kept: tuple[int, ...]) -> Found:
    """Some members of a set, in their order, fitted without the others; κ of the others' joints is, too."""
    members = [found.members[number] for number in sorted(kept)]
    if len(members) == len(found.members):
        return found
    return part_of(search.problem, found, members)
