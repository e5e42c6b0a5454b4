"""Whether what makes a member of a set its effect is told from its absence.

Its sizes say so at 95 %. And an effect that contains others, as friction that changes with warmth contains
dry and viscous friction, is these where it is no likelier by the data than all of them. It is one cause where
they are several, so by its prior it stands in their place also where nothing of it shows but them: two
frictions of one joint were a drift that settles in 2000 ± 18 000 s, and was named.

A form that is not told from its limit is that limit: a cable whose stiffening may as well be nothing is a
straight spring.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from ident.discrepancy.accepted import unsure_size
from ident.discrepancy.by_evidence.decide.names import HELD, SURE, OtherMotion, slot, with_name
from ident.discrepancy.by_evidence.decide.screening import screen
from ident.discrepancy.by_evidence.decide.search import Search, Searched
from ident.discrepancy.by_evidence.decide.state import Found, Member, found_set
from robots.arrays import FloatArray


def simplified(search: Search, searched: Searched, held: OtherMotion) -> Searched:
    """A set with the limits of its forms, where these data do not tell the one from the other at 95 %.

    A power of the speed that is next to none is Coulomb friction, whatever its own name. And whatever its
    probability: a form may have a shape for what its limit has a parameter for, and so a better prior.
    """
    for number, member in enumerate(searched.found.members):
        if not member.candidate.family.contains:
            continue
        parts = _its_parts(search, searched, number)
        if parts is not None:
            fitted, present = search.settled(parts)
            return simplified(search, replace(searched, found=fitted, present=present), held)
        without = search.without(searched.found, number)
        names = slot(search, searched, number, without, held)
        own, kept = member.candidate.key, {one.key for one in names.held}
        untold = _essential_may_be_nothing(searched.found, number)
        if names.probability(own) >= SURE and not untold:
            continue
        limits = [
            one
            for one in screen(search.problem, without, searched.entries)
            if (untold or one.candidate.key in kept)
            and one.candidate.key[0] in member.candidate.family.contains
            and one.candidate.key[1] == own[1]
        ]
        if limits:
            best = with_name(search, without, limits, limits[0].candidate.key)
            return simplified(search, replace(searched, found=best), held)
    return searched


def _essential_may_be_nothing(found: Found, number: int) -> bool:
    """Whether a parameter without which a member is its limit is not told from nothing."""
    member, (theta, covariance) = found.members[number], found.theta(number)
    essential, deviation = member.candidate.family.essential, np.sqrt(np.diag(covariance))
    return bool(essential and unsure_size(member.entry.placed, essential, theta, deviation, there=True))


def unsure(found: Found, number: int, deviation: FloatArray) -> str:
    """What makes a member its effect and is not told from its absence, in words; empty where all is.

    Args:
        found: the set.
        number: of the member.
        deviation: (p,) of its parameters, in their units.
    """
    member, (theta, covariance) = found.members[number], found.theta(number)
    together = bool(theta @ np.linalg.solve(covariance, theta) > chi2.ppf(HELD, theta.size))
    essential = member.candidate.family.essential
    return unsure_size(member.entry.placed, essential, theta, deviation, together)


def _its_parts(search: Search, searched: Searched, number: int) -> Found | None:
    """A set with all names that a member contains in its place; None where they do not say as much."""
    found, member = searched.found, searched.found.members[number]
    joints = member.candidate.place.joints
    here = {one.candidate.key for one in found.members}
    parts = [
        Member(entry, 0.0)
        for entry in searched.entries
        if entry.candidate.family.name in member.candidate.family.contains
        and entry.candidate.place.joints == joints
        and entry.candidate.key not in here
        and not entry.candidate.shapes
    ]
    if not parts:
        return None
    without = search.without(found, number)
    instead = found_set(search.problem, (*without.members, *parts), found.level, member.joints)
    return instead if instead.log_evidence >= found.log_evidence else None
