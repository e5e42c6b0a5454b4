"""Sets whose members change each other's columns: links that give way at several places swing as one.

What a place makes of the ways of the others is in its columns, as it was when these were made. Where several
have changed since, it is there twice: a set that fitted its own rows to 0.1 % left 4 % of other motion.
"""

from __future__ import annotations

from collections.abc import Sequence

from ident.discrepancy.by_evidence.decide.present_with import PresentWith, present_with
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.shapes import refined
from ident.discrepancy.by_evidence.decide.state import Found, Member, found_set
from ident.discrepancy.by_evidence.library.candidates import Candidate, Entry


def member_of(
    problem: Problem, kind: Candidate, shape: tuple[float, ...], present: PresentWith, volume: float = 0.0
) -> Member:
    """A candidate with a shape, its columns made of a model."""
    placed = kind.at(problem.prepared.robot, shape, present)
    return Member(Entry(kind, placed, problem.rows.effect(placed)), volume)


def as_one(problem: Problem, found: Found) -> Found:
    """The same set with columns of each place made beside the others as they are now; κ as it is."""
    return _made_anew(problem, found) if sum(map(_gives_way, found.members)) > 1 else found


def beside_the_others(problem: Problem, found: Found, number: int) -> Found:
    """A set with a member's shapes fitted, its columns made of the model with the others, κ of its joints."""
    present = present_with(problem, found, but=number)
    fitted = refined(problem, found.members, number, found, present)
    present.forget()  # its motions: the member keeps the model itself
    members = (*found.members[:number], fitted, *found.members[number + 1 :])
    return as_one(problem, found_set(problem, members, found.level, fitted.joints))


def part_of(problem: Problem, found: Found, members: Sequence[Member]) -> Found:
    """Some members of a set, fitted without the others; κ of the others' joints is, too."""
    left = [one for one in found.members if one not in members]
    joints = sorted({joint for one in left for joint in one.joints})
    fewer = found_set(problem, members, found.level, joints)
    return _made_anew(problem, fewer) if any(map(_gives_way, left)) else fewer


def _gives_way(member: Member) -> bool:
    return bool(member.entry.placed.gives_way)


def _made_anew(problem: Problem, found: Found) -> Found:
    members = list(found.members)
    for number, one in enumerate(found.members):
        if _gives_way(one):
            present = present_with(problem, found, but=number)
            shape = one.entry.placed.shape
            members[number] = member_of(problem, one.candidate, shape, present, one.volume)
            present.forget()
    return found_set(problem, members, found.level, ())
