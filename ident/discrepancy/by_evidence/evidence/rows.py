"""White rows of the one model y = X β + Φ w + E θ + ε, joint by joint, and their products.

Rows of a joint hold, side by side, the *known* columns (X β in units of its prior's deviations, the lag of
the channels, the drives' gains), its misfit Φ, and y less what the prior expects. Φ of a joint stands in the
rows of that joint alone, so κ of one joint is no matter of the others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ident.discrepancy.by_evidence.evidence.noise import Noise, Whitener
from ident.discrepancy.by_evidence.evidence.prepared import Prepared
from ident.effects.family import PlacedEffect
from ident.statistics.symmetric import eigen_of
from robots.arrays import FloatArray
from robots.identity_cache import IdentityCache

_FLAT = 1e-9
"""Precision of a parameter without a prior, relative to that of the data."""

_NOTHING = 1e-9

Columns = FloatArray | NDArray[np.float32]

_TOGETHER = 32
"""Effects whose products are made together."""


@dataclass(frozen=True)
class Known:
    """Columns that every model has, and what is known of their factors.

    Attributes:
        columns: rows × joints × k, each in units of its factor's prior deviation where it has one.
        precision: (k,) 1 with a prior, 0 without.
        target: rows × joints, N·m (or N): torque less what the prior expects.
    """

    columns: FloatArray
    precision: FloatArray
    target: FloatArray


@dataclass(frozen=True, eq=False)
class WhiteEffects:
    """White columns of an effect: per joint (N, p), None where the joint has none of it.

    Attributes:
        count: p.
        joints: the columns, in units of the parameters' scales.
        centre, bounds: (p,) and (p, 2) of the prior, in units of the scales.
        scale: (p,) of the parameters.
        unsaid: nats that rows cost of which the effect does not say what is measured.
    """

    count: int
    joints: tuple[Columns | None, ...]
    centre: FloatArray
    bounds: FloatArray
    scale: FloatArray
    unsaid: float = 0.0
    _products: IdentityCache[tuple[tuple[FloatArray, FloatArray], ...]] = field(
        init=False, default_factory=lambda: IdentityCache(1), repr=False
    )

    def columns(self, joint: int) -> FloatArray:
        """(N, p) of a joint, to calculate with; no column where it has none."""
        part = self.joints[joint]
        return np.zeros((0, 0)) if part is None else part.astype(np.float64, copy=False)

    def products(
        self, rows: Rows, make: Callable[[], tuple[tuple[FloatArray, FloatArray], ...]]
    ) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Those of :meth:`Rows.products_with`: every set that the effect is in asks for them."""
        return self._products.of(rows, make)

    def forget(self) -> None:
        """Products with rows, which keep these and all that is made of them."""
        self._products.forget()

    def without_columns(self) -> WhiteEffects:
        """What is known of its parameters alone, in no joint's rows."""
        return replace(self, joints=())

    @property
    def there(self) -> bool:
        """Whether the data show anything of it."""
        return any(part is not None for part in self.joints)

    @property
    def at(self) -> tuple[int, ...]:
        """Joints with rows that show it."""
        return tuple(joint for joint, part in enumerate(self.joints) if part is not None)


def side_by_side(effects: Sequence[WhiteEffects], joint: int) -> FloatArray:
    """(N, all p) columns of effects at a joint where each has some, to calculate with."""
    parts = [part for effect in effects if (part := effect.joints[joint]) is not None]
    return np.concatenate(parts, axis=1, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Rows:
    """The data with a noise model.

    Attributes:
        prepared: the recordings.
        known: columns of every model.
        misfit: per joint, rows × m.
        noise: per joint.
    """

    prepared: Prepared
    known: Known
    misfit: tuple[FloatArray, ...]
    noise: tuple[Noise, ...]
    kept: IdentityCache[Any] = field(default_factory=lambda: IdentityCache(1), repr=False)
    """What is made of these rows and one library: its products."""

    @property
    def n(self) -> int:
        return len(self.noise)

    @cached_property
    def whiteners(self) -> tuple[Whitener, ...]:
        segment, used = self.prepared.segment, self.prepared.used
        return tuple(Whitener.of(noise, segment, used[:, j]) for j, noise in enumerate(self.noise))

    @cached_property
    def white(self) -> tuple[FloatArray, ...]:
        """Per joint (N, k + m + 1): known, misfit, y."""
        known = self.known
        return tuple(
            self.whiteners[j](
                np.concatenate([known.columns[:, j], self.misfit[j], known.target[:, j, np.newaxis]], axis=1)
            )
            for j in range(self.n)
        )

    @cached_property
    def products(self) -> tuple[FloatArray, ...]:
        """Per joint, the Gram matrix of :attr:`white`."""
        return tuple(block.T @ block for block in self.white)

    @cached_property
    def diagonal(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Per joint, eigenvalues (m,) and vectors of ΦᵀΦ."""
        k, found = self.known.precision.size, []
        for product, misfit in zip(self.products, self.misfit, strict=True):
            inside = slice(k, k + misfit.shape[1])
            values, vectors = eigen_of(product[inside, inside])
            found.append((np.maximum(values, 0.0), vectors))
        return tuple(found)

    @cached_property
    def plain(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Per joint, Gram matrix of [known, y] and the diagonalised misfit's products with these."""
        k, found = self.known.precision.size, []
        for product, (values, vectors) in zip(self.products, self.diagonal, strict=True):
            own = np.append(np.arange(k), k + values.size)
            found.append((product[np.ix_(own, own)], vectors.T @ product[k : k + values.size][:, own]))
        return tuple(found)

    def products_with(self, effect: WhiteEffects) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Per joint, products of [known, y] (k + 1, p) and of the diagonalised misfit (m, p) with columns."""
        return effect.products(self, lambda: self._products_with((effect,))[0])

    def keep_products_with(self, effects: Sequence[WhiteEffects]) -> None:
        """Those of many effects, made together: a product with a few columns reads all rows for each."""
        for start in range(0, len(effects), _TOGETHER):
            some = effects[start : start + _TOGETHER]
            for effect, products in zip(some, self._products_with(some), strict=True):
                effect.products(self, lambda made=products: made)  # type: ignore[misc]

    def _products_with(
        self, effects: Sequence[WhiteEffects]
    ) -> list[tuple[tuple[FloatArray, FloatArray], ...]]:
        k, none = self.known.precision.size, (np.zeros((0, 0)), np.zeros((0, 0)))
        found = [[none] * self.n for _ in effects]
        for j, (white, (_, vectors)) in enumerate(zip(self.white, self.diagonal, strict=True)):
            here = [number for number, effect in enumerate(effects) if effect.joints[j] is not None]
            if not here:
                continue
            whole = white.T @ side_by_side([effects[number] for number in here], j)
            outside, inner = np.delete(whole, np.s_[k:-1], axis=0), vectors.T @ whole[k:-1]
            cuts = np.cumsum([effects[number].count for number in here])[:-1]
            parts = zip(np.split(outside, cuts, axis=1), np.split(inner, cuts, axis=1), strict=True)
            for number, (first, second) in zip(here, parts, strict=True):
                found[number][j] = (first.copy(), second.copy())
        return [tuple(one) for one in found]

    @cached_property
    def precision(self) -> FloatArray:
        """(k,) of the known factors; next to none where there is no prior."""
        k = self.known.precision.size
        data = sum(np.diag(product)[:k] for product in self.products)
        flat = _FLAT * np.maximum(data, _NOTHING)
        return np.where(self.known.precision > 0.0, self.known.precision, flat)

    @cached_property
    def counts(self) -> tuple[int, ...]:
        """White rows of each joint."""
        return tuple(block.shape[0] for block in self.white)

    def thin(self, placed: PlacedEffect) -> FloatArray:
        """Columns of an effect, rows × joints × p."""
        return effect_rows(self.prepared, placed)

    def effect(self, placed: PlacedEffect, single: bool = False) -> WhiteEffects:
        """White columns of an effect, each in units of its parameter's prior deviation.

        Args:
            placed: the effect.
            single: whether columns are of half the size: a vocabulary has thousands. Their rounding, 10⁻⁷, is
                noise.
        """
        thin = self.thin(placed)
        scale = np.array(placed.scale)
        joints = tuple(
            whitener.effect(thin, j, scale, single, _NOTHING) for j, whitener in enumerate(self.whiteners)
        )
        bounds = np.array(placed.bounds) / scale[:, np.newaxis]
        unsaid = self._unsaid(thin) if placed.of_measured else 0.0
        return WhiteEffects(scale.size, joints, np.array(placed.centre) / scale, bounds, scale, unsaid)

    def _unsaid(self, thin: FloatArray) -> float:
        """Nats of rows whose torque the effect leaves open, by more than noise: anything up to the largest.

        Without them an effect that takes the measured torque for its column explains all by itself.
        """
        total = 0.0
        for j, noise in enumerate(self.noise):
            acts = (np.abs(thin[:, j]).max(axis=1) > noise.deviation) & self.prepared.used[:, j]
            if acts.any():
                open_to = float(np.abs(self.prepared.torque[acts, j]).max())
                total += int(acts.sum()) * max(float(np.log(open_to / noise.deviation)), 0.0)
        return total


def effect_rows(prepared: Prepared, effect: PlacedEffect) -> FloatArray:
    """Columns of an effect at the other periods' motion, rows × joints × p."""
    return np.concatenate([part.columns(effect) for part in prepared.parts])
