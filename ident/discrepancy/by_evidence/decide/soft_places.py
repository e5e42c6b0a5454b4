"""Sets in which links give way at several places, begun with all of them at once.

What gears do is read of what their springs carry (:mod:`.springs`), each foot of the grid stands beside that,
and the likeliest set gets its shapes all at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ident.discrepancy.by_evidence.decide.as_one import as_one, member_of
from ident.discrepancy.by_evidence.decide.present_with import PresentWith, present_with
from ident.discrepancy.by_evidence.decide.problem import Problem
from ident.discrepancy.by_evidence.decide.shapes_at_once import shapes_at_once
from ident.discrepancy.by_evidence.decide.springs import Columns, Spring, SpringFit
from ident.discrepancy.by_evidence.decide.state import Found, Member, found_set
from ident.discrepancy.by_evidence.evidence.gram import Level
from ident.discrepancy.by_evidence.library.candidates import Entry

_PASSED = (0.2, 0.4)
"""Of the filter's cut-off, that rows and lags pass: a lag's acceleration has noise of the torque in it times
its frequency squared, of which a soft gear bears less; what a stiff one does lies higher."""
_MOST = 3
"""Places that are begun with at once."""


@dataclass(frozen=True, eq=False)
class SoftPlaces:
    """Sets in which links give way at several places.

    Attributes:
        problem: the data.
    """

    problem: Problem
    _feet: dict[Entry, Columns] = field(default_factory=dict, repr=False)
    """Their columns through the filter, which are the same beside every set."""

    def beside(self, found: Found, entries: Sequence[Entry], present: PresentWith) -> list[Found]:
        """The likeliest one; places of the set begin anew.

        Args:
            found: the set.
            entries: the vocabulary with its grids.
            present: the model with the set.
        """
        soft = [one for one in entries if is_soft(one)]
        gears = list(dict.fromkeys(one.candidate for one in soft if one.candidate.place.joints))
        if not gears:
            return []
        problem = self.problem
        begun = _Begun.of(problem, found)
        rigid = [one.entry for one in begun.kept]
        sets = []
        for passed in _PASSED:
            fit = SpringFit.of(problem, present, rigid, gears, passed)
            springs, _ = fit.springs()
            sets += [begun.with_places(springs[:count]) for count in range(2, 1 + min(_MOST, len(springs)))]
        feet = [one for one in soft if not one.candidate.place.joints]
        if springs and feet:
            beside = [fit.springs(self._foot(fit, one)) for one in feet]
            likeliest = int(np.argmin([left for _, left in beside]))
            springs, foot = beside[likeliest][0], feet[likeliest]
            counts = range(1, min(_MOST, 1 + len(springs)))
            sets += [begun.with_places(springs[:count], foot) for count in counts]
        best = max(sets, key=lambda one: one.log_posterior, default=found)
        better = best.log_posterior > found.log_posterior
        return [shapes_at_once(problem, best, soft_members(best))] if better else []

    def _foot(self, fit: SpringFit, foot: Entry) -> Columns:
        if foot not in self._feet:
            self._feet[foot] = fit.of_entry(foot)
        return self._feet[foot]


def soft_members(found: Found) -> list[int]:
    """Members with which links give way."""
    return [number for number, one in enumerate(found.members) if is_soft(one.entry)]


def is_soft(entry: Entry) -> bool:
    """Whether links give way with it in proportion to what it carries."""
    places = entry.placed.gives_way
    return bool(places) and all(one.gear.is_linear for one in places)


@dataclass(frozen=True, eq=False)
class _Begun:
    """A set with other places in the stead of its own."""

    problem: Problem
    level: Level
    kept: Sequence[Member]

    @classmethod
    def of(cls, problem: Problem, found: Found) -> _Begun:
        return cls(problem, found.level, [one for one in found.members if not is_soft(one.entry)])

    @cached_property
    def present(self) -> PresentWith:
        """The model with what is kept."""
        return present_with(self.problem, found_set(self.problem, self.kept, self.level, ()))

    def with_places(self, springs: Sequence[Spring], foot: Entry | None = None) -> Found:
        """What is kept, with gears, and a foot where there is one."""
        shapes = [(one.gear, one.shape) for one in springs]
        if foot is not None:
            shapes.append((foot.candidate, foot.placed.shape))
        problem, joints = self.problem, range(self.problem.rows.n)
        members = (*self.kept, *(member_of(problem, one, shape, self.present) for one, shape in shapes))
        one = as_one(problem, found_set(problem, members, self.level, joints))
        return found_set(problem, one.members, one.level, joints)
