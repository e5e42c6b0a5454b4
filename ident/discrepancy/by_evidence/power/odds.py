"""Whether an effect of a size would be named: log odds of all names when it is there.

Rows that are fitted show an effect of z deviations with ẑ²/2 nats, ẑ = z + n, n ~ N(0, 1). Others with w
times their information show the share 1 − n/ẑ + m/(ẑ √w) of it, m ~ N(0, 1). That has the variance
σ² = (1 + 1/w)/ẑ² and (2 · share − 1)/2σ² nats. Together these are z²/2 (1 + w/(1 + w)) in mean, and vary by
z² (1 + w/(1 + w)²): a fit that makes too much of it has as many nats more there as the share takes away.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import logit, ndtri

from ident.discrepancy.by_evidence.decide.state import ONE_MORE, TEMPERATURE
from ident.discrepancy.by_evidence.library.candidates import Entry
from ident.discrepancy.by_evidence.power.expected import Expectation
from robots.arrays import FloatArray, IntArray

SIZES = np.geomspace(3e-6, 3.0, 121)
"""In units of the prior's deviation: what is tried, an eighth apart, up to the largest that is in nature."""

EVEN = 0.5
"""Probability by the fitted rows from which on an effect is in the set that other motion is asked of."""

Key = tuple[str, tuple[int, ...]]
NOTHING: Key = ("nothing", ())


class Odds:
    """Log odds of all names when one effect is there.

    Args:
        entries: the vocabulary, forms of a name one after the other.
        own: (P, P) information of all their columns, in units of their scales.
        sure, chance, judged, by_fit: as of :func:`.smallest.smallest_sizes`.
    """

    def __init__(
        self,
        entries: Sequence[Entry],
        own: FloatArray,
        sure: float,
        chance: float,
        judged: float,
        by_fit: float = EVEN,
    ) -> None:
        self.entries, self.judged = entries, judged
        self.expected = Expectation.of(entries, own)
        self.needed, self.by_fit = float(logit(sure)), float(logit(by_fit))
        self.deviations = float(ndtri(chance))
        ids = np.array([id(entry.candidate) for entry in entries])
        self.starts: IntArray = np.flatnonzero(np.r_[True, ids[1:] != ids[:-1]])
        self.counts = np.diff(np.r_[self.starts, ids.size])
        self.candidates = [entries[int(k)].candidate for k in self.starts]
        # A few shapes may stand for all that could be tried, and have the prior of one each.
        self.shapes = np.array([one.combinations for one in self.candidates])
        self.prior = np.array([np.log(ONE_MORE * one.share) for one in self.candidates])

    def middle(self, numbers: Sequence[int]) -> int:
        """Of the shapes of a form the one with the median size."""
        sizes = np.array([max(self._alone(k, sign) for sign in self._signs(k)) for k in numbers])
        return numbers[int(np.argsort(sizes, kind="stable")[(sizes.size - 1) // 2])]

    def smallest(self, number: int) -> tuple[float, Key]:
        """Factor of an entry from which on it is named, the worse of its signs, and what it is told from."""
        return max((self._beside_all(number, sign) for sign in self._signs(number)), key=lambda one: one[0])

    def first_of(self, numbers: Sequence[int]) -> tuple[float, Key]:
        """Which of some entries, each as it is, is the first to be named, and what it is told from.

        Args:
            numbers: of an effect that grows from each to the next.

        Returns:
            From 0, between two of them where the odds are; infinite where none is named.
        """
        asked = [self._safe(number, 1.0, np.ones(1)) for number in numbers]
        return _from_where_on(np.concatenate([safe for safe, _ in asked]), asked[0][1])

    def energy(self, number: int) -> float:
        """Nats that an entry shows as it is."""
        return self.expected.energy(number, self._direction(number, 1.0))

    def _signs(self, number: int) -> tuple[float, ...]:
        """Those that the size can have."""
        entry = self.entries[number]
        low, high = entry.white.bounds[essential(entry)]
        return tuple(sign for sign, end in ((1.0, high), (-1.0, -low)) if end > 0.0)

    def _direction(self, number: int, sign: float) -> FloatArray:
        entry = self.entries[number]
        if entry.placed.whole:
            return entry.white.centre
        return sign * typical(entry)

    def _own(self, number: int, sign: float, sizes: FloatArray = SIZES) -> tuple[float, FloatArray]:
        """a of an entry that is there, and (S,) its nats in mean."""
        place = self._place(number)
        direction = self._direction(number, sign)
        if self.entries[number].placed.whole:
            # All that is there shows, and the shapes of the grid share the prior.
            a = self.expected.energy(number, direction)
            return a, a * sizes**2 - np.log(self.shapes[place])
        first = int(self.starts[place])
        means = self.expected.means(number, direction, slice(first, first + int(self.counts[place])))
        nats = _log_sums(means.at(sizes)) - np.log(self.shapes[place])
        return float(means.a[number - first]), nats

    def _place(self, number: int) -> int:
        """Which candidate an entry is of."""
        return int(np.searchsorted(self.starts, number, side="right")) - 1

    def _alone(self, number: int, sign: float) -> float:
        """Size from which on the entry is named against nothing at all."""
        a, nats = self._own(number, sign)
        ahead = TEMPERATURE * nats + self.prior[self._place(number)]
        safe = self._something(ahead, number, a * SIZES**2)
        return _size_at(_from_where_on(safe[:, np.newaxis], (NOTHING,))[0])

    def _beside_all(self, number: int, sign: float) -> tuple[float, Key]:
        at, rival = _from_where_on(*self._safe(number, sign))
        return _size_at(at), rival

    def _safe(
        self, number: int, sign: float, sizes: FloatArray = SIZES
    ) -> tuple[FloatArray, tuple[Key, ...]]:
        """Log odds against each rival that are exceeded with the chance asked for (S, rivals), and these."""
        place = self._place(number)
        a, nats = self._own(number, sign, sizes)
        means = self.expected.means(number, self._direction(number, sign))
        gains = self._sums(means.at(sizes)) - np.log(self.shapes)
        largest = np.maximum.reduceat(means.a, self.starts)
        others = [k for k, one in enumerate(self.candidates) if one.key != self.candidates[place].key]
        rivals = np.column_stack([np.zeros(sizes.size), (TEMPERATURE * gains + self.prior)[:, others]])
        ahead = (TEMPERATURE * nats + self.prior[place])[:, np.newaxis] - rivals
        more = np.maximum(a - np.r_[0.0, largest[others]], 0.0) * sizes[:, np.newaxis] ** 2
        safe = self._safely(ahead, number, more, self.judged)
        safe[:, 0] = self._something(ahead[:, 0], number, more[:, 0])
        return safe, (NOTHING, *(self.candidates[k].key for k in others))

    def _sums(self, nats: FloatArray) -> FloatArray:
        """Logarithms of the sums over each candidate's entries, (S, E) to (S, candidates)."""
        most = np.maximum.reduceat(nats, self.starts, axis=1)
        shares = np.exp(nats - np.repeat(most, self.counts, axis=1))
        return np.asarray(most + np.log(np.add.reduceat(shares, self.starts, axis=1)))

    def _something(self, ahead: FloatArray, number: int, more: FloatArray) -> FloatArray:
        """(S,) of log odds against nothing: as likely by the fit, and as sure as a name by both motions."""
        by_both = self._safely(ahead, number, more, self.judged) - self.needed
        return np.minimum(self._safely(ahead, number, more, 0.0) - self.by_fit, by_both)

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


def _log_sums(nats: FloatArray) -> FloatArray:
    """(S,) logarithms of sums over entries, of (S, E): that of scipy looks for what is infinite as well."""
    most = nats.max(axis=1)
    return np.asarray(most + np.log(np.exp(nats - most[:, np.newaxis]).sum(axis=1)))


def _size_at(number: float) -> float:
    """Of :data:`SIZES`, between two of them as well."""
    return float(SIZES[0] * (SIZES[1] / SIZES[0]) ** number)


def _from_where_on(safe: FloatArray, rivals: Sequence[Key]) -> tuple[float, Key]:
    """From where on some odds are all positive, and which are not before.

    Args:
        safe: log odds (S, rivals) of what grows from each row to the next.
        rivals: whom they are against.

    Returns:
        Number of the row, between two of them; infinite where it is none.
    """
    margin = safe.min(axis=1)
    below = np.flatnonzero(margin < 0.0)
    if below.size == 0:
        return 0.0, rivals[int(safe[0].argmin())]
    last = int(below[-1])
    rival = rivals[int(safe[last].argmin())]
    if last == margin.size - 1:
        return float("inf"), rival
    return float(last - margin[last] / (margin[last + 1] - margin[last])), rival
