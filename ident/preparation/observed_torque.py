"""The joint torques of the rows: control signals through gains, transmission and the filters of the rows.

A drive computes v_τ several times between two SYNCs and reports one value of it. Its set-points are pieced
together at the SYNCs (eq. 4 with the interpolation of CiA 402's cyclic modes), so v_τ carries a ripple at the
SYNC frequency, and every sample meets it in the same phase. Sampling folds that ripple down to a torque that
goes with the jerk of the reference; least squares takes it for inertia and viscous friction. The ripple is
far above the bandwidth of the loop, so it follows from the set-points alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ident.decimation import decimate
from ident.effects import RigidBody, State
from ident.effects.state import Asked
from ident.even_spline import EvenSpline
from ident.preparation.set_points import set_points
from ident.recording import Recording
from ident.signals import AlignedControlSignal, differentiate, kept_samples, low_pass, motion, own_rows
from robots.arrays import FloatArray
from robots.description import Identification, Robot


def observed_torque(
    robot: Robot, recording: Recording, settings: Identification, *, as_rows: bool = False
) -> FloatArray:
    """Joint torques of the rows, N·m (or N): τ = Tᵀ g_τ v_τ at the instants of the positions, decimated.

    Less that of a known body that the arm carries, and with that of forces from outside: what is left is the
    arm's own. A body moves with the positions, so its torque is of the motion that the columns are of.

    Args:
        robot: gains, transmission and controller.
        recording: control signals, and references where ``control_signal_reading`` is ``sampled``.
        settings: lag, reading, filter and decimation.
        as_rows: through the low-pass of the positions, as the rows of a fit are where the settings say so.

    Returns:
        rows × joints.
    """
    observed = ObservedTorque.of(robot, recording, settings)
    return (
        observed.at(settings.control_signal_lag)
        if as_rows
        else observed.unfiltered_at(settings.control_signal_lag)
    )


def asked_torque(robot: Robot, recording: Recording, settings: Identification) -> Asked:
    """That of all samples before the filter of the rows, with the torque of a body that is carried.

    Args:
        robot, recording: as above.
        settings: that keep all samples.
    """
    observed = ObservedTorque.of(robot, recording, settings)

    def seen(made: FloatArray) -> FloatArray:
        return low_pass(made, settings.cutoff_hz, recording.sample_time, settings.filter_order)

    whole = observed.asked_at(settings.control_signal_lag)
    return Asked(whole, seen if settings.torque_filter == "positions" else np.asarray)


@dataclass(frozen=True)
class ObservedTorque:
    """The joint torques of a recording's rows at any lag of the control signal, rows × joints.

    Attributes:
        robot: gains and transmission.
        signal: of the recording.
        settings: filters and decimation; not their lag.
        carried: samples × joints torque of a known body that the arm carries.
    """

    robot: Robot
    signal: AlignedControlSignal
    settings: Identification
    carried: FloatArray

    @classmethod
    def of(cls, robot: Robot, recording: Recording, settings: Identification) -> ObservedTorque:
        if settings.control_signal_reading == "sampled":
            recording = with_mean_control_signal(robot, recording)
        # Of any length: rows are counted where they are made.
        everything = settings.model_copy(update={"decimation": 1, "trim_samples": (0, 0)})
        carried = load_torque(robot, recording, everything)
        signal = AlignedControlSignal(recording, _hold(robot, recording, settings))
        return cls(robot, signal, settings, carried)

    def at(self, lag: float) -> FloatArray:
        """Torque, N·m (or N), with the control signal ``lag`` seconds late, through the rows' filter."""
        return self._through_filter(self._of_drives(lag))

    def unfiltered_at(self, lag: float) -> FloatArray:
        """The same without the low-pass of the positions."""
        return self._rows(self._with_outside(self._of_drives(lag)) - self.carried)

    def asked_at(self, lag: float) -> FloatArray:
        """Of the drives and from outside, without that low-pass, and with what is carried."""
        return self._rows(self._with_outside(self._of_drives(lag)))

    def _through_filter(self, drives: FloatArray) -> FloatArray:
        torque = self._with_outside(drives)
        smooth = self._smooth(torque) if self.settings.torque_filter == "positions" else torque
        return self._rows(smooth - self.carried)

    def _of_drives(self, lag: float) -> FloatArray:
        return self.robot.joint_torque(self.signal.at(lag))

    def _with_outside(self, drives: FloatArray) -> FloatArray:
        outside = self.signal.recording.outside
        return drives if outside is None else drives + outside

    def rate_at(self, lag: float) -> FloatArray:
        """dτ/dt, N·m/s (or N/s): what a shift in time adds to the torque."""
        return self._rate(self._of_drives(lag))

    def with_rate_at(self, lag: float) -> tuple[FloatArray, FloatArray]:
        """Both of these."""
        drives = self._of_drives(lag)
        return self._through_filter(drives), self._rate(drives)

    def _rate(self, drives: FloatArray) -> FloatArray:
        step = self.signal.recording.sample_time
        return self._rows(differentiate(self._smooth(drives), step, self.settings.derivative_accuracy))

    def _smooth(self, torque: FloatArray) -> FloatArray:
        settings = self.settings
        return low_pass(torque, settings.cutoff_hz, self.signal.recording.sample_time, settings.filter_order)

    def _rows(self, values: FloatArray) -> FloatArray:
        keep = kept_samples(values.shape[0], self.settings)
        rows = decimate(values[keep], self.settings.decimation, self.settings.decimation_filter)
        return own_rows(rows, self.signal.recording, self.settings)


def load_torque(robot: Robot, recording: Recording, settings: Identification) -> FloatArray:
    """Joint torque of the known body that the arm carries, at the filtered motion, kept samples × joints."""
    load = recording.load
    if load is None or not load.ten.any():
        return np.zeros_like(recording.position[kept_samples(recording.time.shape[0], settings)])
    moved = motion(recording.time, recording.position, settings)
    state = State(moved.position, moved.velocity, moved.acceleration)
    of_link = RigidBody(robot).columns_from(load.link, state)[:, :, : load.ten.size]
    return np.asarray(of_link @ load.ten)


def _hold(robot: Robot, recording: Recording, settings: Identification) -> float:
    """For how long a recorded control signal acts, s; 0 where it is a mean over more than that already."""
    if not robot.controller.is_given:
        return 0.0
    held = robot.controller.sample_time
    per_sample = round(recording.sample_time / held)
    return held if settings.control_signal_reading == "sampled" or per_sample <= 1 else 0.0


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
    ripple = _missed_by_samples(_from_set_points(robot, recording, per_sample))
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


def _missed_by_samples(course: FloatArray) -> FloatArray:
    """Mean of the controller samples' sequences, each taken to the instants of the first, less the first.

    Each sequence alone holds the motion and the folded ripple; the ripple is in another phase in each, and
    the mean has none of it.
    """
    count = course.shape[1]
    mean, place = course[:, 0] / count, np.arange(course.shape[0])
    for k in range(1, count):
        mean = mean + EvenSpline(course[:, k]).at(np.maximum(place - k / count, 0.0)) / count
    return np.asarray(mean - course[:, 0])
