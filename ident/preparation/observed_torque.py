"""The joint torques of the rows: control signals through gains, transmission and the filters of the rows."""

from __future__ import annotations

from dataclasses import dataclass

from ident.preparation.between_samples import with_mean_control_signal
from ident.recording import Recording
from ident.signals import AlignedControlSignal, decimate, differentiate, kept_samples, low_pass
from robots.arrays import FloatArray
from robots.description import Identification, Robot


def observed_torque(
    robot: Robot, recording: Recording, settings: Identification, *, as_rows: bool = False
) -> FloatArray:
    """Joint torques of the rows, N·m (or N): τ = Tᵀ g_τ v_τ at the instants of the positions, decimated.

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


@dataclass(frozen=True)
class ObservedTorque:
    """The joint torques of a recording's rows at any lag of the control signal, rows × joints.

    Attributes:
        robot: gains and transmission.
        signal: of the recording.
        settings: filters and decimation; not their lag.
    """

    robot: Robot
    signal: AlignedControlSignal
    settings: Identification

    @classmethod
    def of(cls, robot: Robot, recording: Recording, settings: Identification) -> ObservedTorque:
        if settings.control_signal_reading == "sampled":
            recording = with_mean_control_signal(robot, recording)
        return cls(robot, AlignedControlSignal(recording, _hold(robot, recording, settings)), settings)

    def at(self, lag: float) -> FloatArray:
        """Torque, N·m (or N), with the control signal ``lag`` seconds late, through the rows' filter."""
        torque = self.robot.joint_torque(self.signal.at(lag))
        return self._rows(self._smooth(torque) if self.settings.torque_filter == "positions" else torque)

    def unfiltered_at(self, lag: float) -> FloatArray:
        """The same without the low-pass of the positions."""
        return self._rows(self.robot.joint_torque(self.signal.at(lag)))

    def rate_at(self, lag: float) -> FloatArray:
        """dτ/dt, N·m/s (or N/s): what a shift in time adds to the torque."""
        smooth = self._smooth(self.robot.joint_torque(self.signal.at(lag)))
        step = self.signal.recording.sample_time
        return self._rows(differentiate(smooth, step, self.settings.derivative_accuracy))

    def _smooth(self, torque: FloatArray) -> FloatArray:
        settings = self.settings
        return low_pass(torque, settings.cutoff_hz, self.signal.recording.sample_time, settings.filter_order)

    def _rows(self, values: FloatArray) -> FloatArray:
        keep = kept_samples(values.shape[0], self.settings)
        return decimate(values[keep], self.settings.decimation, self.settings.decimation_filter)


def _hold(robot: Robot, recording: Recording, settings: Identification) -> float:
    """For how long a recorded control signal acts, s; 0 where it is a mean over more than that already."""
    if not robot.controller.is_given:
        return 0.0
    held = robot.controller.sample_time
    per_sample = round(recording.sample_time / held)
    return held if settings.control_signal_reading == "sampled" or per_sample <= 1 else 0.0
