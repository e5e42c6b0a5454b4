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
from ident.identification.gain_problem import BELIEVED, GainProblem
from ident.parameters.base import BaseParameters
from ident.preparation.observation import Rows, observe
from ident.recording import Recording
from robots.arrays import BoolArray, FloatArray
from robots.description import Robot
from robots.payload import Payload

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
    problem = GainProblem.of(base, rows, loaded, payload)
    beta, inverse, sigma, iterations, converged = problem.solve()
    values = robot.gains / inverse
    if not converged or np.abs(values / robot.gains - 1.0).max() > _NO_DRIVE:
        raise IdentificationError(_contradiction(values / robot.gains))
    jacobian = problem.jacobian(beta, inverse)
    residual = problem.signal - problem.predicted(beta, inverse)
    kind = covariance_named(robot.identification.covariance)
    estimated = estimated_rows(jacobian, jacobian, residual, sigma, rows.segment, problem.used)
    covariance = covariance_of(estimated, kind)[-robot.n :, -robot.n :]
    believed = BELIEVED**2 * np.eye(robot.n)
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


def _contradiction(ratio: FloatArray) -> str:
    worst = int(np.argmax(np.abs(ratio - 1.0)))
    return (
        f"the gain of drive {worst + 1} would be {ratio[worst]:.2g} times the described one; are the captures"
        " rightly told into loaded and unloaded, and is the payload's mass right?"
    )


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
