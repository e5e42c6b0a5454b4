"""The lag between the channels, where nobody has said what it is: from the motion of the other periods.

An encoder's noise in closed loop is in the torque and in the sample's own motion; a rate of the torque that
is made of the same noise would take it for a lag.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from ident.discrepancy.align import lag_is_known
from ident.discrepancy.by_evidence.evidence.prepared import Prepared, prepare
from ident.parameters.base import BaseParameters
from ident.recording import Recording
from robots.arrays import BoolArray, FloatArray
from robots.description import Robot

_STEPS = 6
_STILL = 0.01
"""Samples; a smaller correction ends the search."""

_FARTHEST = 0.003
"""s, or three samples: channels farther apart are not misaligned but late, which is an effect."""


def aligned(robot: Robot, base: BaseParameters, recordings: Sequence[Recording]) -> Robot:
    """The arm with the lag that its recordings show; as it is where the description gives one.

    Args:
        robot: with the settings of the evidence.
        base: parameters of its model.
        recordings: to fit.

    Raises:
        IdentificationError: as :func:`prepare`.
    """
    if lag_is_known(robot):
        return robot
    sample, lag = recordings[0].sample_time, 0.0
    current = robot
    for _ in range(_STEPS):
        step = _step(base, prepare(current, recordings))
        lag += step
        if abs(lag) > max(_FARTHEST, 3.0 * sample):
            return robot
        settings = robot.identification.model_copy(update={"control_signal_lag": lag})
        current = robot.model_copy(update={"identification": settings})
        if abs(step) < _STILL * sample:
            break
    return current


def _step(base: BaseParameters, prepared: Prepared) -> float:
    """Correction of the lag, s: what of the residual goes with the rate of the fitted torque."""
    used = prepared.used
    regressor = np.concatenate([base.columns(part.own) for part in prepared.parts])
    weight = np.ones(prepared.torque.shape[1])
    for _ in range(2):
        columns = _stacked(regressor, used, weight)
        scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
        torque = _stacked(prepared.torque[:, :, np.newaxis], used, weight)[:, 0]
        beta = np.linalg.lstsq(columns / scale, torque, rcond=1e-8)[0] / scale
        left = prepared.torque - regressor @ beta
        squares = np.sum(np.where(used, left, 0.0) ** 2, axis=0) / np.maximum(used.sum(axis=0), 1)
        weight = 1.0 / np.maximum(np.sqrt(squares), 1e-9)
    rates = []
    for part in prepared.parts:
        assert part.other.time is not None
        course = CubicSpline(part.other.time, base.columns(part.other) @ beta)
        rates.append(course(part.other.time, 1)[:: part.finer])
    rate = _stacked(np.concatenate(rates)[:, :, np.newaxis], used, weight)
    basis = np.linalg.qr(_stacked(regressor, used, weight) / scale)[0]
    rate = rate[:, 0] - basis @ (basis.T @ rate[:, 0])
    rest = _stacked(left[:, :, np.newaxis], used, weight)[:, 0]
    return float(rate @ rest / (rate @ rate))


def _stacked(columns: FloatArray, used: BoolArray, weight: FloatArray) -> FloatArray:
    """Weighted rows of all joints, those used."""
    return np.asarray((columns * weight[:, np.newaxis])[used])
