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

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve, cholesky
from scipy.special import log_ndtr

from ident.discrepancy.by_evidence.evidence.rows import Rows, WhiteEffects
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
class Posterior:
    """Of one set at a given level of the misfit.

    Attributes:
        log_evidence: nats, up to a constant that all sets on the same rows share.
        known: (k,) mean of the known factors.
        theta: (p,) mean of the effects' parameters, in units of their scales.
        factor: (k + p, k + p) lower Cholesky factor of both's precision.
    """

    log_evidence: float
    known: FloatArray
    theta: FloatArray
    factor: FloatArray

    @cached_property
    def covariance(self) -> FloatArray:
        """(k + p, k + p) of known factors and θ; most sets are fitted and never asked for it."""
        return np.asarray(cho_solve((self.factor, True), np.eye(self.factor.shape[0]), check_finite=False))


@dataclass(frozen=True, eq=False)
class Gram:
    """Products of the rows with columns of effects."""

    rows: Rows
    effects: tuple[WhiteEffects, ...]

    @cached_property
    def starts(self) -> IntArray:
        """First column of each effect, and the end."""
        return np.cumsum([0, *(effect.count for effect in self.effects)])

    @cached_property
    def _joints(self) -> tuple[_Joint, ...]:
        return tuple(_joint(self, j) for j in range(self.rows.n))

    def reduced(
        self, level: Level, columns: IntArray | None = None, joints: Iterable[int] | None = None
    ) -> tuple[FloatArray, float]:
        """Gram matrix of [known, y, chosen columns] with w integrated, and the log volume that goes with it.

        Args:
            level: of the misfit.
            columns: of the effects, all where None.
            joints: whose rows, all where None.
        """
        k = self.rows.precision.size
        total = int(self.starts[-1]) if columns is None else columns.size
        whole = np.zeros((k + 1 + total, k + 1 + total))
        volume = 0.0
        for j in range(self.rows.n) if joints is None else joints:
            kappa, excess = float(level.kappa[j]), float(level.excess[j])
            part, index, log_volume = self._joints[j].without_misfit(kappa, excess, columns)
            whole[np.ix_(index, index)] += part
            volume += log_volume - self.rows.counts[j] * float(np.log(excess))
        return whole, volume

    def columns_of(self, chosen: Sequence[int]) -> IntArray:
        """Columns of some of the effects."""
        ranges = [np.arange(self.starts[i], self.starts[i + 1]) for i in chosen]
        return np.concatenate(ranges) if ranges else np.zeros(0, dtype=np.int64)

    def posterior(self, level: Level, chosen: Sequence[int]) -> Posterior:
        """Of the set of these effects."""
        return self.solved(*self.reduced(level, self.columns_of(chosen)), chosen)

    def solved(self, whole: FloatArray, volume: float, chosen: Sequence[int]) -> Posterior:
        """The same from what :meth:`reduced` gives."""
        return solve(whole, volume, self.rows.precision, [self.effects[i] for i in chosen])


def solve(
    whole: FloatArray, volume: float, precision: FloatArray, parts: Sequence[WhiteEffects]
) -> Posterior:
    """Evidence and posterior of a set whose reduced Gram matrix is over [known, y, its columns]."""
    k, p = precision.size, sum(part.count for part in parts)
    centre = np.concatenate([part.centre for part in parts]) if parts else np.zeros(0)
    inner = np.concatenate([np.arange(k), np.arange(k + 1, k + 1 + p)])
    system = whole[np.ix_(inner, inner)].copy()
    shift = whole[inner, k + 1 :] @ centre
    right = whole[inner, k] - shift
    power = whole[k, k] - 2.0 * whole[k, k + 1 :] @ centre + centre @ whole[k + 1 :, k + 1 :] @ centre
    system[np.arange(k + p), np.arange(k + p)] += np.concatenate([precision, np.ones(p)])
    factor = cholesky(system, lower=True, check_finite=False)
    mean = cho_solve((factor, True), right, check_finite=False)
    log_evidence = 0.5 * (float(right @ mean) - float(power)) - float(np.log(np.diag(factor)).sum())
    theta = mean[k:] + centre
    # θ stands last, so its own block of the factor is that of its precision with all else integrated.
    own = cho_solve((factor[k:, k:], True), np.eye(p), check_finite=False)
    for_bounds = bounds_factor(theta, np.sqrt(np.diag(own)), parts)
    unsaid = sum(part.unsaid for part in parts)
    return Posterior(log_evidence + volume + for_bounds - unsaid, mean[:k], theta, factor)


def bounds_factor(mean: FloatArray, deviation: FloatArray, parts: Sequence[WhiteEffects]) -> float:
    """Log of the posterior's mass within the bounds over the prior's, parameter by parameter."""
    if not parts:
        return 0.0
    bounds = np.concatenate([part.bounds for part in parts])
    centre = np.concatenate([part.centre for part in parts])
    limited = np.isfinite(bounds).any(axis=1)
    if not limited.any():
        return 0.0
    low, high = bounds[limited].T
    after = _log_mass((low - mean[limited]) / deviation[limited], (high - mean[limited]) / deviation[limited])
    return float(np.sum(after - _log_mass(low - centre[limited], high - centre[limited])))


def _log_mass(low: FloatArray, high: FloatArray) -> FloatArray:
    """Log of a standard normal's mass between bounds, on the side where it can be told."""
    swapped = low > 0.0
    low, high = np.where(swapped, -high, low), np.where(swapped, -low, high)
    upper, lower = log_ndtr(high), log_ndtr(low)
    return np.asarray(upper + np.log1p(-np.exp(np.minimum(lower - upper, -1e-15))))


@dataclass(frozen=True, eq=False)
class _Joint:
    """Products of one joint's rows.

    Attributes:
        outer: Gram matrix of [known, y, its columns of effects].
        inner: (m, …) products of the diagonalised misfit with these.
        values: (m,) of ΦᵀΦ.
        local: which columns of effects stand here.
        k: known columns.
    """

    outer: FloatArray
    inner: FloatArray
    values: FloatArray
    local: IntArray
    k: int

    def without_misfit(
        self, kappa: float, excess: float, columns: IntArray | None
    ) -> tuple[FloatArray, IntArray, float]:
        values = self.values / excess**2
        variance = kappa**2 / max(values.size, 1)
        weight = variance / (1.0 + variance * values) / excess**2
        if columns is None:
            own, place = np.arange(self.outer.shape[0]), self.local
        else:
            here = np.isin(columns, self.local)
            place = np.flatnonzero(here)
            own = np.concatenate(
                [np.arange(self.k + 1), self.k + 1 + np.searchsorted(self.local, columns[here])]
            )
        inner = self.inner[:, own]
        part = self.outer[np.ix_(own, own)] - (inner.T * weight) @ inner
        index = np.concatenate([np.arange(self.k + 1), self.k + 1 + place])
        return part / excess**2, index, -0.5 * float(np.log1p(variance * values).sum())


def _joint(gram: Gram, j: int) -> _Joint:
    rows = gram.rows
    k, m = rows.precision.size, rows.misfit[j].shape[1]
    here = [(i, effect.joints[j]) for i, effect in enumerate(gram.effects) if effect.joints[j] is not None]
    base = rows.products[j]
    outer_index = np.concatenate([np.arange(k), [k + m]])
    values, vectors = rows.diagonal[j]
    if not here:
        inner = vectors.T @ base[k : k + m][:, outer_index]
        return _Joint(base[np.ix_(outer_index, outer_index)], inner, values, np.zeros(0, dtype=np.int64), k)
    local = np.concatenate([np.arange(gram.starts[i], gram.starts[i + 1]) for i, _ in here])
    columns = np.concatenate([part for _, part in here if part is not None], axis=1)
    beside = rows.white[j].T @ columns
    own = columns.T @ columns
    outer = np.block(
        [[base[np.ix_(outer_index, outer_index)], beside[outer_index]], [beside[outer_index].T, own]]
    )
    inner = vectors.T @ np.concatenate([base[k : k + m][:, outer_index], beside[k : k + m]], axis=1)
    return _Joint(outer, inner, values, local, k)
