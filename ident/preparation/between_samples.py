"""What a sampled control signal does not show: its course between two samples of the recording.

A drive computes v_τ several times between two SYNCs and reports one value of it. Its set-points are pieced
together at the SYNCs (eq. 4 with the interpolation of CiA 402's cyclic modes), so v_τ carries a ripple at the
SYNC frequency, and every sample meets it in the same phase. Sampling folds that ripple down to a torque that
goes with the jerk of the reference; least squares takes it for inertia and viscous friction. The ripple is
far above the bandwidth of the loop, so it follows from the set-points alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from ident.preparation.set_points import set_points
from ident.recording import Recording
from robots.arrays import FloatArray
from robots.description import Robot


def with_mean_control_signal(robot: Robot, recording: Recording) -> Recording:
    """The recording with the mean course of its control signals in place of their samples.

    Unchanged where no reference was recorded, the controller is not described or runs once per sample.

    Args:
        robot: its controller says how set-points become control signals.
        recording: the control signal is what the controller puts out at each sample.
    """
    if not robot.controller.is_given:
        return recording
    per_sample = round(recording.sample_time / robot.controller.sample_time)
    if recording.reference is None or per_sample < 2:
        return recording
    ripple = _missed_by_samples(recording, _from_set_points(robot, recording, per_sample))
    limited = np.abs(recording.control_signal) >= np.array(robot.controller.saturation)
    return replace(recording, control_signal=recording.control_signal + np.where(limited, 0.0, ripple))


def _from_set_points(robot: Robot, recording: Recording, per_sample: int) -> FloatArray:
    """The set-points' share of the control signal, samples × controller samples each × n."""
    assert recording.reference is not None
    controller = robot.controller
    targets = np.einsum("sj,dj->sd", recording.reference, robot.transmission_matrix)
    points, speeds = set_points(robot, targets, recording.sample_time, per_sample)
    proportional = np.array(controller.position_gain) * points
    damping = np.array(controller.velocity_feed_forward) * speeds
    velocity_gain = np.array(controller.velocity_gain)
    if controller.type == "cascade_p_pi":
        signal = velocity_gain * (proportional + damping)
    else:
        signal = proportional + velocity_gain * damping
    delayed = np.concatenate([np.repeat(signal[:1], controller.delay_samples, axis=0), signal])
    return np.asarray(delayed[: len(signal)].reshape(-1, per_sample, robot.n))


def _missed_by_samples(recording: Recording, course: FloatArray) -> FloatArray:
    """Mean of the controller samples' sequences, each taken to the instants of the first, less the first.

    Each sequence alone holds the motion and the folded ripple; the ripple is in another phase in each, and
    the mean has none of it.
    """
    time, count = recording.time, course.shape[1]
    mean = course[:, 0] / count
    for k in range(1, count):
        late = k * recording.sample_time / count
        spline = CubicSpline(time + late, course[:, k], axis=0)
        mean = mean + spline(np.maximum(time, time[0] + late)) / count
    return np.asarray(mean - course[:, 0])
