"""Self-simulation: the present model simulated in closed loop, and examined as if it were the arm.

What it leaves is not a missing effect: it comes of filters, of sampling and of friction at standstill. It
is taken off what the arm leaves, so that a clean arm leaves noise alone.
"""

from __future__ import annotations

import logging
from dataclasses import replace
from functools import partial

from ident.closed_loop import SimulatedRun, simulate
from ident.discrepancy.examination import Examination, examine
from ident.discrepancy.prepared_recording import PreparedRecording, prepared_recording
from ident.discrepancy.prior import Prior
from ident.errors import IdentificationError
from ident.parameters.base import BaseParameters
from robots.arrays import FloatArray

_log = logging.getLogger(__name__)


def with_self_simulation(
    examination: Examination, standard: FloatArray, plain: BaseParameters
) -> Examination:
    """The examination with its self-simulation's residual beside it, made when it is asked for.

    Args:
        examination: of the arm.
        standard: (p,) the present model's parameters.
        plain: the model before anything was found, whose parameters come first in the present one's. Its
            self-simulation serves throughout: play in a gear is too sensitive for a simulation of it to be
            taken off.
    """
    return replace(
        examination, self_simulated=partial(self_simulated, examination, standard, plain), placed={}
    )


def self_simulated(
    examination: Examination, standard: FloatArray, plain: BaseParameters
) -> FloatArray | None:
    """Whitened (N,) what the model leaves on a simulation of itself; arguments as above.

    None where the arm cannot be simulated (no reference or controller, a mass matrix that is not positive
    definite), with the reason in the log.
    """
    b, p = plain.independent.size, len(plain.model.names)
    try:
        runs = [simulate(plain.model, standard[:p], piece.recording) for piece in examination.prepared]
    except IdentificationError as error:
        _log.warning("no self-simulation: %s", error)
        return None
    prepared = [
        _as_prepared(examination, piece, run) for piece, run in zip(examination.prepared, runs, strict=True)
    ]
    prior = examination.prior
    if prior is not None:
        prior = Prior(examination.beta[:b], prior.covariance[:b, :b], prior.source)
    only = tuple(examination.used[examination.segment == k] for k in range(len(prepared)))
    return examine(plain, prepared, prior, examination.whitening, only).residual


def _as_prepared(examination: Examination, piece: PreparedRecording, run: SimulatedRun) -> PreparedRecording:
    recording = replace(
        piece.recording,
        name=f"self-simulation of {piece.recording.name}",
        position=run.position,
        control_signal=run.control_signal,
    )
    return prepared_recording(examination.base.model.robot, recording, piece.started)
