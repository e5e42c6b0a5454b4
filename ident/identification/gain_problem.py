"""The equations of the drives that their gains are fitted with, loaded and unloaded rows together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.estimators.fit import Stacked, stack
from ident.estimators.least_squares import joint_deviations, require_full_rank
from ident.parameters.base import BaseParameters
from ident.preparation.observation import Rows
from robots.arrays import BoolArray, FloatArray
from robots.payload import Payload
from robots.pseudo_inertia import LINK_SIZE
from robots.standard import LINK_SYMBOLS

BELIEVED = 0.3
"""Relative deviation that the described gains are believed to have: it keeps a gain that nothing shows where
it is, and moves one that is seen to 1 % by a thousandth of what it is off."""

_ITERATIONS = 50
_HALVINGS = 20
_DEPENDENT = 1e-9
_STILL = 1e-3
"""Length of a step in units of σ at which the iteration has converged."""


@dataclass(frozen=True)
class GainProblem:
    """Rows of the drives: w = c ∘ (A β + d).

    Attributes:
        signal: samples × drives, w = g⁰ v_τ, N·m (or N).
        columns: samples × drives × P, A; friction has columns of its own where the payload is on, and what
            is not known of the payload.
        known: samples × drives, d: the torque of the payload.
        used: samples × drives.
        names: (P,).
    """

    signal: FloatArray
    columns: FloatArray
    known: FloatArray
    used: BoolArray
    names: tuple[str, ...]

    @classmethod
    def of(cls, base: BaseParameters, rows: Rows, loaded: BoolArray, payload: Payload) -> GainProblem:
        robot = base.model.robot
        to_drives = np.linalg.inv(robot.transmission_matrix.T)
        signal = rows.torque @ to_drives.T
        columns = np.einsum("kj,sjb->skb", to_drives, rows.regressor, optimize=True)
        load = payload.load(robot)
        first = LINK_SIZE * load.link
        of_link = base.relation[:, first : first + LINK_SIZE]
        known = (columns @ (of_link @ load.ten)) * loaded[:, np.newaxis]
        needs = to_drives != 0.0
        used = np.stack([rows.used[:, row].all(axis=1) for row in needs], axis=1)
        apart = ~_inertial(base)
        unknown = columns @ _directions(of_link[:, list(load.unknown)])
        columns = np.concatenate([columns, columns[:, :, apart] * loaded[:, np.newaxis, np.newaxis]], axis=2)
        names = (*base.names, *(f"{n} loaded" for n, a in zip(base.names, apart, strict=True) if a))
        columns = np.concatenate([columns, unknown * loaded[:, np.newaxis, np.newaxis]], axis=2)
        names = (*names, *(f"payload {k + 1}" for k in range(unknown.shape[2])))
        return cls(signal, columns, known, used, names)

    def predicted(self, beta: FloatArray, inverse: FloatArray) -> FloatArray:
        """w, samples × drives."""
        return np.asarray((self.columns @ beta + self.known) * inverse)

    def jacobian(self, beta: FloatArray, inverse: FloatArray) -> FloatArray:
        """Slope of w over β and c, samples × drives × (P + n)."""
        n = inverse.size
        by_gain = np.zeros((*self.signal.shape, n))
        drives = np.arange(n)
        by_gain[:, drives, drives] = self.columns @ beta + self.known
        return np.concatenate([self.columns * inverse[:, np.newaxis], by_gain], axis=2)

    def solve(self) -> tuple[FloatArray, FloatArray, FloatArray, int, bool]:
        """β, c, σ per drive, iterations and whether they converged, from the described gains.

        β is solved for anew with each c, so that only the few gains are searched for.
        """
        n = self.signal.shape[1]
        inverse = np.ones(n)
        sigma = joint_deviations(self._stacked(self.signal, self.columns))
        beta, size = self._given_gains(inverse, sigma)
        believed = np.eye(beta.size + n)[-n:] / BELIEVED
        for iteration in range(1, _ITERATIONS + 1):
            rows = self._stacked(self.signal - self.predicted(beta, inverse), self.jacobian(beta, inverse))
            weights = rows.spread(1.0 / sigma)
            x = rows.x * weights[:, np.newaxis]
            if iteration == 1:
                require_full_rank(x[:, :-n], self.names)
            x = np.concatenate([x, believed])
            y = np.concatenate([rows.y * weights, (1.0 - inverse) / BELIEVED])
            full = np.linalg.lstsq(x, y, rcond=None)[0]
            if float(np.linalg.norm(x @ full)) < _STILL:
                return beta, inverse, sigma, iteration, True
            step = full[-n:]
            for _ in range(_HALVINGS):
                trial = inverse + step
                beta, fresh = self._given_gains(trial, sigma)
                if fresh <= size and (trial > 0.0).all():
                    break
                step = 0.5 * step
            else:
                return beta, inverse, sigma, iteration, False
            inverse = trial
            sigma = self._deviations(beta, inverse)
            beta, size = self._given_gains(inverse, sigma)
        return beta, inverse, sigma, _ITERATIONS, False

    def payload_share(self, beta: FloatArray) -> FloatArray:
        """rms of the payload's torque over that of the whole, on loaded rows, (n,)."""
        whole = self.columns @ beta + self.known
        on = self.used & (self.known != 0.0).any(axis=1, keepdims=True)
        return np.asarray(np.linalg.norm(self.known * on, axis=0) / np.linalg.norm(whole * on, axis=0))

    def size(self, values: FloatArray) -> float:
        """Norm of samples × drives over the rows that are used."""
        return float(np.linalg.norm(values[self.used]))

    def _given_gains(self, inverse: FloatArray, sigma: FloatArray) -> tuple[FloatArray, float]:
        """β of these gains, and the norm of the weighted residual with what the description says of them."""
        rows = self._stacked(self.signal - self.known * inverse, self.columns * inverse[:, np.newaxis])
        weights = rows.spread(1.0 / sigma)
        x, y = rows.x * weights[:, np.newaxis], rows.y * weights
        beta = np.linalg.lstsq(x, y, rcond=None)[0]
        rest = np.concatenate([y - x @ beta, (inverse - 1.0) / BELIEVED])
        return np.asarray(beta), float(np.linalg.norm(rest))

    def _deviations(self, beta: FloatArray, inverse: FloatArray) -> FloatArray:
        rest = self.signal - self.predicted(beta, inverse)
        lost = (beta.size + inverse.size) / inverse.size
        squares = np.sum((rest * self.used) ** 2, axis=0)
        return np.asarray(np.sqrt(squares / (self.used.sum(axis=0) - lost)))

    def _stacked(self, values: FloatArray, columns: FloatArray) -> Stacked:
        none = np.zeros(values.shape[0])
        return stack(Rows(none, none.astype(np.int64), values, columns, self.used))


def _directions(of_unknown: FloatArray) -> FloatArray:
    """(b, d) orthonormal: what the unknown figures of the payload can do to the base parameters (b, k)."""
    if not of_unknown.size:
        return of_unknown
    left, values, _ = np.linalg.svd(of_unknown, full_matrices=False)
    return np.asarray(left[:, values > _DEPENDENT * values[0]])


def _inertial(base: BaseParameters) -> BoolArray:
    """Which base parameters (b,) are inertial: those cannot differ between captures."""
    inertial = (*LINK_SYMBOLS, "Ia", "Iam")
    return np.array([parameter.is_usual(inertial) for parameter in base.leading])
