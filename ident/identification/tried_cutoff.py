"""A cut-off that the spectrum of the positions proposes, tried before it is proposed.

The spectrum says where the motion sinks into the noise of the positions. Torque that no model explains
(ripple, elasticity, a loop that rings) may begin far below: a cut-off of 380 Hz was right for the positions
of an arm and took its error from 1.8 to 6.7 %. So each half of the recordings is predicted by the other,
at the given cut-off, at the proposed one and half way between, and the best is proposed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ident.errors import IdentificationError
from ident.estimators.fit import stack_columns
from ident.ordered import distinct
from ident.parameters.base import BaseParameters, base_parameters
from ident.parameters.regressor import RegressorModel
from ident.preparation.cutoff import propose_cutoff
from ident.preparation.observation import Rows, observe
from ident.preparation.spectrum import PositionSpectrum
from ident.recording import Recording
from ident.statistics.triangle import triangle_beside
from robots.arrays import BoolArray, FloatArray
from robots.description import Robot

_MOST = 1_000_000
"""Samples, a quarter of an hour at 1 kHz, of whole recordings on which cut-offs are tried."""


@dataclass(frozen=True)
class TriedCutoff:
    """A cut-off, Hz, and the share of the torque that is left of what was not fitted: there and as it was."""

    hz: float
    left: float
    left_before: float


def tried_cutoff(base: BaseParameters, recordings: tuple[Recording, ...], proposed_hz: float) -> TriedCutoff:
    """The best of the given cut-off, the proposed one and their geometric mean.

    Args:
        base: the parameters, with the given settings.
        recordings: to predict by halves.
        proposed_hz: of the spectrum.

    Raises:
        IdentificationError: the given cut-off cannot be used with these recordings.
    """
    given = base.model.robot.identification.cutoff_hz
    recordings = _spread_over(recordings)
    before = left_of_halves(base, recordings, given)
    best = TriedCutoff(given, before, before)
    for hz in (float(f"{np.sqrt(given * proposed_hz):.2g}"), proposed_hz):
        try:
            left = left_of_halves(base, recordings, hz)
        except IdentificationError:  # beyond half the sampling rate, or too short for the filter
            continue
        if left < best.left:
            best = TriedCutoff(hz, left, before)
    return best


def _spread_over(recordings: tuple[Recording, ...]) -> tuple[Recording, ...]:
    """All recordings, or of hours a few that are spread over them."""
    samples = sum(recording.time.size for recording in recordings)
    count = max(2, round(_MOST * len(recordings) / samples))
    if count >= len(recordings):
        return recordings
    return tuple(recordings[k] for k in np.linspace(0, len(recordings) - 1, count).round().astype(int))


def left_of_halves(base: BaseParameters, recordings: tuple[Recording, ...], cutoff_hz: float) -> float:
    """Share of the torque that the parameters of one half of the rows leave of the other, both ways."""
    robot = base.model.robot
    settings = robot.identification.model_copy(update={"cutoff_hz": cutoff_hz})
    changed = robot.model_copy(update={"identification": settings})
    at = replace(base, model=RegressorModel(changed, base.model.effects))
    rows = observe(at, recordings, settings)
    first = _first_halves(rows)
    left = whole = 0.0
    for fitted in (first, ~first):
        error, size = _predicted(rows, fitted)
        left, whole = left + error, whole + size
    return float(np.sqrt(left / whole))


def _first_halves(rows: Rows) -> BoolArray:
    """(samples,) those before the middle of their recording."""
    first = np.zeros(rows.segment.size, dtype=np.bool_)
    for segment in distinct(rows.segment):
        own = np.flatnonzero(rows.segment == segment)
        first[own[: own.size // 2]] = True
    return first


def _predicted(rows: Rows, fitted: BoolArray) -> tuple[float, float]:
    """Squares of what is left of the other rows, and of their torque, each joint by its own spread."""
    spread: FloatArray = np.array(
        [float(np.std(rows.torque[used, j])) if used.any() else 0.0 for j, used in enumerate(rows.used.T)]
    )
    spread[spread == 0.0] = 1.0
    there = rows.used & fitted[:, np.newaxis]
    weights = np.repeat(1.0 / spread, there.sum(axis=0))
    r, shares = triangle_beside(
        stack_columns(rows.regressor, there), rows.torque.T[there.T] * weights, weights
    )
    scale = np.linalg.norm(r, axis=0)
    scale = np.where(scale > 0.0, scale, 1.0)
    beta = np.linalg.lstsq(r / scale, shares, rcond=1e-8)[0] / scale
    other = rows.used & ~fitted[:, np.newaxis]
    y, rest = ((values / spread)[other] for values in (rows.torque, rows.torque - rows.predicted(beta)))
    return float(rest @ rest), float(y @ y)


@dataclass(frozen=True)
class ProposedCutoff:
    """The cut-off that is proposed, Hz; ``tried`` where it is not the spectrum's word alone."""

    hz: float
    tried: TriedCutoff | None = None


def proposed_for(
    robot: Robot, recordings: tuple[Recording, ...], spectrum: PositionSpectrum
) -> ProposedCutoff:
    """The cut-off that the spectrum proposes, tried where it is far from the given one.

    Raises:
        IdentificationError: the given cut-off cannot be used with these recordings.
    """
    proposal = propose_cutoff(spectrum)
    if not proposal.is_far_from(robot.identification.cutoff_hz):
        return ProposedCutoff(proposal.hz)
    tried = tried_cutoff(base_parameters(RegressorModel.of(robot)), recordings, proposal.hz)
    return ProposedCutoff(tried.hz, tried)
