"""What an identification returns: small frozen values, nothing that computes.

Symbols are those of the paper: β̂ with its covariance Σ̂ (eq. 7), y (r×1), X (r×b).
Arrays over time are samples × joints.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ident.effects.entry import EffectEntry
from ident.effects.family import StandardParameter
from ident.verdicts import Gate, RevisedTest
from robots.arrays import FloatArray

Estimator = str
"""A key of ``ident.estimators.ESTIMATORS``."""
Method = str
"""The same, or ``auto``: least squares and IV are computed and the revised test chooses."""


@dataclass(frozen=True)
class Parameter:
    """One estimated base parameter with its standard deviation, SI units."""

    name: str
    value: float
    sigma: float
    unit: str
    expression: str
    """The regrouping relation, e.g. ``ZZ1 + Ia1 + YY2``."""
    leading: StandardParameter
    """The first of those in the relation, which it is named after."""
    half_width: float | None = None
    """Half of the interval that covers 95 %, timing and reversals included; None where not computed."""

    @property
    def percent_sigma(self) -> float:
        """100·σ/|β|, the field's measure of how well a parameter is seen."""
        return 100.0 * self.sigma / abs(self.value) if self.value else float("inf")

    @property
    def t_value(self) -> float:
        """β/σ: how many deviations the estimate is from zero."""
        return self.value / self.sigma if self.sigma else float("inf")


@dataclass(frozen=True)
class Estimate:
    """One estimator's answer on one set of rows."""

    method: Estimator
    parameters: tuple[Parameter, ...]
    covariance: FloatArray
    covariance_kind: str
    condition: float
    relative_error_percent: float
    relative_error_percent_per_joint: FloatArray
    torque_rms: FloatArray
    """rms of the torque residual per joint, N·m (or N)."""
    lag1_autocorrelation: FloatArray
    iterations: int
    converged: bool = True

    @property
    def values(self) -> FloatArray:
        """β̂, shape (b,)."""
        return np.array([parameter.value for parameter in self.parameters])


@dataclass(frozen=True)
class TorqueTrace:
    """Measured and predicted joint torque on the rows of the fit, for pictures."""

    time: FloatArray
    measured: FloatArray
    predicted: FloatArray


@dataclass(frozen=True)
class WorstJoint:
    """The joint (from 0) of which an estimate leaves most, in % of its torque, and what that goes with.

    ``share`` of what is left goes with ``quantity``, of joint ``of`` where it is another's; else empty, 0.
    """

    joint: int
    error_percent: float
    quantity: str = ""
    of: int | None = None
    share: float = 0.0


@dataclass(frozen=True)
class Rank:
    """Structural rank beside that of the data.

    Attributes:
        structural: number of base parameters.
        data: directions of the scaled observation matrix that stand out of the noise of its own columns.
        smallest: smallest singular value of the columns, scaled to unit norm.
        noise_level: the value below which a direction counts as noise.
        unseen: parameters that take part in directions that do not stand out.
        reasons: which joints stand still or are too slow to show them.
        one_way: joints, from 1, that move in one direction only and have no offset beside dry friction.
    """

    structural: int
    data: int
    smallest: float
    noise_level: float
    unseen: tuple[str, ...] = ()
    reasons: tuple[str, ...] = ()
    one_way: tuple[int, ...] = ()


@dataclass(frozen=True)
class Signals:
    """What the data say of the settings that make rows of them; per joint where not of the whole arm.

    Attributes:
        cutoff_hz: low-pass of the positions that was used.
        proposed_cutoff_hz: from the spectrum of the positions.
        position_noise: (n,) deviation of a position sample, rad (or m).
        quantum: (n,) smallest step of each drive output, rad (or m); nan where there is none.
        friction_width: of tanh(q̇/width) that was used, rad/s (or m/s).
        proposed_friction_width: the narrowest that noise does not swing at standstill.
        lag: of the control signal that was used, s.
        estimated_lag: from the data, s; None where none could be found.
        lag_sigma: its deviation, s; None with it.
    """

    cutoff_hz: float
    proposed_cutoff_hz: float
    position_noise: FloatArray
    quantum: FloatArray
    friction_width: float
    proposed_friction_width: float
    lag: float
    estimated_lag: float | None
    lag_sigma: float | None


@dataclass(frozen=True)
class HeldOut:
    """How an estimate predicts a recording that it was not fitted to.

    Attributes:
        recording: name.
        method: the estimate.
        rows: that were compared.
        relative_error_percent: 100·‖y − Xβ̂‖/‖y‖ over all joints, N·m (or N).
        relative_error_percent_per_joint: (n,).
        torque_rms: (n,) of y − Xβ̂, N·m (or N).
    """

    recording: str
    method: Estimator
    rows: int
    relative_error_percent: float
    relative_error_percent_per_joint: FloatArray
    torque_rms: FloatArray


@dataclass(frozen=True)
class DroppedParameter:
    """A parameter that the data do not need, or the first that they do."""

    name: str
    percent_sigma: float
    statistic: float
    df: tuple[float, float]
    p_value: float


@dataclass(frozen=True)
class Essential:
    """The essential parameters by F-test: those kept with value and deviation, those dropped in order."""

    parameters: tuple[Parameter, ...]
    dropped: tuple[DroppedParameter, ...]
    refused: DroppedParameter | None
    errors: str


@dataclass(frozen=True)
class Link:
    """One link of the physically consistent model, in the link's frame.

    Attributes:
        name: in the URDF.
        mass: kg.
        center: (3,) centre of mass, m.
        margin: smallest eigenvalue of the pseudo-inertia relative to the prior's: 1 for the prior itself, 0
            at the edge of what a body can be.
        at_limit: whether it lies at that edge.
        impossible_before: whether the unconstrained estimate makes a body of it that cannot exist.
    """

    name: str
    mass: float
    center: FloatArray
    margin: float
    at_limit: bool
    impossible_before: bool


@dataclass(frozen=True)
class Consistency:
    """How far the nearest arm that can exist lies from the unconstrained estimate.

    Attributes:
        nearest_to: the estimate that it is nearest to, that of the verdict.
        distance: (β − β̂)ᵀ XᵀΩ⁻¹X (β − β̂).
        expected_distance: what errors alone make of it where the true arm is consistent, at most.
        p_value: probability of at least this distance then; a small one speaks against the model.
        residual_change_percent: by how much the whitened torque residual grows, in norm.
        limits: links and drive parameters that hold the fit back.
        links: from base to tip.
        standard: (p,) standard parameters by name, SI.
        sentence: all that in words.
    """

    nearest_to: Estimator
    distance: float
    expected_distance: float
    p_value: float
    residual_change_percent: float
    limits: tuple[str, ...]
    links: tuple[Link, ...]
    standard: dict[str, float]
    sentence: str


@dataclass(frozen=True)
class Identification:
    """Everything ``armhil identify`` reports of one arm on some captures."""

    robot: str
    rows: int
    by_estimator: Mapping[str, Estimate]
    """Every estimate that was computed; least squares always."""
    instrumental_reason: str
    """Why there is no IV estimate; empty where there is one."""
    test: RevisedTest
    textbook: Gate | None
    trace: TorqueTrace
    warnings: tuple[str, ...] = ()
    method: Method = "auto"
    consistency: Consistency | None = None
    rank: Rank | None = None
    signals: Signals | None = None
    held_out: tuple[HeldOut, ...] = ()
    essential: Essential | None = None
    found: tuple[EffectEntry, ...] = ()
    """Effects that a diagnosis had found and that are part of the model, beside the usual ones."""
    impossible: tuple[str, ...] = ()
    """What no arm can have and this estimate has: it must not be trusted, whatever the tests say."""
    worst: WorstJoint | None = None

    @property
    def trusted(self) -> bool:
        """Whether nothing speaks against the model: no test, and no value that no arm can have."""
        return self.test.verdict != "instruments_invalid" and not self.impossible

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """All that were computed, least squares first."""
        return tuple(self.by_estimator.values())

    @property
    def least_squares(self) -> Estimate:
        """IDIM-LS (eq. 7)."""
        return self.by_estimator["ls"]

    @property
    def instrumental(self) -> Estimate | None:
        """IDIM-IV; None where there are no instruments."""
        return self.by_estimator.get("iv")

    def with_estimates(self, *estimates: Estimate) -> Identification:
        """The same with further estimates, or others in the place of those of their kind."""
        return replace(self, by_estimator={**self.by_estimator, **{e.method: e for e in estimates}})

    @property
    def recommended(self) -> Estimate:
        """The estimate of the method that was asked for; with ``auto`` that of the verdict."""
        return self.by_estimator.get(self.method, self.of_verdict)

    @property
    def of_verdict(self) -> Estimate:
        """The estimate that the verdict tells to use, least squares where it tells to use none."""
        if self.test.verdict == "endogenous" and self.instrumental is not None:
            return self.instrumental
        return self.least_squares
