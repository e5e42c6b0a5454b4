"""What the log evidence of every candidate is expected to be when one effect is there with a size.

With G the information of all columns of effects, all that is known and the misfit integrated out, an effect
of θ = s u shows a candidate B the score z = G_BA u s + n, n ~ N(0, G_BB). Its log evidence is a quadratic
form of z, so its mean is a s² + b s + c. The difference of two candidates deviates from its mean as the part
of the effect does that the worse one cannot imitate: by s √(2 (a_A − a_B)).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.discrepancy.by_evidence.library.candidates import Entry
from robots.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Means:
    """Per entry of the vocabulary (E,): nats beside nothing at all are a s² + b s + c in mean."""

    a: FloatArray
    b: FloatArray
    c: FloatArray

    def at(self, sizes: FloatArray) -> FloatArray:
        """(S, E) at sizes s (S,)."""
        s = sizes[:, np.newaxis]
        return np.asarray(self.a * s**2 + self.b * s + self.c)


@dataclass(frozen=True, eq=False)
class Expectation:
    """All entries beside a set, padded to the most parameters of one (E, p).

    Attributes:
        own: (P, P) information of all their columns, in units of their scales.
        index: (E, p) column of each parameter; P, which is empty, where an entry has fewer.
        posterior: (E, p, p) covariance of each entry's parameters.
        centre: (E, p) of their prior.
        constant: (E,) c of :class:`Means`.
        bounded: (E,) the sign that the one parameter of an entry cannot have, 0 where it can have both.
    """

    own: FloatArray
    index: IntArray
    posterior: FloatArray
    centre: FloatArray
    constant: FloatArray
    bounded: FloatArray

    @classmethod
    def of(cls, entries: Sequence[Entry], own: FloatArray) -> Expectation:
        """From the information of the entries' columns, one entry after the other."""
        counts = [entry.white.count for entry in entries]
        shape, start = (len(entries), max(counts)), 0
        index = np.full(shape, own.shape[0], dtype=np.int64)
        posterior, centre = np.zeros((*shape, shape[1])), np.zeros(shape)
        constant, bounded = np.empty(len(entries)), np.zeros(len(entries))
        for number, (entry, count) in enumerate(zip(entries, counts, strict=True)):
            part = slice(start, start + count)
            index[number, :count] = np.arange(start, part.stop)
            inverse = np.asarray(np.linalg.inv(own[part, part] + np.eye(count)), dtype=np.float64)
            posterior[number, :count, :count] = inverse
            centre[number, :count] = entry.white.centre
            constant[number] = _of_nothing(own[part, part], inverse, entry.white.centre) - entry.white.unsaid
            bounded[number] = _never(entry)
            start = part.stop
        return cls(own, index, posterior, centre, constant, bounded)

    def means(self, number: int, direction: FloatArray, of: slice = slice(None)) -> Means:
        """Of entries where one of them is there.

        Args:
            number: of that entry.
            direction: (p,) u, its parameters at size 1 in units of their scales.
            of: whose nats are asked for, all where nothing is said.
        """
        columns, index, posterior = self.index[number][: direction.size], self.index[of], self.posterior[of]
        first, end = (
            int(self.index[of.start or 0, 0]),
            int(index.max(where=index < self.own.shape[0], initial=-1)) + 1,
        )
        shown = np.append(self.own[first:end, columns] @ direction, 0.0)[
            np.minimum(index - first, end - first)
        ]
        weighted = np.einsum("epq,eq->ep", posterior, shown)
        wrong = np.sign(weighted[:, 0]) * self.bounded[of] > 0.0
        a = np.where(wrong, 0.0, 0.5 * np.sum(shown * weighted, axis=1))
        # About a centre c the score counts z'c − (G c)' (G + 1)⁻¹ z, and 1 − G (G + 1)⁻¹ = (G + 1)⁻¹.
        b = np.where(wrong, 0.0, np.sum(self.centre[of] * weighted, axis=1))
        return Means(a, b, self.constant[of])

    def energy(self, number: int, direction: FloatArray) -> float:
        """½ uᵀ G u: nats that an effect of size 1 shows, were its parameters known."""
        columns = self.index[number][: direction.size]
        return float(0.5 * direction @ self.own[np.ix_(columns, columns)] @ direction)


def _of_nothing(information: FloatArray, posterior: FloatArray, centre: FloatArray) -> float:
    """Nats in mean of an entry where nothing is there."""
    shown = information @ centre
    nats = 0.5 * float(np.trace(posterior @ information)) + 0.5 * float(np.linalg.slogdet(posterior)[1])
    return nats + 0.5 * float(shown @ posterior @ shown) - 0.5 * float(centre @ shown)


def _never(entry: Entry) -> float:
    """Sign that the one parameter of an entry cannot have; 0 where there are more, or it can have both."""
    if entry.white.count > 1:
        return 0.0
    low, high = entry.white.bounds[0]
    return -1.0 if low >= 0.0 else 1.0 if high <= 0.0 else 0.0
