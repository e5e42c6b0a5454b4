"""What is to be done about an ambiguous finding: the motion that tells its names apart, or what else does.

A motion has two parts of one length, each a way of its own: one is fitted, one judges. What a name says of
motion that no recording has seen is shown by the part that is not fitted; the recordings that left the names
open are as poor as each other, and take for confirmed what goes on like the name as far as they go.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from trajectories import Conditions, Trajectory
from trajectories.discriminate import Discrimination
from trajectories.information.separation import Separation


@dataclass(frozen=True)
class PlanSettings:
    """How the discriminating motion is planned.

    Attributes:
        conditions: what it has to keep.
        duration: of one period of either part, s.
        periods: how often it is repeated; noise is told from misfit by repeats.
        seed, evaluations: of the search for the part that is fitted; the other's seed is the next.
    """

    conditions: Conditions = field(default_factory=Conditions)
    duration: float = 6.0
    periods: int = 2
    seed: int = 0
    evaluations: int = 1500


@dataclass(frozen=True)
class Unsettled:
    """A pair that motion alone does not tell apart: why, and what on the arm would."""

    first: str
    second: str
    why: str
    settled_by: str


@dataclass(frozen=True)
class TellingApart:
    """What to do about one ambiguous finding.

    Attributes:
        number: of the finding, from 1.
        candidates: in words, the named one first.
        parts: of the motion, the one to fit and the one to validate; empty where there is none to plan for.
        unsettled: pairs that it does not tell apart.
        not_planned: why no motion could be planned, one line; empty where that was not tried or went well.
    """

    number: int
    candidates: tuple[str, ...]
    parts: tuple[Discrimination, ...]
    unsettled: tuple[Unsettled, ...]
    not_planned: str = ""

    @property
    def trajectories(self) -> tuple[Trajectory, ...]:
        """Of the parts, ready to stream."""
        return tuple(one.trajectory for one in self.parts)

    @property
    def duration(self) -> float:
        """Of all parts, s."""
        return sum(one.duration for one in self.trajectories)

    @property
    def pairs(self) -> tuple[tuple[Separation, Separation], ...]:
        """Each pair on the motion that was recorded, and on the part that tells it apart less well."""
        return pairs_of(self.parts) if self.parts else ()


def pairs_of(parts: Sequence[Discrimination]) -> tuple[tuple[Separation, Separation], ...]:
    """Each pair on the motion that was recorded, and on the part that tells it apart less well."""
    after = zip(*(one.separation_after for one in parts), strict=True)
    worse = (max(pair, key=lambda one: one.correlation) for pair in after)
    return tuple(zip(parts[0].separation_before, worse, strict=True))
