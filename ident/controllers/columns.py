"""From a recording to the columns of which a drive's control signal is a sum.

Set-points between two SYNCs are known. Measured positions are not: the drive reads its encoder at every
controller sample and the recording has one reading per SYNC. Between those a cubic spline stands for the
readings. It is exact where the motion is slow against SYNC; what the encoder's noise does between two
SYNCs is lost and stays in the residual. At the SYNCs themselves the recorded reading is the one that the
drive took.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from ident.controllers.structure import Timing
from ident.preparation.set_points import set_point_accelerations, set_points
from ident.recording import Recording
from robots.arrays import BoolArray, FloatArray
from robots.description import Controller, Robot

NAMES = ("e", "-dq", "dr", "∫e", "-∫dq", "∫dr", "1", "ddr")
"""Columns: following error, less the velocity, the set-point's velocity; their integrals; one; q̈_r."""


@dataclass(frozen=True)
class LoopSignals:
    """One recording at the drive outputs, at the controller's rate.

    Attributes:
        robot: the arm; of its controller only the sample time counts.
        targets: (samples, n) recorded references at the drive outputs.
        positions: (samples · per_sample, n) readings and, between them, their spline.
        signal: (samples, n) v_τ.
        used: (samples, n) false where v_τ is limited.
        period: SYNC period, s.
        per_sample: controller samples per SYNC.
    """

    robot: Robot
    targets: FloatArray
    positions: FloatArray
    signal: FloatArray
    used: BoolArray
    period: float
    per_sample: int

    @classmethod
    def of(cls, robot: Robot, recording: Recording, per_sample: int) -> LoopSignals:
        assert recording.reference is not None
        transmission = robot.transmission_matrix
        readings = recording.position @ transmission.T
        step = recording.sample_time / per_sample
        fine = np.arange(readings.shape[0] * per_sample) * step
        coarse = fine[::per_sample]
        positions = CubicSpline(coarse, readings, axis=0)(np.minimum(fine, coarse[-1]))
        positions[::per_sample] = readings
        limit = 0.999 * np.array(robot.controller.saturation)
        used = np.abs(recording.control_signal) < limit
        return cls(
            robot,
            recording.reference @ transmission.T,
            np.asarray(positions),
            # What was fed forward or injected is none of the controller's.
            recording.control_signal
            if recording.added is None
            else recording.control_signal - recording.added,
            used,
            recording.sample_time,
            per_sample,
        )

    def columns(self, timing: Timing) -> FloatArray:
        """samples × n × len(NAMES): what v_τ of each sample was made of, the delay included."""
        n = self.signal.shape[1]
        step = self.period / self.per_sample
        points, speeds = set_points(
            _interpolating(self.robot, timing), self.targets, self.period, self.per_sample
        )
        velocity = self._velocity(timing, step)
        error = points - self.positions
        integrals = [_integral(part, step) for part in (error, -velocity, speeds)]
        acceleration = set_point_accelerations(self.targets, self.period, self.per_sample)
        ones = np.ones_like(error)
        parts = (error, -velocity, speeds, *integrals, ones, acceleration)
        at = np.maximum(np.arange(self.signal.shape[0]) * self.per_sample - timing.delay, 0)
        found = np.empty((self.signal.shape[0], n, len(NAMES)))
        for k, part in enumerate(parts):
            found[:, :, k] = part[at]
        return found

    def _velocity(self, timing: Timing, step: float) -> FloatArray:
        reach = timing.difference
        before = np.concatenate([np.repeat(self.positions[:1], reach, axis=0), self.positions[:-reach]])
        raw = (self.positions - before) / (reach * step)
        if timing.cutoff_hz is None:
            return np.asarray(raw)
        smoothing = 1.0 - float(np.exp(-2 * np.pi * timing.cutoff_hz * step))
        return np.asarray(lfilter([smoothing], [1.0, smoothing - 1.0], raw, axis=0))


def _integral(values: FloatArray, step: float) -> FloatArray:
    """What the loop has summed up before each sample."""
    total = np.cumsum(values, axis=0) * step
    return np.concatenate([np.zeros_like(total[:1]), total[:-1]])


def _interpolating(robot: Robot, timing: Timing) -> Robot:
    controller: Controller = robot.controller.model_copy(update={"interpolation": timing.interpolation})
    return robot.model_copy(update={"controller": controller})
