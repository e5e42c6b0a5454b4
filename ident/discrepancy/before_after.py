"""What each finding changes: the relative errors, and gate 1 of the revised DWH-test.

Gate 1 asks whether the simulated arm is the real one, so that its motion can serve as instruments. Where it
is not, an effect is missing (method.md 5.2); adding it has to bring simulation and measurement together.
So the gate is run for the model without and with each finding, with the parameters that the search found, on
the validation recordings, which neither chose the name nor were fitted.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ident.closed_loop import SimulatedRun, simulate
from ident.closed_loop.at_once import beside
from ident.discrepancy.binned_residual import BinnedResidual, binned_residuals
from ident.discrepancy.examination import Examination, examine
from ident.discrepancy.loop import Standstill
from ident.discrepancy.loop_parts import simulated_with
from ident.discrepancy.prepared_recording import (
    PreparedRecording,
    edges_trimmed,
    prepared_recording,
    prepared_recordings,
)
from ident.discrepancy.prior import Prior, extended_prior
from ident.discrepancy.results import Diagnosis
from ident.errors import IdentificationError
from ident.estimators import stack, weighted_least_squares
from ident.exogeneity import GateSettings, SimulationAgreement, TestedRows, simulation_agreement
from ident.exogeneity.instruments import instruments_gate
from ident.parameters.base import BaseParameters
from ident.parameters.regressor import RegressorModel
from ident.preparation.observation import Rows
from ident.recording import Recording
from ident.verdicts import Gate
from robots.arrays import BoolArray, FloatArray
from robots.description import Identification, Robot

_DEPENDENT = 1e-6
"""A column of unit norm with less than this beside those before it depends on them."""


@dataclass(frozen=True)
class ModelCheck:
    """One model of the series: before anything was found, and after each finding.

    Attributes:
        identified: (n,) 100·‖ε_j‖/‖y_j‖, % on the rows that an identification of the fit recordings takes.
        moving: (n,) the same on the rows of the search: where the joint moves.
        held_out: (n,) the same on the validation recordings, to which nothing was fitted.
        gate: gate 1 on the validation recordings; None where the loop cannot be simulated.
        reason: why there is no gate; empty where there is one.
    """

    identified: FloatArray
    moving: FloatArray
    held_out: FloatArray
    gate: Gate | None
    reason: str


@dataclass(frozen=True)
class Series:
    """What the findings change, one after the other.

    Attributes:
        checks: of the model before anything was found and after each finding: one more than findings.
        binned_residuals: per finding, every joint's residual on the validation recordings without it and
            with it, over speed, position, torque and time.
    """

    checks: tuple[ModelCheck, ...]
    binned_residuals: tuple[tuple[BinnedResidual, ...], ...]


@dataclass(frozen=True)
class Stage:
    """A model of the series with the base parameters (b,) that it is shown with."""

    base: BaseParameters
    beta: FloatArray
    prior: Prior | None


def before_and_after(
    diagnosis: Diagnosis,
    recordings: tuple[Recording, ...],
    validation: tuple[Recording, ...],
    settings: Identification,
) -> Series:
    """Check the model before anything was found and after each finding.

    Args:
        diagnosis: of the search.
        recordings: uncut, what an identification would be made of.
        validation: what the gap is shown on.
        settings: those that an identification of the recordings would have.

    Raises:
        IdentificationError: a recording is too short for its settings.
    """
    robot = diagnosis.base.model.robot
    plain = prepared_recordings(
        robot.model_copy(update={"identification": settings}), recordings, as_identified=True
    )
    moving, held_out = prepared_recordings(robot, recordings), prepared_recordings(robot, validation)
    series = stages(diagnosis)

    def errors(stage: Stage) -> tuple[FloatArray, FloatArray, FloatArray]:
        return (
            _identified(stage, plain, standstill=settings.minimum_speed == 0.0),
            _identified(stage, moving),
            relative_error(_rows(held_out, stage.base), stage.beta),
        )

    checks = []
    for stage in series:
        said, left = beside(partial(_gate, stage, held_out, diagnosis.standstill), partial(errors, stage))
        checks.append(ModelCheck(*left, *said))
    pictures = tuple(_binned_residuals(one, other, held_out) for one, other in itertools.pairwise(series))
    return Series(tuple(checks), pictures)


def _binned_residuals(
    before: Stage, after: Stage, prepared: Sequence[PreparedRecording]
) -> tuple[BinnedResidual, ...]:
    first, last = (
        [piece.residual(stage.base, stage.beta) for piece in prepared] for stage in (before, after)
    )
    torques = [piece.torque - residual for piece, residual in zip(prepared, first, strict=True)]
    return binned_residuals(prepared, first, last, torques)


def relative_error(rows: Rows, beta: FloatArray) -> FloatArray:
    """(n,) 100·‖y_j − X_j β‖/‖y_j‖ in percent, on the rows that count."""
    left = np.where(rows.used, rows.torque - rows.regressor @ beta, 0.0)
    whole = np.where(rows.used, rows.torque, 0.0)
    return np.asarray(100.0 * np.linalg.norm(left, axis=0) / np.linalg.norm(whole, axis=0))


def stages(diagnosis: Diagnosis) -> list[Stage]:
    """Every model of the series. The first and the last were examined by the search itself."""
    first, last = diagnosis.examinations[0], diagnosis.examinations[-1]
    found = [_examined(first)]
    for count in range(1, len(diagnosis.findings)):
        base = _with_first_findings(diagnosis, len(first.base.model.effects) + count)
        prior = extended_prior(first.prior, base.independent.size - first.base.independent.size)
        found.append(_examined(examine(base, first.prepared, prior, first.whitening)))
    return [*found, _examined(last)] if diagnosis.findings else found


def _examined(examination: Examination) -> Stage:
    return Stage(examination.base, examination.shown, examination.prior)


def _with_first_findings(diagnosis: Diagnosis, effects: int) -> BaseParameters:
    """The base parameters of the first so many effects: what was added comes last in every order."""
    last = diagnosis.base
    model = RegressorModel(last.model.robot, last.model.effects[:effects])
    kept = last.independent[last.independent < len(model.names)]
    return BaseParameters(model, kept, last.relation[: kept.size, : len(model.names)])


def _rows(prepared: Sequence[PreparedRecording], base: BaseParameters) -> Rows:
    return Rows(
        np.concatenate([piece.time for piece in prepared]),
        np.repeat(np.arange(len(prepared)), [piece.rows for piece in prepared]),
        np.concatenate([piece.torque for piece in prepared]),
        np.concatenate([piece.columns(base) for piece in prepared]),
        np.concatenate([piece.moving for piece in prepared]),
    )


def _identified(stage: Stage, prepared: Sequence[PreparedRecording], standstill: bool = False) -> FloatArray:
    """(n,) relative errors of an identification of these rows; against a prior, of what the gap shows."""
    rows = _rows(prepared, stage.base)
    if standstill:
        rows = replace(rows, used=np.ones_like(rows.used))
    if stage.prior is not None:
        return relative_error(rows, stage.beta)
    kept = _independent(rows)
    names = tuple(name for name, chosen in zip(stage.base.names, kept, strict=True) if chosen)
    stacked = stack(replace(rows, regressor=rows.regressor[:, :, kept]))
    beta = np.zeros(kept.size)
    deviation = stage.base.model.robot.identification.error_deviation
    beta[kept] = weighted_least_squares(stacked, names, deviation).beta
    return relative_error(rows, beta)


def _independent(rows: Rows) -> BoolArray:
    """(b,) columns that do not depend on those before: an effect may lie in the span of the links."""
    flat = rows.regressor[rows.used]
    scale = np.linalg.norm(flat, axis=0)
    unit = flat / np.where(scale > 0.0, scale, 1.0)
    return np.asarray(np.abs(np.diag(np.linalg.qr(unit, mode="r"))) > _DEPENDENT)


def _gate(
    stage: Stage, prepared: Sequence[PreparedRecording], standstill: Standstill | None = None
) -> tuple[Gate | None, str]:
    """Gate 1 of one model on recordings, or the reason why there is none.

    Friction at standstill is no part of an inverse model, and the description's is a guess: where recordings
    that were fitted have shown it, the arm is simulated with that.
    """
    base, robot = stage.base, stage.base.model.robot
    if any(piece.recording.reference is None for piece in prepared):
        return None, "no position reference was recorded, so the loop cannot be simulated"
    standard = base.standard_from(stage.beta, base.model.prior())
    try:
        runs = [
            simulate(base.model, standard, piece.recording)
            if standstill is None
            else simulated_with(base, standard, standstill, piece.recording)
            for piece in prepared
        ]
    except IdentificationError as error:
        return None, str(error)
    rows = _rows(prepared, base)
    kept = _independent(rows)
    simulated_pieces = [
        _simulated_piece(robot, piece, run) for piece, run in zip(prepared, runs, strict=True)
    ]
    simulated = np.concatenate([one.columns(base) for one in simulated_pieces])
    tested = TestedRows(
        rows.torque, rows.regressor[:, :, kept], simulated[:, :, kept], rows.segment, rows.used
    )
    names = tuple(name for name, chosen in zip(base.names, kept, strict=True) if chosen)
    gate = instruments_gate(
        tested,
        tested.omega(),
        tested.whitened(tested.errors()),
        names,
        _margins(robot),
        _agreement(robot, prepared, runs),
        None if stage.prior is None else ~np.isfinite(np.diag(stage.prior.covariance))[kept],
    )
    return gate, ""


def gate_of(
    base: BaseParameters,
    beta: FloatArray,
    prior: Prior | None,
    recordings: Sequence[Recording],
    standstill: Standstill | None = None,
) -> tuple[Gate | None, str]:
    """Gate 1 of a model with base parameters (b,) on recordings, or the reason why there is none.

    Friction at standstill is that of the description where ``standstill`` does not say it.
    """
    return _gate(Stage(base, beta, prior), prepared_recordings(base.model.robot, recordings), standstill)


def _margins(robot: Robot) -> GateSettings:
    settings = robot.identification
    return GateSettings(
        margin=settings.instrument_margin,
        torque_margin=settings.torque_margin,
        following_margin=settings.following_error_margin,
    )


def _agreement(
    robot: Robot, prepared: Sequence[PreparedRecording], runs: Sequence[SimulatedRun]
) -> SimulationAgreement:
    """Torque and following error, on their rows."""
    recordings = [piece.recording for piece in prepared]
    trimmed = edges_trimmed(robot.identification, recordings[0].sample_time)
    return simulation_agreement(robot.model_copy(update={"identification": trimmed}), recordings, runs)


def _simulated_piece(robot: Robot, piece: PreparedRecording, run: SimulatedRun) -> PreparedRecording:
    recording = replace(piece.recording, position=run.position, control_signal=run.control_signal)
    return prepared_recording(robot, recording, piece.started)
