"""The smallest size of each effect at each place that would be named rightly in most recordings.

Named rightly: the rows that are fitted speak for it, and by both motions nothing at all is as unlikely beside
it as where the search gives a name, and no other name at any other place is likelier, with the search's own
prior odds and coarsening, in four of five recordings. Nothing is simulated and no torque is read: an effect's
torque is linear in its size, so the information of the motion says it. Of what its shape makes, a play, a
gear that gives way, a torque limit, it is not: there the odds are asked of each value of its grid as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ident.closed_loop.at_once import at_once
from ident.discrepancy.by_evidence.decide.screening import information_beside
from ident.discrepancy.by_evidence.decide.state import Member
from ident.discrepancy.by_evidence.evidence.gram import Level
from ident.discrepancy.by_evidence.evidence.rows import Rows
from ident.discrepancy.by_evidence.library.candidates import Entry
from ident.discrepancy.by_evidence.power.odds import EVEN, Key, Odds, essential, typical

CHANCE = 0.8
"""Share of recordings in which the smallest size is named."""


@dataclass(frozen=True)
class Smallest:
    """Of one effect at one place; joints from 1, none for the whole arm.

    Attributes:
        name, joints: the effect and its place.
        parameter, unit: what the size is of: the parameter without which it is another effect, or the shape
            that its torque grows with.
        size: infinite where none that is in nature would be named on this motion. The effect's other
            parameters grow with it in the proportion of their usual sizes, unless one alone makes the effect.
        torque: root mean square of its torque at that size where the joints move, N·m (or N), at the joint
            where it is largest; infinite with the size.
        joint: that joint.
        torque_unit: N·m or N.
        shape: names, values and units of its other shapes.
        rival: the name and place that it is last told from; nothing at all where noise alone hides it.
        torque_share: the torque as a share of that joint's limit.
        falls: whether there is less of the effect the larger the size is, as of a limit: then it is the
            largest that would be named.
    """

    name: str
    joints: tuple[int, ...]
    parameter: str
    unit: str
    size: float
    torque: float
    joint: int
    torque_unit: str
    shape: tuple[tuple[str, float, str], ...]
    rival: Key
    torque_share: float
    falls: bool = False

    @property
    def seen(self) -> bool:
        """Whether any size of it would be named."""
        return bool(np.isfinite(self.size))

    def names(self, size: float) -> bool:
        """Whether the effect would be named with a size."""
        return self.seen and (size <= self.size if self.falls else size >= self.size)

    def tells_more_than(self, other: Smallest) -> bool:
        """Whether it is named with less than by another motion."""
        return self.seen and not (other.seen and other.names(self.size))


def worst_first(sizes: Sequence[Smallest]) -> tuple[Smallest, ...]:
    """What no size of is named first, then by the share of the joint's torque that may hide."""
    return tuple(sorted(sizes, key=lambda one: -one.torque_share))


def smallest_sizes(
    rows: Rows,
    level: Level,
    members: Sequence[Member],
    entries: Sequence[Entry],
    sure: float,
    chance: float = CHANCE,
    judged: float = 1.0,
    by_fit: float = EVEN,
) -> tuple[Smallest, ...]:
    """Of every effect at every place that is not found yet, in the order of the vocabulary.

    Args:
        rows: what is known, misfit and noise on the motion; their torque is not read.
        level: of the misfit.
        members: what is found already.
        entries: the vocabulary on these rows.
        sure: probability from which on a name is given.
        chance: of getting it.
        judged: information of the recordings that are not fitted, as a share of that of those that are.
        by_fit: probability that the fitted rows alone have to give it.
    """
    taken = {member.candidate.key for member in members if not member.candidate.family.several}
    free = [entry for entry in entries if entry.candidate.key not in taken]
    if not free:
        return ()
    own, _ = information_beside(rows, level, members, free)
    odds = Odds(
        [replace(one, white=one.white.without_columns()) for one in free], own, sure, chance, judged, by_fit
    )
    del entries, free  # a hundred megabytes of columns, which nobody asks for from here on

    def said(numbers: Sequence[int]) -> Smallest:
        if odds.entries[numbers[0]].placed.whole:
            return max(
                (_of_grid(rows, odds, some) for some in _grids(odds, numbers)), key=lambda one: one.torque
            )
        k = odds.middle(numbers)
        return _said(rows, odds.entries[k], *odds.smallest(k))

    return tuple(at_once(said, _main_forms(odds.entries)))


def _main_forms(entries: Sequence[Entry]) -> list[list[int]]:
    """Per name and place, the entries of its first form."""
    first: dict[Key, object] = {}
    grouped: dict[Key, list[int]] = {}
    for number, entry in enumerate(entries):
        key = entry.candidate.key
        if first.setdefault(key, entry.candidate) is entry.candidate:
            grouped.setdefault(key, []).append(number)
    return list(grouped.values())


def _said(rows: Rows, entry: Entry, factor: float, rival: Key) -> Smallest:
    """The size in the effect's own unit, and its torque."""
    placed, first = entry.placed, essential(entry)
    robot, shapes = rows.prepared.robot, entry.candidate.shapes
    values = np.ones(1) if placed.whole else typical(entry) * entry.white.scale
    own = values[first] if not placed.whole else placed.shape[0]
    parameter = placed.shape_names[0] if placed.whole else placed.parameters[first].name
    unit = shapes[0].unit if placed.whole else placed.parameters[first].unit
    rest = zip(placed.shape_names, placed.shape, (one.unit for one in shapes), strict=True)
    torque, used = rows.thin(placed) @ values, rows.prepared.used
    squares = np.sum(np.where(used, torque, 0.0) ** 2, axis=0) / np.maximum(used.sum(axis=0), 1)
    joint = int(np.argmax(squares))
    size = float(factor * np.sqrt(squares[joint])) if np.isfinite(factor) else float("inf")
    name, joints = entry.candidate.key
    return Smallest(
        name=name,
        joints=tuple(j + 1 for j in joints),
        parameter=parameter,
        unit=unit,
        size=float(factor * own),
        torque=size,
        joint=joint + 1,
        torque_unit=robot.joint[joint].torque_unit,
        shape=tuple(rest)[1 if placed.whole else 0 :],
        rival=(rival[0], tuple(j + 1 for j in rival[1])),
        torque_share=size / robot.joint[joint].torque,
    )


def _grids(odds: Odds, numbers: Sequence[int]) -> list[list[int]]:
    """Entries that differ in their first shape alone, in the order of that."""
    grouped: dict[tuple[float, ...], list[int]] = {}
    for k in sorted(numbers, key=lambda k: odds.entries[k].placed.shape[0]):
        grouped.setdefault(odds.entries[k].placed.shape[1:], []).append(k)
    return list(grouped.values())


def _of_grid(rows: Rows, odds: Odds, numbers: Sequence[int]) -> Smallest:
    """Of an effect that is what its first shape makes it: between which of two values its name begins."""
    falls = odds.energy(numbers[0]) > odds.energy(numbers[-1])
    ordered = numbers[::-1] if falls else numbers
    at, rival = odds.first_of(ordered)
    entries = [odds.entries[k] for k in ordered]
    if not np.isfinite(at):
        return replace(_said(rows, entries[-1], float("inf"), rival), falls=falls)
    below, above = (_said(rows, entries[int(end)], 1.0, rival) for end in (np.floor(at), np.ceil(at)))

    def between(low: float, high: float) -> float:
        return float(low * (high / low) ** (at % 1.0))

    return replace(
        above,
        size=between(below.size, above.size),
        torque=between(below.torque, above.torque),
        torque_share=between(below.torque_share, above.torque_share),
        falls=falls,
    )
