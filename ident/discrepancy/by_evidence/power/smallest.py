"""The smallest size of each effect at each place that would be named rightly in most recordings.

Named rightly: the rows that are fitted speak for it, and by both motions nothing at all is as unlikely beside
it as where the search gives a name, and no other name at any other place is likelier, with the search's own
prior odds and coarsening, in four of five recordings. Nothing is simulated and no torque is read: an effect's
torque is linear in its size (that of a gap or a compliance nearly so), so the information of the motion says
it. A torque limit has no such answer: what it does follows from the torque, and it is left out.

Rows that are fitted show an effect of z deviations with ẑ²/2 nats, ẑ = z + n, n ~ N(0, 1). Others with w
times their information show the share 1 − n/ẑ + m/(ẑ √w) of it, m ~ N(0, 1). That has the variance
σ² = (1 + 1/w)/ẑ² and (2 · share − 1)/2σ² nats. Together these are z²/2 (1 + w/(1 + w)) in mean, and vary by
z² (1 + w/(1 + w)²): a fit that makes too much of it has as many nats more there as the share takes away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri

from ident.closed_loop.at_once import at_once
from ident.discrepancy.by_evidence.decide.screening import information_beside
from ident.discrepancy.by_evidence.decide.state import ONE_MORE, TEMPERATURE, Member
from ident.discrepancy.by_evidence.evidence.gram import Level
from ident.discrepancy.by_evidence.evidence.rows import Rows, effect_rows
from ident.discrepancy.by_evidence.library.candidates import Entry
from ident.discrepancy.by_evidence.power.expected import Expectation
from ident.effects.family import Shape
from robots.arrays import FloatArray, IntArray

CHANCE = 0.8
"""Share of recordings in which the smallest size is named."""

SIZES = np.geomspace(3e-6, 3.0, 121)
"""In units of the prior's deviation: what is tried, an eighth apart, up to the largest that is in nature."""

Key = tuple[str, tuple[int, ...]]
NOTHING: Key = ("nothing", ())


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

    @property
    def seen(self) -> bool:
        """Whether any size of it would be named."""
        return bool(np.isfinite(self.size))


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
    """
    taken = {member.candidate.key for member in members if not member.candidate.family.several}
    free = [entry for entry in entries if entry.candidate.key not in taken]
    if not free:
        return ()
    own, _ = information_beside(rows, level, members, free)
    odds = _Odds([replace(one, white=one.white.without_columns()) for one in free], own, sure, chance, judged)
    del entries, free  # a hundred megabytes of columns, which nobody asks for from here on

    def said(numbers: Sequence[int]) -> Smallest:
        k = odds.middle(numbers)
        return _said(rows, odds.entries[k], *odds.unlucky(k))

    return tuple(at_once(said, _main_forms(odds.entries)))


def _main_forms(entries: Sequence[Entry]) -> list[list[int]]:
    """Per name and place, the entries of its first form that can be asked about."""
    first: dict[Key, object] = {}
    grouped: dict[Key, list[int]] = {}
    for number, entry in enumerate(entries):
        key = entry.candidate.key
        if first.setdefault(key, entry.candidate) is entry.candidate and not entry.placed.of_measured:
            grouped.setdefault(key, []).append(number)
    return list(grouped.values())


class _Odds:
    """Log odds of all names when one effect is there."""

    def __init__(
        self, entries: Sequence[Entry], own: FloatArray, sure: float, chance: float, judged: float
    ) -> None:
        self.entries, self.judged = entries, judged
        self.expected = Expectation.of(entries, own)
        self.needed, self.deviations = float(np.log(sure / (1.0 - sure))), float(ndtri(chance))
        ids = np.array([id(entry.candidate) for entry in entries])
        self.starts: IntArray = np.flatnonzero(np.r_[True, ids[1:] != ids[:-1]])
        self.shapes = np.diff(np.r_[self.starts, ids.size])
        self.candidates = [entries[int(k)].candidate for k in self.starts]
        self.prior = np.array([np.log(ONE_MORE * one.share) for one in self.candidates])

    def middle(self, numbers: Sequence[int]) -> int:
        """Of the shapes of a form the one with the median size; where the shape is the size, that shape."""
        sizes = np.array([max(self._alone(k, sign) for sign in self._signs(k)) for k in numbers])
        if self.entries[numbers[0]].placed.whole:
            return numbers[int(np.argmin(np.abs(np.log(sizes))))]
        return numbers[int(np.argsort(sizes, kind="stable")[(sizes.size - 1) // 2])]

    def unlucky(self, number: int) -> tuple[float, Key]:
        """Factor of an entry from which on it is named, the worse of its signs, and what it is told from."""
        return max((self._beside_all(number, sign) for sign in self._signs(number)), key=lambda one: one[0])

    def _signs(self, number: int) -> tuple[float, ...]:
        """Those that the size can have; of a shape only one."""
        entry = self.entries[number]
        low, high = entry.white.bounds[essential(entry)]
        if entry.placed.whole:
            return (1.0,)
        return tuple(sign for sign, end in ((1.0, high), (-1.0, -low)) if end > 0.0)

    def _direction(self, number: int, sign: float) -> FloatArray:
        entry = self.entries[number]
        if entry.placed.whole:
            return entry.white.centre
        return sign * typical(entry)

    def _own(self, number: int, sign: float) -> tuple[float, FloatArray]:
        """a of an entry that is there, and (S,) its nats in mean."""
        place = int(np.searchsorted(self.starts, number, side="right")) - 1
        direction = self._direction(number, sign)
        if self.entries[number].placed.whole:
            # The shape follows the size: all that is there shows, and the shapes of the grid share the prior.
            a = self.expected.energy(number, direction)
            return a, a * SIZES**2 - np.log(self.shapes[place])
        first = int(self.starts[place])
        means = self.expected.means(number, direction, slice(first, first + int(self.shapes[place])))
        nats = _log_sums(means.at(SIZES)) - np.log(self.shapes[place])
        return float(means.a[number - first]), nats

    def _alone(self, number: int, sign: float) -> float:
        """Size from which on the entry is named against nothing at all."""
        place = int(np.searchsorted(self.starts, number, side="right")) - 1
        a, nats = self._own(number, sign)
        return _crossing(self._something(TEMPERATURE * nats + self.prior[place], number, a * SIZES**2))

    def _beside_all(self, number: int, sign: float) -> tuple[float, Key]:
        place = int(np.searchsorted(self.starts, number, side="right")) - 1
        a, nats = self._own(number, sign)
        means = self.expected.means(number, self._direction(number, sign))
        gains = self._sums(means.at(SIZES)) - np.log(self.shapes)
        largest = np.maximum.reduceat(means.a, self.starts)
        others = [k for k, one in enumerate(self.candidates) if one.key != self.candidates[place].key]
        rivals = np.column_stack([np.zeros(SIZES.size), (TEMPERATURE * gains + self.prior)[:, others]])
        ahead = (TEMPERATURE * nats + self.prior[place])[:, np.newaxis] - rivals
        more = np.maximum(a - np.r_[0.0, largest[others]], 0.0) * SIZES[:, np.newaxis] ** 2
        safe = self._safely(ahead, number, more, self.judged)
        safe[:, 0] = self._something(ahead[:, 0], number, more[:, 0])
        size = _crossing(safe.min(axis=1))
        below = max(int(np.searchsorted(SIZES, min(size, SIZES[-1]))) - 1, 0)
        last = int(np.argmin(safe[below]))
        return size, NOTHING if last == 0 else self.candidates[others[last - 1]].key

    def _sums(self, nats: FloatArray) -> FloatArray:
        """Logarithms of the sums over each candidate's entries, (S, E) to (S, candidates)."""
        most = np.maximum.reduceat(nats, self.starts, axis=1)
        shares = np.exp(nats - np.repeat(most, self.shapes, axis=1))
        return np.asarray(most + np.log(np.add.reduceat(shares, self.starts, axis=1)))

    def _something(self, ahead: FloatArray, number: int, more: FloatArray) -> FloatArray:
        """(S,) of log odds against nothing: above 0 by the fit, and as sure as a name by both motions."""
        by_both = self._safely(ahead, number, more, self.judged) - self.needed
        return np.minimum(self._safely(ahead, number, more, 0.0), by_both)

    def _safely(self, ahead: FloatArray, number: int, more: FloatArray, judged: float) -> FloatArray:
        """Log odds that are exceeded with the chance that is asked for, (S,) or (S, rivals).

        Args:
            ahead: in mean, by the rows that are fitted.
            number: of the entry that is there.
            more: nats, of what the rival cannot imitate.
            judged: as of :func:`smallest_sizes`; 0 by the rows that are fitted alone.
        """
        share = judged / (1.0 + judged)
        mean = ahead + TEMPERATURE * share * more
        variance = 2.0 * more * (1.0 + share / (1.0 + judged)) + 0.5 * self.entries[number].white.count
        return np.asarray(mean - self.deviations * TEMPERATURE * np.sqrt(variance))


def essential(entry: Entry) -> int:
    """Which of an effect's parameters is its size."""
    return (entry.candidate.family.essential or (0,))[0]


def typical(entry: Entry) -> FloatArray:
    """(p,) parameters in units of their scales: those without which it is another effect, else all."""
    chosen = np.zeros(entry.white.count)
    chosen[list(entry.candidate.family.essential) or slice(None)] = 1.0
    return chosen


def least_of(shape: Shape) -> float:
    """The smallest that the vocabulary has of a size that is a shape: stiffer gears are not looked for."""
    return max(shape.lower, 0.0)


def _log_sums(nats: FloatArray) -> FloatArray:
    """(S,) logarithms of sums over entries, of (S, E): that of scipy looks for what is infinite as well."""
    most = nats.max(axis=1)
    return np.asarray(most + np.log(np.exp(nats - most[:, np.newaxis]).sum(axis=1)))


def _crossing(margin: FloatArray) -> float:
    """Size from which on a margin (S,) is positive, between the sizes that are tried."""
    below = np.flatnonzero(margin < 0.0)
    if below.size == 0:
        return float(SIZES[0])
    last = int(below[-1])
    if last == SIZES.size - 1:
        return float("inf")
    share = -margin[last] / (margin[last + 1] - margin[last])
    return float(SIZES[last] * (SIZES[last + 1] / SIZES[last]) ** share)


def _said(rows: Rows, entry: Entry, factor: float, rival: Key) -> Smallest:
    """The size in the effect's own unit, and its torque."""
    placed, first = entry.placed, essential(entry)
    robot, shapes = rows.prepared.robot, entry.candidate.shapes
    if placed.whole:
        factor = max(factor, least_of(shapes[0]) / placed.shape[0])
    values = np.ones(1) if placed.whole else typical(entry) * entry.white.scale
    own = values[first] if not placed.whole else placed.shape[0]
    parameter = placed.shape_names[0] if placed.whole else placed.parameters[first].name
    unit = shapes[0].unit if placed.whole else placed.parameters[first].unit
    rest = zip(placed.shape_names, placed.shape, (one.unit for one in shapes), strict=True)
    torque, used = effect_rows(rows.prepared, placed) @ values, rows.prepared.used
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
