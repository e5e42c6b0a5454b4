"""From fits to results: what is said of each estimate, on the fitted rows and on others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ident.errors import IdentificationError
from ident.estimators import LinearFit, Stacked, stack
from ident.listing import listed
from ident.parameters.base import BaseParameters
from ident.preparation.observation import Rows, observe
from ident.recording import Recording
from ident.results import (
    Consistency,
    DroppedParameter,
    Essential,
    Estimate,
    Estimator,
    HeldOut,
    Identification,
    Link,
    Parameter,
    Rank,
    TorqueTrace,
)
from ident.statistics.whitening import lag1_autocorrelation
from robots.arrays import FloatArray

if TYPE_CHECKING:
    from ident.estimators import Dropped, EssentialFit
    from ident.estimators.consistent import ConsistentFit

_POORLY_SEEN = 0.3
_LEVEL = 0.05
_NOTHING = 100.0
"""% of the torque that a model of nothing leaves."""
_NEGATIVE = 3.0
"""Deviations below zero from which on a rotor inertia is not zero by chance."""
_IMPOSSIBLE = 5.0
"""Deviations below zero from which on a friction or a rotor is taken for negative."""


def estimate_of(
    method: Estimator,
    base: BaseParameters,
    stacked: Stacked,
    fit: LinearFit,
    half_width: FloatArray | None = None,
) -> Estimate:
    """Values, deviations, intervals where they are given (b,), and how well the rows are fitted."""
    residuals = stacked.split(stacked.y - stacked.x @ fit.beta)
    error, per_joint, rms = _errors(stacked, residuals)
    deviation = np.sqrt(np.diag(fit.covariance))
    return Estimate(
        method=method,
        parameters=_parameters(base, base.names, fit.beta, deviation, half_width),
        covariance=fit.covariance,
        covariance_kind=fit.covariance_kind,
        condition=fit.condition,
        relative_error_percent=error,
        relative_error_percent_per_joint=per_joint,
        torque_rms=rms,
        lag1_autocorrelation=np.array([lag1_autocorrelation(e) for e in residuals]),
        iterations=fit.iterations,
        converged=fit.converged,
    )


def held_out(
    base: BaseParameters, estimates: Sequence[Estimate], recordings: tuple[Recording, ...]
) -> tuple[HeldOut, ...]:
    """How each estimate predicts the torques of recordings that it was not fitted to.

    Args:
        base: the parameters.
        estimates: fitted to other recordings.
        recordings: to predict; their rows are made as those of the fit.

    Raises:
        IdentificationError: a recording does not fit the arm, or is too short.
    """
    found = []
    for recording in recordings:
        stacked = stack(observe(base, (recording,), base.model.robot.identification))
        for estimate in estimates:
            residuals = stacked.split(stacked.y - stacked.x @ estimate.values)
            error, per_joint, rms = _errors(stacked, residuals)
            found.append(HeldOut(recording.name, estimate.method, stacked.y.size, error, per_joint, rms))
    return tuple(found)


def with_consistent(
    result: Identification, base: BaseParameters, stacked: Stacked, fit: ConsistentFit
) -> Identification:
    """A result with the nearest arm that can exist; a warning where the data speak against every such arm."""
    links = tuple(
        Link(b.name, b.mass, b.center, b.margin, b.at_limit, b.impossible_before) for b in fit.bodies
    )
    change = fit.residual_change_percent
    assert change is not None  # the rows were given
    consistency = Consistency(
        nearest_to=result.of_verdict.method,
        distance=fit.distance,
        expected_distance=fit.expected_distance,
        p_value=fit.p_value,
        residual_change_percent=change,
        limits=fit.limits,
        links=links,
        standard=dict(zip(base.model.names, fit.standard.tolist(), strict=True)),
        sentence=fit.sentence(),
    )
    doubts = (f"no arm that can exist fits as well: {fit.sentence()}",) if fit.p_value < _LEVEL else ()
    return replace(
        result.with_estimates(estimate_of("consistent", base, stacked, fit)),
        consistency=consistency,
        warnings=(*result.warnings, *doubts),
    )


def _errors(stacked: Stacked, residuals: list[FloatArray]) -> tuple[float, FloatArray, FloatArray]:
    """Relative error in all and per joint, %, and rms per joint, N·m (or N)."""
    sizes = np.array([np.linalg.norm(e) for e in residuals])
    torques = np.array([np.linalg.norm(y) for y in stacked.split(stacked.y)])
    rms = sizes / np.sqrt([e.size for e in residuals])
    return float(100 * np.linalg.norm(sizes) / np.linalg.norm(torques)), 100 * sizes / torques, rms


def essential_of(base: BaseParameters, rows: Rows) -> Essential:
    """The parameters that the data need, by F-test on prewhitened rows."""
    from ident.estimators import essential_parameters  # few ask for it

    fit = essential_parameters(rows, base.names)
    deviation = np.sqrt(np.diag(fit.covariance))
    return Essential(
        _parameters(base, fit.names, fit.beta, deviation),
        tuple(_dropped(parameter) for parameter in fit.dropped),
        _refused(fit),
        fit.errors,
    )


def _refused(fit: EssentialFit) -> DroppedParameter | None:
    return None if fit.refused is None else _dropped(fit.refused)


def _dropped(parameter: Dropped) -> DroppedParameter:
    return DroppedParameter(
        parameter.name, parameter.percent_sigma, parameter.statistic, parameter.df, parameter.p_value
    )


def _parameters(
    base: BaseParameters,
    names: Sequence[str],
    values: FloatArray,
    deviation: FloatArray,
    half_width: FloatArray | None = None,
) -> tuple[Parameter, ...]:
    known = {n: (p.unit, e, p) for n, p, e in zip(base.names, base.leading, base.expressions, strict=True)}
    halves = [None] * len(values) if half_width is None else half_width.tolist()
    return tuple(
        Parameter(name, float(value), float(sigma), *known[name], half)
        for name, value, sigma, half in zip(names, values, deviation, halves, strict=True)
    )


def trace_of(rows: Rows, beta: FloatArray) -> TorqueTrace:
    """Measured and predicted torque of all rows, those left out included."""
    return TorqueTrace(rows.time, rows.torque, rows.predicted(beta))


def poorly_seen(estimate: Estimate) -> tuple[str, ...]:
    """A sentence on the parameters with a large %σ; none where there is none."""
    poor = [p.name for p in estimate.parameters if p.sigma > _POORLY_SEEN * abs(p.value)]
    return (f"seen with more than 30 % σ: {listed(poor)}",) if poor else ()


def refuse_nothing_explained(estimate: Estimate, rank: Rank) -> None:
    """Refuse a fit that is none: it leaves more than there was, rests on no direction, or is without error.

    Raises:
        IdentificationError: says which.
    """
    if rank.data == 0:
        raise IdentificationError(
            f"the motion shows none of {rank.structural} parameters above the noise of the positions;"
            " look for jumps in the positions, and for the cut-off"
        )
    if estimate.relative_error_percent >= _NOTHING:
        raise IdentificationError(
            f"the model leaves {estimate.relative_error_percent:.3g} % of the torque, no model leaves 100 %:"
            " are positions and torques of the same motion and joints?"
        )
    exact = [p.name for p in estimate.parameters if not p.sigma > 0.0]
    if exact:
        raise IdentificationError(
            f"{exact[0]} comes out without any error (σ 0): was the torque computed from the motion?"
        )


def not_of_a_rotor(estimate: Estimate) -> tuple[tuple[str, ...], bool]:
    """A sentence on rotor inertias below zero by more than errors explain, none where there is none.

    The second is whether one is so by so much that the model must not be trusted.
    """
    found = [p for p in estimate.parameters if p.leading.symbol == "Ia" and p.value < -_NEGATIVE * p.sigma]
    if not found:
        return (), False
    named = listed([f"{p.name} by {-p.t_value:.3g} σ" for p in found], few=3)
    words = f"rotor inertia below zero ({named}): no rotor has it, so the model lacks something"
    words += ", or the torque is of sensors at the links (--torque-sensors)"
    return (words,), any(p.value < -_IMPOSSIBLE * p.sigma for p in found)


def refuse_negative_friction(estimate: Estimate, joints: int) -> None:
    """Refuse a joint that friction drives: its control signal or its position has the wrong sign.

    Raises:
        IdentificationError: names the joints.
    """
    by_name = {p.leading.name: p for p in estimate.parameters}
    pairs = (("Fv", "Fc"), ("Fvp", "Fcp"), ("Fvn", "Fcn"))
    wrong = []
    for joint in range(1, joints + 1):
        found = [[by_name.get(f"{symbol}{joint}") for symbol in pair] for pair in pairs]
        if any(all(p is not None and p.value < -_IMPOSSIBLE * p.sigma for p in pair) for pair in found):
            wrong.append(joint)
    if wrong:
        named = f"joint {wrong[0]}" if len(wrong) == 1 else f"joints {', '.join(map(str, wrong))}"
        raise IdentificationError(
            f"{named}: viscous and Coulomb friction come out negative, so friction would drive the motion;"
            " is the sign of the control signal or of the position turned?"
        )
