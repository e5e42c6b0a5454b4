"""Drive gains from a known payload: loaded and unloaded captures, all drives at once (Gautier, Briot 2014).

Torque is only known through the gains, so gains and parameters can be told apart only up to one common
factor, unless something in the arm is known in SI units: a payload. With r_k = g_k / g⁰_k the true gain of
drive k over the described one, w_k = g⁰_k v_τk and c = 1/r, its rows are

    w_k = c_k · [T⁻ᵀ (X β + X_L φ_L)]_k + ε_k ,      X_L φ_L only where the payload φ_L is on.

What is known of the payload shifts the base vector: X_L φ_L = X · K φ_L. Gautier and Briot bring all
columns to one side and solve by total least squares, which takes the errors of all columns as equal. Here
they are not: v_τ carries the error of friction and of the current loop, the columns of the filtered motion
almost none. Ordinary least squares with the payload's torque as the only thing explained shrinks the gains,
since w, with its errors, is then a regressor. So errors stand where they arise, with a deviation of their own
per drive, and the rows, bilinear in c and β, are fitted by Gauss-Newton: weighted nonlinear least squares.

Friction and offsets may differ between loaded and unloaded captures: they drift with temperature by more than
the gains are off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.covariances import covariance_named, covariance_of, estimated_rows
from ident.errors import IdentificationError
from ident.estimators.fit import Stacked, stack
from ident.estimators.least_squares import joint_deviations, require_full_rank
from ident.parameters.base import BaseParameters
from ident.preparation.observation import Rows, observe
from ident.recording import Recording
from robots.arrays import BoolArray, FloatArray
from robots.description import Robot
from robots.payload import Payload
from robots.standard import LINK_SYMBOLS

_ITERATIONS = 50
_HALVINGS = 20
_STILL = 1e-3
"""Length of a step in units of σ at which the iteration has converged."""


_BELIEVED = 0.3
"""Relative deviation that the described gains are believed to have: it keeps a gain that nothing shows where
it is, and moves one that is seen to 1 % by a thousandth of what it is off."""

_NO_DRIVE = 0.6
"""A gain that is farther from the described one, as a share, is no drive's gain but a contradiction."""


@dataclass(frozen=True)
class DriveGain:
    """The gain of one drive.

    Attributes:
        drive: from 1.
        described: g_τ of the description, N·m (or N) per unit of the control signal.
        value: the identified one.
        sigma: its standard deviation, that of the payload included.
        described_uncertainty: of the description, as a share.
        payload_share: rms of the torque that the payload adds, as a share of that of the whole drive torque.
    """

    drive: int
    described: float
    value: float
    sigma: float
    described_uncertainty: float
    payload_share: float

    @property
    def relative_sigma(self) -> float:
        return self.sigma / abs(self.value)

    @property
    def change(self) -> float:
        """Identified over described gain, less one."""
        return self.value / self.described - 1.0

    @property
    def seen(self) -> bool:
        """Whether the captures say more of the gain than the description does."""
        return self.relative_sigma < self.described_uncertainty

    def sentence(self) -> str:
        """What to do with it, in words."""
        if self.seen:
            return f"changed by {100 * self.change:+.2f} %".replace("-", "−")
        return (
            f"not seen: known to {100 * self.described_uncertainty:.2g} % by the description, to"
            f" {100 * self.relative_sigma:.2g} % by the payload, which is {100 * self.payload_share:.2g} % of"
            " this drive's torque; keep the described gain"
        )


@dataclass(frozen=True)
class GainFit:
    """Drive gains and the base parameters that go with them.

    Attributes:
        gains: one per drive.
        covariance: (n, n) of the gains, the payload's uncertainty included.
        beta: (b,) base parameters of the unloaded arm at the identified gains, SI.
        relative_error_percent: of the drive torques, loaded and unloaded together.
        rows: number of rows.
        covariance_kind: what was assumed of the errors.
        iterations: of Gauss-Newton.
        converged: whether the gains stood still.
    """

    gains: tuple[DriveGain, ...]
    covariance: FloatArray
    beta: FloatArray
    relative_error_percent: float
    rows: int
    covariance_kind: str
    iterations: int
    converged: bool


def identify_drive_gains(
    base: BaseParameters,
    unloaded: tuple[Recording, ...],
    loaded: tuple[Recording, ...],
    payload: Payload,
) -> GainFit:
    """The gains of all drives from captures with and without a known payload.

    Args:
        base: the base parameters of the arm, whose description gives gains to start from.
        unloaded: captures without the payload.
        loaded: captures with it; the motions need not be the same, and both should excite all joints.
        payload: the body that was added.

    Raises:
        IdentificationError: captures of one kind are missing, they do not determine every parameter, or the
            iteration does not converge.
        PayloadError: the payload does not fit the arm.
    """
    if not unloaded or not loaded:
        missing = "without" if loaded else "with"
        raise IdentificationError(f"no capture {missing} the payload; allowed: at least one of each kind")
    rows = observe(base, (*unloaded, *loaded), base.model.robot.identification)
    return drive_gains_of_rows(base, rows, rows.segment >= len(unloaded), payload)


def drive_gains_of_rows(base: BaseParameters, rows: Rows, loaded: BoolArray, payload: Payload) -> GainFit:
    """The same from rows at the described gains.

    Args:
        base: the base parameters.
        rows: of all captures.
        loaded: (samples,) where the payload is on.
        payload: the body that was added.

    Raises:
        IdentificationError: the rows do not determine every parameter, or the iteration does not converge.
        PayloadError: the payload does not fit the arm.
    """
    robot = base.model.robot
    problem = _Problem.of(base, rows, loaded, payload)
    beta, inverse, sigma, iterations, converged = problem.solve()
    values = robot.gains / inverse
    if not converged or np.abs(values / robot.gains - 1.0).max() > _NO_DRIVE:
        raise IdentificationError(_contradiction(values / robot.gains))
    jacobian = problem.jacobian(beta, inverse)
    residual = problem.signal - problem.predicted(beta, inverse)
    kind = covariance_named(robot.identification.covariance)
    estimated = estimated_rows(jacobian, jacobian, residual, sigma, rows.segment, problem.used)
    covariance = covariance_of(estimated, kind)[-robot.n :, -robot.n :]
    believed = _BELIEVED**2 * np.eye(robot.n)
    covariance = covariance - covariance @ np.linalg.solve(covariance + believed, covariance)
    # g = g⁰ / c; and a payload heavier by a share makes every gain larger by that share.
    slope = np.diag(values / inverse)
    covariance = slope @ covariance @ slope
    covariance = covariance + payload.relative_uncertainty**2 * np.outer(values, values)
    return GainFit(
        gains=_gains(robot, values, np.sqrt(np.diag(covariance)), problem.payload_share(beta)),
        covariance=covariance,
        beta=beta[: base.independent.size],
        relative_error_percent=100.0 * problem.size(residual) / problem.size(problem.signal),
        rows=int(problem.used.sum()),
        covariance_kind=kind.describe(estimated),
        iterations=iterations,
        converged=converged,
    )


@dataclass(frozen=True)
class _Problem:
    """Rows of the drives: w = c ∘ (A β + d).

    Attributes:
        signal: samples × drives, w = g⁰ v_τ, N·m (or N).
        columns: samples × drives × P, A; friction has columns of its own where the payload is on.
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
    def of(cls, base: BaseParameters, rows: Rows, loaded: BoolArray, payload: Payload) -> _Problem:
        robot = base.model.robot
        to_drives = np.linalg.inv(robot.transmission_matrix.T)
        signal = rows.torque @ to_drives.T
        columns = np.einsum("kj,sjb->skb", to_drives, rows.regressor, optimize=True)
        added = np.zeros(base.relation.shape[1])
        added[: 10 * robot.n] = payload.parameters(robot)
        known = (columns @ (base.relation @ added)) * loaded[:, np.newaxis]
        needs = to_drives != 0.0
        used = np.stack([rows.used[:, row].all(axis=1) for row in needs], axis=1)
        apart = ~_inertial(base)
        columns = np.concatenate([columns, columns[:, :, apart] * loaded[:, np.newaxis, np.newaxis]], axis=2)
        names = (*base.names, *(f"{n} loaded" for n, a in zip(base.names, apart, strict=True) if a))
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
        believed = np.eye(beta.size + n)[-n:] / _BELIEVED
        for iteration in range(1, _ITERATIONS + 1):
            rows = self._stacked(self.signal - self.predicted(beta, inverse), self.jacobian(beta, inverse))
            weights = rows.spread(1.0 / sigma)
            x = rows.x * weights[:, np.newaxis]
            if iteration == 1:
                require_full_rank(x[:, :-n], self.names)
            x = np.concatenate([x, believed])
            y = np.concatenate([rows.y * weights, (1.0 - inverse) / _BELIEVED])
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
        rest = np.concatenate([y - x @ beta, (inverse - 1.0) / _BELIEVED])
        return np.asarray(beta), float(np.linalg.norm(rest))

    def _deviations(self, beta: FloatArray, inverse: FloatArray) -> FloatArray:
        rest = self.signal - self.predicted(beta, inverse)
        lost = (beta.size + inverse.size) / inverse.size
        squares = np.sum((rest * self.used) ** 2, axis=0)
        return np.asarray(np.sqrt(squares / (self.used.sum(axis=0) - lost)))

    def _stacked(self, values: FloatArray, columns: FloatArray) -> Stacked:
        none = np.zeros(values.shape[0])
        return stack(Rows(none, none.astype(np.int64), values, columns, self.used))


def _contradiction(ratio: FloatArray) -> str:
    worst = int(np.argmax(np.abs(ratio - 1.0)))
    return (
        f"the gain of drive {worst + 1} would be {ratio[worst]:.2g} times the described one; are the captures"
        " sorted into loaded and unloaded as they were made, and is the payload's mass right?"
    )


def _inertial(base: BaseParameters) -> BoolArray:
    """Which base parameters (b,) are inertial: those cannot differ between captures."""
    inertial = (*LINK_SYMBOLS, "Ia", "Iam")
    return np.array([parameter.is_usual(inertial) for parameter in base.leading])


def _gains(robot: Robot, values: FloatArray, sigma: FloatArray, share: FloatArray) -> tuple[DriveGain, ...]:
    return tuple(
        DriveGain(
            drive=k + 1,
            described=drive.gain,
            value=float(values[k]),
            sigma=float(sigma[k]),
            described_uncertainty=drive.gain_relative_uncertainty,
            payload_share=float(share[k]),
        )
        for k, drive in enumerate(robot.drive)
    )
