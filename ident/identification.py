"""The whole method in order: rows, IDIM-LS, closed-loop simulation, IDIM-IV, revised test."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ident.base import BaseParameters, base_parameters
from ident.closed_loop import SimulatedRun, simulate
from ident.covariances import covariance_named, covariance_of, estimated_rows
from ident.errors import IdentificationError
from ident.estimators import (
    LinearFit,
    Stacked,
    instrumental_variables,
    stack,
    weighted_least_squares,
)
from ident.estimators.fit import stack_columns
from ident.exogeneity import (
    GateSettings,
    TestedRows,
    not_testable,
    revised_test,
    simulation_agreement,
    textbook_test,
)
from ident.observation import Rows, observe, observed_columns
from ident.recording import Recording
from ident.regressor import RegressorModel
from ident.restricted import regression_whitening
from ident.results import Estimate, Gate, Identification, Parameter, RevisedTest, TorqueTrace
from ident.whitening import lag1_autocorrelation
from robots.arrays import FloatArray
from robots.description import Robot

Progress = Callable[[str, float], None]
"""Called with a step in words and the share of the whole that is done, 0 to 1."""

_ITERATIONS = 10
_STILL = 1e-3
"""Relative change of the residual norm, and of β̂ in units of its σ × 10, at which IDIM-IV has converged."""

_LEVEL = 0.05


@dataclass(frozen=True)
class Fitted:
    """A model with its rows and fits: what the report, the model file and the search go on from."""

    base: BaseParameters
    rows: Rows
    least_squares: LinearFit
    instrumental: LinearFit | None
    result: Identification


@dataclass(frozen=True)
class Instruments:
    """The simulated columns, samples × joints × b, and the runs that they are made of."""

    columns: FloatArray
    runs: tuple[SimulatedRun, ...]


def _silent(step: str, share: float) -> None:
    """Nobody watches."""


def identify(robot: Robot, recordings: tuple[Recording, ...], progress: Progress = _silent) -> Fitted:
    """Identify an arm from recordings and say whether the result can be trusted.

    Args:
        robot: the arm; its ``identification`` settings rule filter and decimation.
        recordings: one or more; a reference in each is what makes instruments possible.
        progress: called between the steps.

    Raises:
        IdentificationError: the recordings do not fit the arm, are too short, or excite too little.
    """
    progress("base parameters", 0.0)
    base = base_parameters(RegressorModel.of(robot))
    progress("observation matrix", 0.1)
    rows = observe(base, recordings, robot.identification)
    stacked = stack(rows)
    progress("least squares", 0.3)
    settings = robot.identification
    least_squares = weighted_least_squares(stacked, base.names, settings.error_deviation)
    least_squares = _with_covariance(rows, least_squares, rows.regressor, settings.covariance)
    instruments, instrumental, reason = _instrumental(
        base, recordings, rows, stacked, least_squares, progress
    )
    if instruments is not None and instrumental is not None:
        instrumental = _with_covariance(rows, instrumental, instruments.columns, settings.covariance)
    progress("revised Durbin-Wu-Hausman test", 0.9)
    test, textbook = _test(base, recordings, rows, least_squares, instruments, instrumental, reason)
    result = Identification(
        robot=robot.name,
        rows=rows.count,
        least_squares=_estimate("ls", base, stacked, least_squares),
        instrumental=_estimate("iv", base, stacked, instrumental) if instrumental else None,
        instrumental_reason=reason,
        test=test,
        textbook=textbook,
        trace=_trace(rows, least_squares.beta),
        warnings=_warnings(base, least_squares),
    )
    progress("done", 1.0)
    return Fitted(base, rows, least_squares, instrumental, result)


def _with_covariance(rows: Rows, fit: LinearFit, instruments: FloatArray, name: str) -> LinearFit:
    """The same estimate with the covariance of the arm's settings; LS is IV with X as its own instruments."""
    if name == "block":  # the estimators' own
        return fit
    kind = covariance_named(name)
    residual = rows.torque - rows.regressor @ fit.beta
    estimated = estimated_rows(rows.regressor, instruments, residual, fit.sigma, rows.segment, rows.used)
    return replace(fit, covariance=covariance_of(estimated, kind), covariance_kind=kind.describe(estimated))


def _instrumental(
    base: BaseParameters,
    recordings: tuple[Recording, ...],
    rows: Rows,
    stacked: Stacked,
    start: LinearFit,
    progress: Progress,
) -> tuple[Instruments | None, LinearFit | None, str]:
    """Instruments and IDIM-IV fit, or the reason why there are none."""
    if any(recording.reference is None for recording in recordings):
        return None, None, "no position reference was recorded, so the loop cannot be simulated"
    try:
        return (*_iterate(base, recordings, rows, stacked, start, progress), "")
    except IdentificationError as error:
        return None, None, str(error)


def _iterate(
    base: BaseParameters,
    recordings: tuple[Recording, ...],
    rows: Rows,
    stacked: Stacked,
    start: LinearFit,
    progress: Progress,
) -> tuple[Instruments, LinearFit]:
    """Simulate with β̂, rebuild Z, solve, until β̂ and the residual norm stand still (METHOD 4)."""
    prior = base.model.prior()
    fit, norm = start, _residual_norm(stacked, start)
    for iteration in range(1, _ITERATIONS + 1):
        progress(f"closed-loop simulation {iteration}", 0.3 + 0.6 * min(1.0, iteration / 4))
        instruments = _simulated(base, base.standard_from(fit.beta, prior), recordings)
        try:
            fresh = instrumental_variables(stacked, stack_columns(instruments.columns, rows.used), fit.sigma)
        except np.linalg.LinAlgError as error:
            raise IdentificationError("the simulated motion does not excite every parameter") from error
        fresh_norm = _residual_norm(stacked, fresh)
        moved = float(np.max(np.abs(fresh.beta - fit.beta) / np.sqrt(np.diag(fresh.covariance))))
        still = iteration > 1 and moved < 10 * _STILL and abs(fresh_norm - norm) < _STILL * norm
        fit = replace(fresh, iterations=iteration, converged=still)
        norm = fresh_norm
        if still:
            break
    return instruments, fit


def _simulated(base: BaseParameters, standard: FloatArray, recordings: tuple[Recording, ...]) -> Instruments:
    settings = base.model.robot.identification
    runs = tuple(simulate(base.model, standard, recording) for recording in recordings)
    parts = [observed_columns(base, run.time, run.position, settings) for run in runs]
    return Instruments(np.concatenate(parts), runs)


def _residual_norm(stacked: Stacked, fit: LinearFit) -> float:
    return float(np.linalg.norm(stacked.y - stacked.x @ fit.beta))


def _test(
    base: BaseParameters,
    recordings: tuple[Recording, ...],
    rows: Rows,
    least_squares: LinearFit,
    instruments: Instruments | None,
    instrumental: LinearFit | None,
    reason: str,
) -> tuple[RevisedTest, Gate | None]:
    if instruments is None or instrumental is None:
        whitening = regression_whitening(rows.torque, rows.regressor, rows.segment, rows.used)
        return not_testable(reason, whitening.describe()), None
    robot = base.model.robot
    margins = robot.identification
    settings = GateSettings(
        _LEVEL, margins.instrument_margin, margins.torque_margin, margins.following_error_margin
    )
    shift = (least_squares.beta - instrumental.beta) / np.sqrt(np.diag(least_squares.covariance))
    tested = TestedRows(rows.torque, rows.regressor, instruments.columns, rows.segment, rows.used)
    agreement = simulation_agreement(robot, recordings, instruments.runs)
    revised = revised_test(tested, base.names, shift, settings, agreement)
    return revised, textbook_test(tested.whitened(tested.omega()), _LEVEL)


def _estimate(method: str, base: BaseParameters, stacked: Stacked, fit: LinearFit) -> Estimate:
    residuals = stacked.split(stacked.y - stacked.x @ fit.beta)
    sizes = np.array([np.linalg.norm(e) for e in residuals])
    torques = np.array([np.linalg.norm(y) for y in stacked.split(stacked.y)])
    deviation = np.sqrt(np.diag(fit.covariance))
    named = zip(base.names, fit.beta, deviation, base.units, base.expressions, strict=True)
    return Estimate(
        method="iv" if method == "iv" else "ls",
        parameters=tuple(Parameter(n, float(v), float(s), u, e) for n, v, s, u, e in named),
        covariance=fit.covariance,
        covariance_kind=fit.covariance_kind,
        condition=fit.condition,
        relative_error_percent=float(100 * np.linalg.norm(sizes) / np.linalg.norm(torques)),
        relative_error_percent_per_joint=100 * sizes / torques,
        torque_rms=sizes / np.sqrt([e.size for e in residuals]),
        lag1_autocorrelation=np.array([lag1_autocorrelation(e) for e in residuals]),
        iterations=fit.iterations,
        converged=fit.converged,
    )


def _trace(rows: Rows, beta: FloatArray) -> TorqueTrace:
    return TorqueTrace(rows.time, rows.torque, np.asarray(rows.regressor @ beta))


def _warnings(base: BaseParameters, fit: LinearFit) -> tuple[str, ...]:
    deviation = np.sqrt(np.diag(fit.covariance))
    poor = [n for n, v, s in zip(base.names, fit.beta, deviation, strict=True) if s > 0.3 * abs(v)]
    return (f"seen with more than 30 % σ: {', '.join(poor)}",) if poor else ()
