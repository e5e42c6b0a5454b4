"""IDIM-IV: instruments from a closed-loop simulation, iterated until it stands still (method.md 4)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ident.errors import IdentificationError, SimulationError
from ident.estimators import LinearFit, Stacked, instrumental_variables
from ident.estimators.fit import stack_columns
from ident.parameters.base import BaseParameters
from ident.preparation.observation import Rows, observed_columns
from ident.recording import Recording
from robots.arrays import FloatArray

if TYPE_CHECKING:
    from ident.closed_loop import SimulatedRun

_ITERATIONS = 10
_STILL = 1e-3
"""Relative change of the residual norm, and of β̂ in units of its σ × 10, at which IDIM-IV has converged."""


@dataclass(frozen=True)
class Instruments:
    """The simulated columns, samples × joints × b, and the runs that they are made of."""

    columns: FloatArray
    runs: tuple[SimulatedRun, ...]


def iterate_instruments(
    base: BaseParameters,
    recordings: tuple[Recording, ...],
    rows: Rows,
    stacked: Stacked,
    start: LinearFit,
    progress: Callable[[int], None],
    standard: Callable[[LinearFit], FloatArray] | None = None,
) -> tuple[Instruments, LinearFit]:
    """Simulate with β̂, rebuild Z, solve, until β̂ and the residual norm stand still.

    Args:
        base: the parameters.
        recordings: references, controllers' sampling and initial states of the simulations.
        rows: of the recordings.
        stacked: the same, stacked joint by joint.
        start: the estimate of the first simulation.
        progress: called with the number of each iteration, from 1.
        standard: the standard vector (p,) to simulate an estimate with; the nearest to the prior of those
            with its base parameters where None.

    Raises:
        IdentificationError: the loop cannot be simulated with the estimate, or excites too little.
        SimulationError: the loop with the estimate is unstable, or its mass matrix is none of an arm.
    """
    prior = base.model.prior()
    standard = standard or (lambda fit: base.standard_from(fit.beta, prior))
    fit, norm = start, _residual_norm(stacked, start)
    for iteration in range(1, _ITERATIONS + 1):
        progress(iteration)
        instruments = _simulated(base, standard(fit), recordings)
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
    runs = _runs(base, standard, recordings)
    simulated = [
        replace(recording, position=run.position, control_signal=run.control_signal)
        for recording, run in zip(recordings, runs, strict=True)
    ]
    parts = [observed_columns(base, recording, settings) for recording in simulated]
    return Instruments(np.concatenate(parts), runs)


def _runs(
    base: BaseParameters, standard: FloatArray, recordings: Sequence[Recording]
) -> tuple[SimulatedRun, ...]:
    from ident.closed_loop import simulate  # takes time to load; a log without reference needs none

    found = []
    for recording in recordings:
        try:
            found.append(simulate(base.model, standard, recording))
        except SimulationError as error:
            if len(recordings) == 1:
                raise
            raise type(error)(f"{recording.name}: {error}") from error
    return tuple(found)


def _residual_norm(stacked: Stacked, fit: LinearFit) -> float:
    return float(np.linalg.norm(stacked.y - stacked.x @ fit.beta))
