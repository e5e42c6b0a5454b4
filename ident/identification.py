"""The whole method in order: rows, IDIM-LS, closed-loop simulation, IDIM-IV, revised test."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ident.alignment import LagEstimate, estimate_lag
from ident.base import BaseParameters, base_parameters
from ident.checks import check_recordings
from ident.covariance import instrumental_covariance
from ident.covariances import covariance_named, covariance_of, estimated_rows
from ident.cutoff import CutoffProposal, propose_cutoff
from ident.errors import IdentificationError
from ident.estimators import LinearFit, Stacked, huber_least_squares, stack, weighted_least_squares
from ident.excitation import rank_of, require_enough_rows
from ident.exogeneity import (
    GateSettings,
    TestedRows,
    not_testable,
    revised_test,
    simulation_agreement,
    textbook_test,
)
from ident.instruments import Instruments, iterate_instruments
from ident.noise import noise_estimate
from ident.observation import Rows, observe
from ident.options import Options
from ident.recording import Recording
from ident.regressor import RegressorModel
from ident.restricted import regression_whitening
from ident.results import Gate, Identification, Rank, RevisedTest, Signals
from ident.spectrum import PositionSpectrum, position_spectrum
from ident.summary import (
    essential_of,
    estimate_of,
    held_out,
    poorly_seen,
    refuse_negative_friction,
    trace_of,
)
from ident.whitening import Whitening
from robots.arrays import FloatArray
from robots.description import Robot

Progress = Callable[[str, float], None]
"""Called with a step in words and the share of the whole that is done, 0 to 1."""

_LEVEL = 0.05
_DEFAULTS = Options()


@dataclass(frozen=True)
class Fitted:
    """A model with its rows and fits: what the report, the model file and the search go on from.

    The arm in ``base.model.robot`` has the settings that were used, those found in the data included.
    """

    base: BaseParameters
    rows: Rows
    least_squares: LinearFit
    instrumental: LinearFit | None
    result: Identification


def _silent(step: str, share: float) -> None:
    """Nobody watches."""


def identify(
    robot: Robot,
    recordings: tuple[Recording, ...],
    progress: Progress = _silent,
    options: Options = _DEFAULTS,
) -> Fitted:
    """Identify an arm from recordings and say whether the result can be trusted.

    Args:
        robot: the arm; its ``identification`` settings rule filter and decimation.
        recordings: one or more; a reference in each is what makes instruments possible.
        progress: called between the steps.
        options: which estimators, and what to do besides.

    Raises:
        IdentificationError: the recordings do not fit the arm, cannot be what they are said to be, are too
            short, or excite too little; or IV was asked for and cannot be had.
    """
    progress("base parameters", 0.0)
    warnings = check_recordings(robot, (*recordings, *options.validation))
    spectrum = position_spectrum(recordings)
    proposal = propose_cutoff(spectrum)
    if options.propose_cutoff:
        robot = _with_settings(robot, cutoff_hz=proposal.hz)
    base = base_parameters(RegressorModel.of(robot))
    prepared = _prepare(base, recordings, spectrum, progress)
    base, rows, stacked = prepared.base, prepared.rows, prepared.stacked
    settings = base.model.robot.identification
    fits = _fit(prepared, recordings, options, progress)
    progress("revised Durbin-Wu-Hausman test", 0.9)
    test, textbook = _test(prepared, recordings, fits)
    least_squares = estimate_of("ls", base, stacked, fits.least_squares)
    refuse_negative_friction(least_squares, robot.n)
    instrumental = None if fits.instrumental is None else estimate_of("iv", base, stacked, fits.instrumental)
    robust = None if fits.robust is None else estimate_of("robust", base, stacked, fits.robust)
    signals = _signals(prepared, recordings, spectrum, proposal)
    result = Identification(
        robot=robot.name,
        rows=rows.count,
        least_squares=least_squares,
        instrumental=instrumental,
        instrumental_reason=fits.reason,
        test=test,
        textbook=textbook,
        trace=trace_of(rows, fits.least_squares.beta),
        warnings=(
            *warnings,
            *_doubts(signals, proposal, prepared.lag, prepared.rank, settings.friction_sign),
            *poorly_seen(least_squares),
        ),
        method=options.method,
        robust=robust,
        rank=prepared.rank,
        signals=signals,
        essential=essential_of(base, rows) if options.essential else None,
    )
    result = replace(result, held_out=held_out(base, result.estimates, options.validation))
    progress("done", 1.0)
    return Fitted(base, rows, fits.least_squares, fits.instrumental, result)


@dataclass(frozen=True)
class _Prepared:
    """Rows with what was found out about them."""

    base: BaseParameters
    rows: Rows
    stacked: Stacked
    rank: Rank
    errors: Whitening
    lag: LagEstimate


def _prepare(
    base: BaseParameters, recordings: tuple[Recording, ...], spectrum: PositionSpectrum, progress: Progress
) -> _Prepared:
    """Rows under the arm's settings; made again where their lag is to be found in the data."""
    progress("observation matrix", 0.1)
    robot = base.model.robot
    rows = observe(base, recordings, robot.identification)
    rank = rank_of(base, rows, recordings, spectrum)
    require_enough_rows(rows, len(base.names))
    stacked = stack(rows)
    progress("errors and alignment", 0.25)
    errors = regression_whitening(rows.torque, rows.regressor, rows.segment, rows.used)
    lag = estimate_lag(robot, recordings, rows, stacked, errors, robot.identification)
    if robot.identification.alignment == "estimate":
        if not lag.converged:
            raise IdentificationError(
                f'alignment "estimate": no lag within 20 ms of control_signal_lag'
                f" {robot.identification.control_signal_lag:g} s makes the control signal fit the motion"
            )
        robot = _with_settings(robot, control_signal_lag=lag.lag)
        base = replace(base, model=RegressorModel.of(robot))
        rows = observe(base, recordings, robot.identification)
        stacked = stack(rows)
        errors = regression_whitening(rows.torque, rows.regressor, rows.segment, rows.used)
    return _Prepared(base, rows, stacked, rank, errors, lag)


def _with_settings(robot: Robot, **changes: object) -> Robot:
    settings = robot.identification.model_copy(update=changes)
    return robot.model_copy(update={"identification": settings})


@dataclass(frozen=True)
class _Fits:
    least_squares: LinearFit
    instrumental: LinearFit | None
    instruments: Instruments | None
    robust: LinearFit | None
    reason: str


def _fit(
    prepared: _Prepared, recordings: tuple[Recording, ...], options: Options, progress: Progress
) -> _Fits:
    """Every estimate that the method asks for."""
    base, stacked = prepared.base, prepared.stacked
    settings = base.model.robot.identification
    progress("least squares", 0.35)
    plain = weighted_least_squares(stacked, base.names, settings.error_deviation)
    least_squares = _with_covariance(prepared, plain, None)
    robust = None
    if options.method == "robust":
        robust = huber_least_squares(stacked, base.names, settings.error_deviation)
    instruments, instrumental, reason = _instrumental(prepared, recordings, plain, options, progress)
    if instruments is not None and instrumental is not None:
        instrumental = _with_covariance(prepared, instrumental, instruments.columns)
    return _Fits(least_squares, instrumental, instruments, robust, reason)


def _with_covariance(prepared: _Prepared, fit: LinearFit, instruments: FloatArray | None) -> LinearFit:
    """The same estimate with the covariance of the arm's settings; LS (no instruments) has X as its own."""
    rows, name = prepared.rows, prepared.base.model.robot.identification.covariance
    if name == "block":  # the estimators' own
        return fit
    z = rows.regressor if instruments is None else instruments
    residual = rows.torque - rows.regressor @ fit.beta
    if name == "ar":
        errors = prepared.errors
        if instruments is not None:
            errors = regression_whitening(residual, instruments, rows.segment, rows.used)
        used = rows.used[:, :, np.newaxis]
        covariance = instrumental_covariance(z * used, rows.regressor * used, fit.sigma, errors, rows.segment)
        return replace(fit, covariance=covariance, covariance_kind=errors.describe())
    kind = covariance_named(name)
    estimated = estimated_rows(rows.regressor, z, residual, fit.sigma, rows.segment, rows.used)
    return replace(fit, covariance=covariance_of(estimated, kind), covariance_kind=kind.describe(estimated))


def _instrumental(
    prepared: _Prepared,
    recordings: tuple[Recording, ...],
    start: LinearFit,
    options: Options,
    progress: Progress,
) -> tuple[Instruments | None, LinearFit | None, str]:
    """Instruments and IDIM-IV fit, or the reason why there are none."""
    if options.method == "ls":
        return None, None, "least squares alone was asked for"

    def step(iteration: int) -> None:
        progress(f"closed-loop simulation {iteration}", 0.4 + 0.5 * min(1.0, iteration / 4))

    try:
        if any(recording.reference is None for recording in recordings):
            raise IdentificationError("no position reference was recorded, so the loop cannot be simulated")
        found = iterate_instruments(prepared.base, recordings, prepared.rows, prepared.stacked, start, step)
    except IdentificationError as error:
        if options.method == "iv":
            raise IdentificationError(f"no estimate by instrumental variables: {error}") from error
        return None, None, str(error)
    return (*found, "")


def _test(
    prepared: _Prepared, recordings: tuple[Recording, ...], fits: _Fits
) -> tuple[RevisedTest, Gate | None]:
    base, rows = prepared.base, prepared.rows
    if fits.instruments is None or fits.instrumental is None:
        return not_testable(fits.reason, prepared.errors.describe()), None
    robot = base.model.robot
    margins = robot.identification
    settings = GateSettings(
        _LEVEL, margins.instrument_margin, margins.torque_margin, margins.following_error_margin
    )
    deviation = np.sqrt(np.diag(fits.least_squares.covariance))
    shift = (fits.least_squares.beta - fits.instrumental.beta) / deviation
    tested = TestedRows(
        rows.torque, rows.regressor, fits.instruments.columns, rows.segment, rows.used, prepared.errors
    )
    agreement = simulation_agreement(robot, recordings, fits.instruments.runs)
    revised = revised_test(tested, base.names, shift, settings, agreement)
    return revised, textbook_test(tested.whitened(tested.omega()), _LEVEL)


def _signals(
    prepared: _Prepared,
    recordings: tuple[Recording, ...],
    spectrum: PositionSpectrum,
    proposal: CutoffProposal,
) -> Signals:
    robot, lag = prepared.base.model.robot, prepared.lag
    settings = robot.identification
    noise = noise_estimate(robot, recordings, spectrum, settings)
    return Signals(
        cutoff_hz=settings.cutoff_hz,
        proposed_cutoff_hz=proposal.hz,
        position_noise=noise.position,
        quantum=noise.quantum,
        friction_width=settings.friction_width,
        proposed_friction_width=noise.friction_width,
        lag=settings.control_signal_lag,
        estimated_lag=lag.lag if lag.converged else None,
        lag_sigma=lag.sigma if lag.converged else None,
    )


def _doubts(
    signals: Signals, proposal: CutoffProposal, lag: LagEstimate, rank: Rank, friction_sign: str
) -> list[str]:
    """Settings that the data speak against, and parameters that the motion hardly shows."""
    found = []
    if proposal.is_far_from(signals.cutoff_hz):
        found.append(
            f"cut-off {signals.cutoff_hz:g} Hz; the spectrum of the positions proposes {proposal.hz:g} Hz"
        )
    if lag.disagrees and signals.lag == lag.given:
        found.append(
            f"control-signal lag {1e3 * lag.given:g} ms; the data say {1e3 * lag.lag:.3g} ±"
            f" {1e3 * lag.sigma:.1g} ms, and a wrong lag reads as inertia and viscous friction"
        )
    if friction_sign == "tanh" and signals.friction_width < signals.proposed_friction_width:
        found.append(
            f"friction width {signals.friction_width:g}: noise swings the friction's sign at standstill;"
            f" at least {signals.proposed_friction_width:.2g} is proposed"
        )
    if rank.data < rank.structural:
        why = f" ({'; '.join(rank.reasons)})" if rank.reasons else ""
        found.append(
            f"the data have rank {rank.data} of {rank.structural}: the motion does not lift"
            f" {', '.join(rank.unseen)} above the noise of the positions{why}"
        )
    return found
