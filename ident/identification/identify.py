"""The whole method in order: rows, IDIM-LS, closed-loop simulation, IDIM-IV, revised test."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from ident.effects.found import Found
from ident.errors import IdentificationError
from ident.estimators import LinearFit, stack
from ident.exogeneity.untested import no_such_arm, not_testable
from ident.identification.alignment import estimate_lag
from ident.identification.doubts import doubts_of
from ident.identification.excitation import rank_of, require_enough_rows
from ident.identification.fits import Fits, Prepared, Progress, all_fits
from ident.identification.found_effects import FoundModel, end_to_end, extended_model, found_entries
from ident.identification.impossible import nonsense_of
from ident.identification.intervals import half_widths
from ident.identification.kept_effects import KeptEffects, known_names
from ident.identification.loads import spread_of, unknown_of
from ident.identification.options import Options
from ident.identification.summary import (
    essential_of,
    estimate_of,
    held_out,
    poorly_seen,
    refuse_negative_friction,
    refuse_nothing_explained,
    trace_of,
    with_consistent,
)
from ident.identification.taken_up import TakenUp, without_taken_up
from ident.identification.tried_cutoff import ProposedCutoff, proposed_for
from ident.identification.worst_joint import worst_joint_of
from ident.parameters.base import BaseParameters, base_parameters
from ident.parameters.regressor import RegressorModel
from ident.preparation.checks import check_recordings
from ident.preparation.noise import noise_estimate
from ident.preparation.observation import Rows, observe
from ident.preparation.spectrum import PositionSpectrum, position_spectrum
from ident.recording import Recording
from ident.results import Identification, Signals
from ident.statistics.restricted import regression_whitening
from ident.verdicts import Gate, RevisedTest
from robots.description import Robot

if TYPE_CHECKING:
    from ident.estimators.consistent import ConsistentFit

_LEVEL = 0.05
_DEFAULTS = Options()


@dataclass(frozen=True)
class Fitted:
    """A model with its rows and fits: what the report, the model file and the search go on from.

    The arm in ``base.model.robot`` has the settings that were used, those found in the data included.
    ``known`` is the model whose found effects were asked for, ``taken_up`` what of them these recordings
    cannot tell from the other parameters.
    """

    base: BaseParameters
    rows: Rows
    least_squares: LinearFit
    instrumental: LinearFit | None
    result: Identification
    consistent: ConsistentFit | None = None
    taken_up: TakenUp = field(default_factory=TakenUp)
    known: FoundModel | None = None


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
            short, or excite too little; or IV was asked for and cannot be had, or the consistent fit without
            the solver that it needs.
    """
    if options.method == "consistent":
        from ident.estimators.consistent import require_solver

        require_solver()
    progress("base parameters", 0.0)
    warnings = check_recordings(robot, (*recordings, *options.validation))
    spectrum = position_spectrum(recordings)
    proposal = proposed_for(robot, recordings, spectrum)
    if options.propose_cutoff:
        robot = _with_settings(robot, cutoff_hz=proposal.hz)
    model = RegressorModel.of(robot)
    if options.found is not None:
        model = extended_model(robot, options.found)
        recordings = end_to_end(recordings)
        options = replace(options, validation=end_to_end(options.validation))
    base = base_parameters(model)
    unknown, carried = unknown_of(base, recordings), recordings
    recordings = unknown.complete(recordings)
    options = replace(options, validation=unknown.complete(options.validation))
    prepared = _prepare(base, recordings, spectrum, progress, known_names(options.found))
    base, rows, stacked = prepared.base, prepared.rows, prepared.stacked
    settings = base.model.robot.identification
    fits = all_fits(prepared, recordings, options, progress).widened(
        lambda fit: spread_of(fit, base, rows, carried, unknown)
    )
    kept, alone = KeptEffects.of(base, options.found), fits
    fits = fits.each(kept.in_fit)
    progress("revised Durbin-Wu-Hausman test, intervals", 0.85)
    test, textbook = _test(prepared, recordings, fits)
    half = half_widths(prepared, recordings, fits.least_squares, None, fits.of_loads, alone.least_squares)
    least_squares = estimate_of("ls", base, stacked, fits.least_squares, half)
    refuse_negative_friction(least_squares, robot.n)
    computed = {"ls": least_squares}
    if fits.instrumental is not None and fits.instruments is not None:
        columns = fits.instruments.columns
        of = (fits.instrumental, columns, fits.of_loads, alone.instrumental)
        half = half_widths(prepared, recordings, *of)
        computed["iv"] = estimate_of("iv", base, stacked, fits.instrumental, half)
    for name, fit in fits.alternatives.items():
        computed[name] = estimate_of(name, base, stacked, fit)
    signals = _signals(prepared, recordings, spectrum, proposal)
    nonsense = nonsense_of(least_squares, base, rows, recordings)
    result = Identification(
        robot=robot.name,
        rows=rows.count,
        by_estimator=computed,
        instrumental_reason=fits.reason,
        test=test,
        textbook=textbook,
        trace=trace_of(rows, fits.least_squares.beta),
        found=found_entries(base.model),
        warnings=(
            *warnings,
            *unknown.sentences(),
            *kept.sentences(alone.least_squares),
            *prepared.taken_up.sentences,
            *doubts_of(signals, proposal, prepared.lag, prepared.rank, settings.friction_sign),
            *(words for said, beyond in nonsense if not beyond for words in said),
            *poorly_seen(least_squares),
        ),
        method=options.method,
        rank=prepared.rank,
        signals=signals,
        essential=essential_of(base, rows) if options.essential else None,
        impossible=tuple(words for said, beyond in nonsense if beyond for words in said),
    )
    refuse_nothing_explained(result.recommended, prepared.rank)
    consistent = None
    if options.method == "consistent":
        progress("physically consistent fit", 0.95)
        consistent = _nearest_arm(prepared, fits, result)
        result = with_consistent(result, base, stacked, consistent)
    worst = worst_joint_of(result.recommended, rows, recordings)
    result = replace(result, worst=worst, held_out=held_out(base, result.estimates, options.validation))
    progress("done", 1.0)
    return Fitted(
        base,
        rows,
        fits.least_squares,
        fits.instrumental,
        result,
        consistent,
        prepared.taken_up,
        options.found,
    )


def _nearest_arm(prepared: Prepared, fits: Fits, result: Identification) -> ConsistentFit:
    """The arm that can exist nearest to the estimate that the verdict tells to use."""
    from ident.estimators.consistent import consistent_fit

    iv = result.of_verdict.method == "iv" and fits.instrumental is not None
    fit = fits.instrumental if iv else fits.least_squares
    assert fit is not None
    return consistent_fit(prepared.base, fit, prepared.stacked)


def _prepare(
    base: BaseParameters,
    recordings: tuple[Recording, ...],
    spectrum: PositionSpectrum,
    progress: Progress,
    known: frozenset[str],
) -> Prepared:
    """Rows under the arm's settings; made again where their lag is to be found in the data."""
    progress("observation matrix", 0.1)
    robot = base.model.robot

    def made(share: float) -> None:
        progress("observation matrix", 0.1 + 0.4 * share)

    rows, taken_up = observe(base, recordings, robot.identification, made), TakenUp()
    if any(isinstance(effect, Found) for effect in base.model.effects):
        base, rows, taken_up = without_taken_up(base, rows, known)
    stacked = stack(rows)
    rank = rank_of(base, stacked, recordings, spectrum)
    require_enough_rows(rows, len(base.names))
    progress("errors and alignment", 0.5)
    errors = regression_whitening(rows.torque, rows.regressor, rows.segment, rows.used)
    lag = estimate_lag(base, recordings, rows, stacked, errors, robot.identification)
    if robot.identification.alignment == "estimate":
        if not lag.converged:
            raise IdentificationError(
                f'alignment "estimate": no lag within 20 ms of control_signal_lag'
                f" {robot.identification.control_signal_lag:g} s makes the control signal fit the motion"
            )
        robot = _with_settings(robot, control_signal_lag=lag.lag)
        base = replace(base, model=RegressorModel(robot, base.model.effects))
        rows = observe(base, recordings, robot.identification)
        stacked = stack(rows)
        errors = regression_whitening(rows.torque, rows.regressor, rows.segment, rows.used)
    return Prepared(base, rows, stacked, rank, errors, lag, taken_up)


def _with_settings(robot: Robot, **changes: object) -> Robot:
    settings = robot.identification.model_copy(update=changes)
    return robot.model_copy(update={"identification": settings})


def _test(
    prepared: Prepared, recordings: tuple[Recording, ...], fits: Fits
) -> tuple[RevisedTest, Gate | None]:
    base, rows = prepared.base, prepared.rows
    if fits.instruments is None or fits.instrumental is None:
        verdict = no_such_arm if fits.impossible else not_testable
        return verdict(fits.reason, prepared.errors.describe()), None
    from ident.exogeneity import (  # takes time to load; a log without reference needs none
        GateSettings,
        TestedRows,
        revised_test,
        simulation_agreement,
        textbook_test,
    )

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
    prepared: Prepared,
    recordings: tuple[Recording, ...],
    spectrum: PositionSpectrum,
    proposal: ProposedCutoff,
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
