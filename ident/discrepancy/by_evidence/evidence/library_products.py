"""Products of every effect of a vocabulary with the rows, each effect alone: what a screening needs, kept.

Beside any set and at any level of the misfit, the information of one effect's own columns follows from these
and from the set's own Gram matrix, without a pass over the rows but for the products with the set's members.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from ident.discrepancy.by_evidence.evidence.gram import Gram, Level
from ident.discrepancy.by_evidence.evidence.rows import Rows, WhiteEffects
from robots.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class _AtJoint:
    """Products of one joint's rows with the columns that stand there.

    Attributes:
        columns: (P_j,) which of the library's columns these are.
        outside: (k + 1, P_j) with [known, y].
        inner: (m, P_j) with the diagonalised misfit.
        own: (pairs,) of the columns of one effect with each other, over all effects.
        effects: which stand here.
    """

    columns: IntArray
    outside: FloatArray
    inner: FloatArray
    own: FloatArray
    effects: tuple[WhiteEffects, ...]


@dataclass(frozen=True, eq=False)
class LibraryProducts:
    """Of all effects, each by itself.

    Attributes:
        rows: the data.
        starts: first column of each effect, and the end.
        pairs: (2, pairs) columns of one effect with each other, effect by effect.
        ends: end of each effect's pairs.
        joints: per joint.
    """

    rows: Rows
    starts: IntArray
    pairs: IntArray
    ends: IntArray
    joints: tuple[_AtJoint, ...]

    @classmethod
    def of(cls, rows: Rows, effects: tuple[WhiteEffects, ...]) -> LibraryProducts:
        """Made once per library."""
        counts = np.array([effect.count for effect in effects], dtype=np.int64)
        starts = np.concatenate([[0], np.cumsum(counts)])
        square = [np.indices((count, count)).reshape(2, -1) for count in counts]
        pairs = [start + own for start, own in zip(starts, square, strict=False)]
        joints = tuple(_at_joint(rows, effects, starts, j) for j in range(rows.n))
        return cls(
            rows,
            starts,
            np.concatenate([np.zeros((2, 0), dtype=np.int64), *pairs], axis=1),
            np.cumsum(counts**2),
            joints,
        )

    def beside(self, members: Gram, level: Level) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Per effect, information (p, p) and score (p,) of its columns, with all else integrated.

        Args:
            members: of the set that they stand beside.
            level: of the misfit.
        """
        own, beside = self._reduced(members, level)
        k, p = self.rows.precision.size, int(members.starts[-1])
        whole, _ = members.reduced(level)
        inner = np.concatenate([np.arange(k), np.arange(k + 1, k + 1 + p)])
        centre = np.concatenate([np.zeros(0), *(one.centre for one in members.effects)])
        system = whole[np.ix_(inner, inner)]
        system[np.arange(k + p), np.arange(k + p)] += np.concatenate([self.rows.precision, np.ones(p)])
        factor = cholesky(system, lower=True, check_finite=False)
        right = whole[inner, k] - whole[inner, k + 1 :] @ centre
        left = solve_triangular(
            factor, np.column_stack([beside[inner], right]), lower=True, check_finite=False
        )
        first, second = self.pairs
        own -= np.einsum("kp,kp->p", left[:, first], left[:, second])
        score = beside[k] - centre @ beside[k + 1 :] - left[:, -1] @ left[:, :-1]
        for number, count in enumerate(np.diff(self.starts)):
            block = own[self.ends[number] - count**2 : self.ends[number]].reshape(count, count)
            yield block, score[self.starts[number] : self.starts[number + 1]]

    def _reduced(self, members: Gram, level: Level) -> tuple[FloatArray, FloatArray]:
        """With w integrated: (pairs,) of each effect's columns, and [known, y, members] with all columns."""
        own, beside = np.zeros(self.pairs.shape[1]), np.zeros((members.size, int(self.starts[-1])))
        where = np.full(int(self.starts[-1]), -1)
        for j, here in enumerate(self.joints):
            of_set = members.joints[j]
            square, weight = float(level.excess[j]) ** 2, of_set.weights(level.kappa[j], level.excess[j])
            cross = _cross(members, here, j)
            rows = np.concatenate([here.outside, cross]) - (of_set.inner.T * weight) @ here.inner
            beside[np.ix_(of_set.index, here.columns)] += rows / square
            where[:] = -1
            where[here.columns] = np.arange(here.columns.size)
            there = where[self.pairs[0]] >= 0
            first, second = where[self.pairs[:, there]]
            weighted = weight[:, np.newaxis] * here.inner
            taken = np.einsum("mp,mp->p", weighted[:, first], here.inner[:, second])
            own[there] += (here.own[there] - taken) / square
        return own, beside


def _at_joint(rows: Rows, effects: tuple[WhiteEffects, ...], starts: IntArray, j: int) -> _AtJoint:
    k, m = rows.precision.size, rows.diagonal[j][0].size
    outside, inner, columns, own = [np.zeros((k + 1, 0))], [np.zeros((m, 0))], [], []
    here = tuple(effect for effect in effects if effect.joints[j] is not None)
    for number, effect in enumerate(effects):
        if effect.joints[j] is None:
            own.append(np.zeros(effect.count**2))
            continue
        products = rows.products_with(effect)[j]
        outside.append(products[0])
        inner.append(products[1])
        columns.append(np.arange(starts[number], starts[number + 1]))
        part = effect.columns(j)
        own.append((part.T @ part).reshape(-1))
    which = np.concatenate([np.zeros(0, dtype=np.int64), *columns])
    return _AtJoint(
        which,
        np.concatenate(outside, axis=1),
        np.concatenate(inner, axis=1),
        np.concatenate([np.zeros(0), *own]),
        here,
    )


def _cross(members: Gram, here: _AtJoint, j: int) -> FloatArray:
    """Products of the members' columns at a joint with those of the library there."""
    own = [one.columns(j) for one in members.effects if one.joints[j] is not None]
    if not own or not here.effects:
        return np.zeros((sum(one.shape[1] for one in own), here.columns.size))
    turned = np.ascontiguousarray(np.concatenate(own, axis=1).T)
    return np.concatenate([turned @ effect.columns(j) for effect in here.effects], axis=1)
