"""What a set predicts of recordings that were not fitted, and whether it came true.

With r the white rows of the validation that the set leaves and d what an effect changes of its prediction,
leaving the effect out adds

    Δ = ‖r + d‖² − ‖r‖² = ‖d‖² + 2 dᵀr

to the sum of squares. The posterior predicts ‖d‖² ± 2 σ with

    σ² = dᵀ (s² + Φ Φᵀ κ²/m + A Σ Aᵀ) d + Σ_j ‖d̃_j‖² N_j (s_j² − 1)

for noise, misfit, what is not known of the parameters, and the form's own error: what repeats at a joint and
is not smooth may all be that (a lag of 5 ms is not quite 5 ms times the torque's rate), and then it goes
along with d̃, what of d no smooth function has, on other motions, too. But for a joint where another member of
the set is rough, and d is of none that is: what a gear leaves that gives way is the gear's.

Of d the recordings show the share ½ (1 + Δ/‖d‖²), with the deviation σ/‖d‖². It is 1 where the effect is
what it is called, 0 where it is nothing, or what it is compared with, and anywhere between where it is
something that has no name: of what the nearest name says of other motion some is right.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ident.discrepancy.by_evidence.decide.left_over import residual_rows
from ident.discrepancy.by_evidence.decide.problem import Problem, misfit_basis
from ident.discrepancy.by_evidence.decide.state import Found, Member, rough_beside
from ident.discrepancy.by_evidence.evidence.known import known_columns
from ident.discrepancy.by_evidence.evidence.prepared import Prepared
from ident.discrepancy.by_evidence.evidence.rows import Rows, WhiteEffects
from ident.discrepancy.confirmation import Shown, shown_share
from ident.discrepancy.deviations import BLOCK
from robots.arrays import FloatArray, IntArray
from robots.identity_cache import IdentityCache

_DEPENDENT = 1e-9
"""Of the largest eigenvalue of ΦᵀΦ: a direction with less is none."""

_EFFECTS = 24
"""Whose columns are kept."""


@dataclass(frozen=True)
class Confirmation:
    """Of one effect of a set, in nats of the validation's rows.

    Attributes:
        predicted: ½ ‖d‖², what leaving it out should cost.
        deviation: of that.
        observed: what it costs.
    """

    predicted: float
    deviation: float
    observed: float

    @property
    def shown(self) -> Shown:
        """Of what the effect changes, how much is there."""
        if self.predicted <= 0.0:
            return Shown(0.0, 0.0)
        return Shown(0.5 * (1.0 + self.observed / self.predicted), 0.5 * self.deviation / self.predicted)


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Recordings that nothing was fitted to, as white rows."""

    problem: Problem
    rows: Rows
    made: IdentityCache[WhiteEffects] = field(default_factory=lambda: IdentityCache(_EFFECTS), repr=False)
    """Effects on these rows: each set that is compared with another asks for its own."""

    @classmethod
    def of(cls, problem: Problem, validation: Prepared) -> HeldOut:
        """Rows of a validation with the noise and the prior of the fit."""
        known, _ = known_columns(validation, problem.base, problem.prior, problem.start, problem.present)
        basis = misfit_basis(validation, problem.present)
        return cls(problem, Rows(validation, known, basis, problem.rows.noise))

    def confirmation(self, found: Found, other: Found) -> Confirmation:
        """Of what a set predicts otherwise than another one, which lacks an effect or has another for it."""
        k, others = self.rows.precision.size, self._effects(other)
        keys = [{member.candidate.key for member in one.members} for one in (found, other)]
        asked = [one for one in (*found.members, *other.members) if one.candidate.key in keys[0] ^ keys[1]]
        return self._confirmation(
            found, lambda j, white: _prediction(white[:, :k], others, j, _mean(other)), asked
        )

    def _confirmation(
        self, found: Found, instead: Callable[[int, FloatArray], FloatArray], asked: Sequence[Member]
    ) -> Confirmation:
        """Of what a set predicts otherwise than what is said instead, of a joint and its white rows.

        Args:
            found: the set.
            instead: of a joint and its white rows.
            asked: members that are in one of the two alone.
        """
        of_others = rough_beside(found, asked)
        k, own = self.rows.precision.size, self._effects(found)
        observed = predicted = variance = 0.0
        shown = np.zeros(found.posterior.covariance.shape[0])
        for j, white in enumerate(self.rows.white):
            with_it = _prediction(white[:, :k], own, j, _mean(found))
            change = with_it - instead(j, white)
            size = float(change @ change)
            predicted += size
            observed += size + 2.0 * float(change @ (white[:, -1] - with_it))
            excess = float(found.level.excess[j])
            smooth = self._smooth(j, change)
            variance += excess**2 * size + _of_misfit(found, j, smooth)
            if j not in of_others:
                variance += self._not_smooth(j, size, smooth) * change.size * (excess**2 - 1.0)
            shown += self._seen(found, j, change)
        variance += float(shown @ found.posterior.covariance @ shown)
        return Confirmation(0.5 * predicted, float(np.sqrt(variance)), 0.5 * observed)

    def _smooth(self, j: int, change: FloatArray) -> FloatArray:
        """(m,) products of a joint's smooth functions with a change of its rows, Φᵀd."""
        k, m = self.rows.precision.size, self.rows.misfit[j].shape[1]
        return np.asarray(self.rows.white[j][:, k : k + m].T @ change)

    def _not_smooth(self, j: int, size: float, smooth: FloatArray) -> float:
        """Energy of a change of a joint's rows that no smooth function has, of its size ‖d‖² and Φᵀd."""
        values, vectors = self.rows.diagonal[j]
        seen = values > _DEPENDENT * values.max(initial=0.0)
        along = vectors.T @ smooth
        return max(size - float(np.sum(along[seen] ** 2 / values[seen])), 0.0)

    def _seen(self, found: Found, j: int, change: FloatArray) -> FloatArray:
        """(k + p,) products of a set's columns with a change of a joint's rows."""
        known = self.rows.white[j][:, : self.rows.precision.size]
        parts = [known.T @ change]
        for effect in self._effects(found):
            columns = effect.joints[j]
            parts.append(np.zeros(effect.count) if columns is None else columns.T @ change)
        return np.asarray(np.concatenate(parts))

    def shown(self, found: Found, other: Found) -> Shown:
        """Of what a set predicts otherwise than another one, how much is there."""
        return self.confirmation(found, other).shown

    def alone(self, found: Found, number: int) -> Shown:
        """Of a member's own torque, all else as it is in the set, how much is there.

        A set without the member is fitted with other parameters, and they may make up for it: a change of
        viscous friction is in the model's own wherever the rows outweigh the prior. Then the two sets say
        the same of all motion, and nothing of the effect is seen in their difference.
        """
        k, own = self.rows.precision.size, self._effects(found)
        of_member = np.repeat(np.arange(len(own)), [one.count for one in own]) == number
        without = found.posterior.known, np.where(of_member, 0.0, found.posterior.theta)
        return self._confirmation(
            found, lambda j, white: _prediction(white[:, :k], own, j, without), [found.members[number]]
        ).shown

    def score(self, found: Found, excess: FloatArray) -> float:
        """Log likelihood of the rows as a set predicts them, nats, up to a constant.

        Args:
            found: the set.
            excess: (n,) s of each joint, the same for all sets that are compared.
        """
        k, own, total = self.rows.precision.size, self._effects(found), 0.0
        for j, white in enumerate(self.rows.white):
            left = white[:, -1] - _prediction(white[:, :k], own, j, _mean(found))
            total += float(left @ left) / float(excess[j]) ** 2
        return -0.5 * total

    def residual(self, found: Found) -> FloatArray:
        """Rows × joints, N·m (or N), that a set leaves of the torque."""
        return residual_rows(self.rows, found)

    def in_blocks(self, found: Found, other: Found, joint: int) -> Shown:
        """Of what a set changes of a joint's torque, how much is there.

        Its deviation is that over blocks of time, and what is the same in all of them: misfit, and what is
        not known of the set's parameters.
        """
        used, blocks = self.rows.prepared.used[:, joint], np.concatenate(self._blocks())
        left, with_it = (self.residual(one)[used, joint] for one in (other, found))
        shown = shown_share(left, with_it, blocks[used])
        if shown.of_nothing:
            return shown
        known = self.rows.white[joint][:, : self.rows.precision.size]
        change = _prediction(known, self._effects(found), joint, _mean(found))
        change = change - _prediction(known, self._effects(other), joint, _mean(other))
        # Rows are used here and there, and none with as many before it as the noise remembers.
        if not change.any():
            return Shown(0.0, 0.0)
        seen = self._seen(found, joint, change)
        variance = float(seen @ found.posterior.covariance @ seen)
        variance += _of_misfit(found, joint, self._smooth(joint, change))
        return Shown(shown.share, float(np.hypot(shown.sigma, np.sqrt(variance) / (change @ change))))

    def _blocks(self) -> list[IntArray]:
        """Per recording the block of time of each row; a place that repeats is in one block."""
        blocks: list[IntArray] = []
        for part in self.rows.prepared.parts:
            time, first = part.own.time, 1 + max((int(one.max()) for one in blocks), default=-1)
            assert time is not None
            since = np.asarray(time - time[0])[np.arange(part.rows) % (part.period or part.rows)]
            blocks.append(first + (since / BLOCK).astype(np.int64))
        return blocks

    def unexplained(self, found: Found) -> FloatArray:
        """(n,) share of the torque that a set leaves, beyond noise, where the joints move."""
        used, torque = self.rows.prepared.used, self.rows.prepared.torque
        left = self.residual(found)
        count = np.maximum(used.sum(axis=0), 1)
        level = np.sum(np.where(used, left, 0.0) ** 2, axis=0) / count
        noise = np.array([one.marginal**2 for one in self.rows.noise])
        power = np.sum(np.where(used, torque, 0.0) ** 2, axis=0) / count
        return np.asarray(np.sqrt(np.maximum(level - noise, 0.0) / np.maximum(power, 1e-300)))

    def _effects(self, found: Found) -> list[WhiteEffects]:
        placed = [member.entry.placed for member in found.members]
        return [self.made.of(one, partial(self.rows.effect, one)) for one in placed]


def _mean(found: Found) -> tuple[FloatArray, FloatArray]:
    """Known factors and θ of a set."""
    return found.posterior.known, found.posterior.theta


def _of_misfit(found: Found, j: int, smooth: FloatArray) -> float:
    """Variance of dᵀr by a joint's misfit, of Φᵀd."""
    kappa = float(found.level.kappa[j])
    return float(kappa**2 / max(smooth.size, 1) * (smooth @ smooth))


def _prediction(
    known: FloatArray, effects: Sequence[WhiteEffects], j: int, at: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """White rows of a joint as effects predict them with known factors and θ."""
    factors, theta = at
    total, start = known @ factors, 0
    for one in effects:
        columns = one.joints[j]
        if columns is not None:
            total = total + columns @ theta[start : start + one.count]
        start += one.count
    return np.asarray(total)
