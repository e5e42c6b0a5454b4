"""log ∫ p(y | M) for any set of effects, in closed form from Gram matrices (no pass over the rows).

With white rows, precisions Λ of the known factors, w ~ N(0, κ_j²/m_j) and θ ~ N(c, 1) in units of their
scales, y is normal and

    log p(y) = −½ yᵀy + ½ zᵀ A⁻¹ z − ½ log |A| + const,   A = Λ + Zᵀ Z,  z = Zᵀ y

with Z all columns times their prior deviations. w of a joint is integrated first (its Gram matrix is
diagonalised once, so that any κ_j costs a product), then everything else in one Cholesky factor. Bounds of θ
multiply by the share of the posterior's mass within them over that of the prior's.

What repeats and is not smooth (ripples of an unknown period, impacts) no Φ w describes. It makes the rows of
its joint s_j times as noisy as what does not repeat: products of that joint are divided by s_j², and log p(y)
has −N_j log s_j more.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ident.discrepancy.by_evidence.evidence.rows import Rows, WhiteEffects, side_by_side
from ident.discrepancy.by_evidence.evidence.solved import Posterior, solve
from robots.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Level:
    """Of the misfit.

    Attributes:
        kappa: (n,) root mean square of the smooth part, N·m (or N).
        excess: (n,) s, deviation of the rows over that of what does not repeat, at least 1.
    """

    kappa: FloatArray
    excess: FloatArray

    def changed(self, joint: int, kappa: float | None = None, excess: float | None = None) -> Level:
        """With other values at one joint."""
        values = (self.kappa.copy(), self.excess.copy())
        for own, value in zip(values, (kappa, excess), strict=True):
            if value is not None:
                own[joint] = value
        return Level(*values)


@dataclass(frozen=True, eq=False)
class Gram:
    """Products of the rows with columns of a set of effects."""

    rows: Rows
    effects: tuple[WhiteEffects, ...]

    @cached_property
    def starts(self) -> IntArray:
        """First column of each effect, and the end."""
        return np.cumsum([0, *(effect.count for effect in self.effects)])

    @property
    def size(self) -> int:
        """Of the matrix over [known, y, columns of effects]."""
        return self.rows.precision.size + 1 + int(self.starts[-1])

    @cached_property
    def joints(self) -> tuple[AtJoint, ...]:
        """Products of each joint's rows."""
        return tuple(_at_joint(self, j) for j in range(self.rows.n))

    def reduced(self, level: Level, joints: Iterable[int] | None = None) -> tuple[FloatArray, float]:
        """Gram matrix of [known, y, columns] with w integrated, and the log volume that goes with it.

        Args:
            level: of the misfit.
            joints: whose rows, all where None.
        """
        whole, volume = np.zeros((self.size, self.size)), 0.0
        for j in range(self.rows.n) if joints is None else joints:
            part, log_volume = self.joints[j].without_misfit(level.kappa[j : j + 1], level.excess[j : j + 1])
            whole[self.joints[j].place] += part[0]
            volume += float(log_volume[0])
        return whole, volume

    def posterior(self, level: Level) -> Posterior:
        """Of the set."""
        return solve(*self.reduced(level), self.rows.precision, self.effects)


@dataclass(frozen=True, eq=False)
class AtJoint:
    """Products of one joint's rows.

    Attributes:
        outer: Gram matrix of [known, y, its columns of effects].
        inner: (m, …) products of the diagonalised misfit with these.
        values: (m,) of ΦᵀΦ.
        index: where these stand in the matrix of the whole arm.
        rows: how many there are.
    """

    outer: FloatArray
    inner: FloatArray
    values: FloatArray
    index: IntArray
    rows: int

    @cached_property
    def place(self) -> tuple[IntArray | slice, IntArray | slice]:
        """Of the matrix in that of the whole arm; where it stands in one piece that is no list of places."""
        if self.index[-1] == self.index.size - 1:
            return slice(self.index.size), slice(self.index.size)
        return self.index[:, np.newaxis], self.index[np.newaxis]

    def weights(self, kappa: FloatArray, excess: FloatArray) -> FloatArray:
        """(…, m) of the misfit's directions in what integrating w takes off, at levels (…,) of this joint."""
        squares = np.asarray(excess**2)[..., np.newaxis]
        variance = np.asarray(kappa**2)[..., np.newaxis] / max(self.values.size, 1)
        return np.asarray(variance / (1.0 + variance * self.values / squares) / squares)

    def without_misfit(self, kappa: FloatArray, excess: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gram matrices with w integrated and their log volumes, at K levels: (K, …, …) and (K,).

        Args:
            kappa, excess: (K,) of this joint.
        """
        squares = (excess**2)[:, np.newaxis]
        variance = (kappa**2)[:, np.newaxis] / max(self.values.size, 1)
        taken = self.inner.T @ (self.weights(kappa, excess)[:, :, np.newaxis] * self.inner)
        volume = -0.5 * np.log1p(variance * self.values / squares).sum(axis=1) - self.rows * np.log(excess)
        return (self.outer - taken) / squares[:, :, np.newaxis], volume


def _at_joint(gram: Gram, j: int) -> AtJoint:
    rows = gram.rows
    plain, values, count = rows.plain[j], rows.diagonal[j][0], rows.counts[j]
    k = rows.precision.size
    here = [(i, effect) for i, effect in enumerate(gram.effects) if effect.joints[j] is not None]
    if not here:
        return AtJoint(plain[0], plain[1], values, np.arange(k + 1), count)
    local = np.concatenate([np.arange(gram.starts[i], gram.starts[i + 1]) for i, _ in here])
    columns = side_by_side([effect for _, effect in here], j)
    beside = [rows.products_with(effect)[j] for _, effect in here]
    outside, inner = (np.concatenate([one[part] for one in beside], axis=1) for part in (0, 1))
    outer = np.block([[plain[0], outside], [outside.T, columns.T @ columns]])
    return AtJoint(
        outer,
        np.concatenate([plain[1], inner], axis=1),
        values,
        np.concatenate([np.arange(k + 1), k + 1 + local]),
        count,
    )
