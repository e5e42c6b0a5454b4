"""Alignment before anything else: half a sample between torque and position looks like a missing effect."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np

from ident.discrepancy.examination import examine
from ident.discrepancy.prepared_recording import PreparedRecording, prepared_recording
from ident.parameters.base import base_parameters
from ident.parameters.regressor import RegressorModel
from robots.description import Robot

_log = logging.getLogger(__name__)

_STEPS = 6
_STILL = 0.01
"""Samples; a smaller correction ends the search for the lag."""

_FARTHEST = 3.0
_FARTHEST_TIME = 0.003
"""Samples or seconds, whichever is more, by which channels of one log may be apart; beyond is an effect."""


def lag_is_known(robot: Robot) -> bool:
    """Whether the description says how control signal and position lie in time."""
    settings = robot.identification
    return settings.control_signal_lag != 0.0 or settings.control_signal_reading == "sampled"


def aligned(model: RegressorModel, prepared: Sequence[PreparedRecording]) -> Robot:
    """The arm with the lag between control signal and position that the recordings show.

    Only where nobody has said what it is: a description that gives ``control_signal_lag`` is believed, so
    that a delay beyond it can be found.

    Args:
        model: of the arm, with the settings of the search.
        prepared: the recordings.
    """
    robot = model.robot
    settings = robot.identification
    if lag_is_known(robot):
        return robot
    sample = prepared[0].recording.sample_time
    base, lag = base_parameters(model), 0.0
    current = tuple(prepared)
    for _ in range(_STEPS):
        examination = examine(base, current)
        rates = [np.gradient(piece.full_torque, sample, axis=0) for piece in current]
        columns = [piece.thin(r)[:, :, np.newaxis] for piece, r in zip(current, rates, strict=True)]
        rate = examination.partial_out(examination.whiten(columns))[:, 0]
        step = float(rate @ examination.residual) / float(rate @ rate)
        lag += step
        if abs(lag) > max(_FARTHEST * sample, _FARTHEST_TIME):
            _log.warning("torque and position are %.3g s apart, too far to be aligned", lag)
            return robot
        # The lag may be negative: a log's torque can be late. Zero means that nobody has said it.
        robot = robot.model_copy(
            update={"identification": settings.model_copy(update={"control_signal_lag": lag})}
        )
        current = tuple(prepared_recording(robot, piece.recording, piece.started) for piece in current)
        if abs(step) < _STILL * sample:
            break
    _log.info("torque and position aligned by %.3g s", lag)
    return robot
