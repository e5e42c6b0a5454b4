"""The observation matrix: y = X β + ε (eq. 6) from recordings, both sides through the same filter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ident.decimation import decimate_index, decimation_reach
from ident.errors import IdentificationError
from ident.filters import near
from ident.parameters.base import BaseParameters
from ident.preparation.observed_torque import observed_torque
from ident.preparation.row_columns import columns_of
from ident.preparation.row_memory import one_after_the_other, torques_of
from ident.recording import Recording
from ident.signals import Motion, kept_samples, motion, own_rows, own_settings
from robots.arrays import BoolArray, FloatArray, IntArray
from robots.description import Identification, Robot


@dataclass(frozen=True)
class Rows:
    """Decimated samples of one or more recordings, kept as samples × joints until they are stacked.

    Attributes:
        time: (samples,) s, of each recording.
        segment: (samples,) which recording a sample comes from.
        torque: samples × joints, N·m (or N).
        regressor: samples × joints × b. In memory time is last: columns that are zero by structure, half of
            them, are then whole runs of memory that nobody writes to, which cost none.
        used: samples × joints, false where a row is left out because its friction is not defined: the
            joint, or a drive that moves with it, is slower than the arm's ``minimum_speed``.
    """

    time: FloatArray
    segment: IntArray
    torque: FloatArray
    regressor: FloatArray
    used: BoolArray

    @property
    def joints(self) -> int:
        return int(self.torque.shape[1])

    @property
    def count(self) -> int:
        """r, the number of rows in eq. 6."""
        return int(self.used.sum())

    def predicted(self, beta: FloatArray) -> FloatArray:
        """X β of parameters (b,): samples × joints, N·m (or N)."""
        return torques_of(self.regressor, beta)


def observe(
    base: BaseParameters,
    recordings: tuple[Recording, ...],
    settings: Identification,
    done: Callable[[float], None] = lambda share: None,
) -> Rows:
    """Rows of eq. 6 from measured positions and control signals.

    Args:
        base: the base parameters, one column each.
        recordings: each filtered, differentiated and decimated on its own.
        settings: cut-off, decimation, trim.
        done: called with the share of the recordings that have their rows.

    Raises:
        IdentificationError: no recording, a joint count that is not the arm's, or one that is too short.
    """
    if not recordings:
        raise IdentificationError("no recording to identify from")
    parts = []
    for index, recording in enumerate(recordings):
        parts.append(_rows_of(base, index, recording, settings))
        done((index + 1) / len(recordings))
    if len(parts) == 1:
        return parts[0]
    time = np.concatenate([part.time for part in parts])
    segment = np.concatenate([part.segment for part in parts])
    torque = np.concatenate([part.torque for part in parts])
    used = np.concatenate([part.used for part in parts])
    columns = [part.regressor for part in parts]
    del parts  # so that each piece goes when it is copied
    return Rows(time, segment, torque, one_after_the_other(columns), used)


def observed_columns(base: BaseParameters, recording: Recording, settings: Identification) -> FloatArray:
    """Base regressor of a recording after low-pass, differences and decimation: samples × joints × b.

    The same function serves the measured and the simulated positions, so that X and Z see one filter. The
    recording's torque is for effects that ask for one.
    """
    settings = own_settings(recording, settings)
    moved = motion(recording.time, recording.position, settings)
    return own_rows(columns_of(base, recording, moved, settings), recording, settings)


def _rows_of(base: BaseParameters, index: int, recording: Recording, settings: Identification) -> Rows:
    robot = base.model.robot
    if recording.joints != robot.n:
        raise IdentificationError(
            f"{recording.name}: {recording.joints} joints; allowed: {robot.n}, as {robot.name} has"
        )
    settings = own_settings(recording, settings)
    keep = kept_samples(recording.time.shape[0], settings)
    torque = observed_torque(robot, recording, settings, as_rows=True)
    moved = motion(recording.time, recording.position, settings)
    regressor = columns_of(base, recording, moved, settings)
    time = _decimated_time(recording.time[keep], settings.decimation)
    used = _fast_enough(robot, moved, recording.sample_time, settings)
    used = used[decimate_index(moved.time.shape[0], settings.decimation)]
    time, used = own_rows(time, recording, settings), own_rows(used, recording, settings)
    segment = np.full(time.shape[0], index, dtype=np.int64)
    return Rows(time, segment, torque, own_rows(regressor, recording, settings), used)


def _fast_enough(robot: Robot, moved: Motion, sample_time: float, settings: Identification) -> BoolArray:
    """Samples × joints: the joint and every drive that moves with it are above the minimum speed.

    The decimation filter spreads a reversal over its neighbours, so those within the standstill margin
    are left out with it; of a finite filter at least those that it mixes.
    """
    share = settings.minimum_speed
    velocity = moved.velocity
    if share == 0.0:
        return np.ones(velocity.shape, dtype=np.bool_)
    transmission = robot.transmission_matrix
    limits = share * robot.velocity_limits
    joints = np.abs(velocity) > limits
    drives = np.abs(velocity @ transmission.T) > limits
    slow_drive = ~drives @ (transmission != 0.0)
    reach = round(settings.standstill_margin / sample_time)
    reach = max(reach, decimation_reach(settings.decimation, settings.decimation_filter))
    return ~near(~joints | slow_drive, reach)


def _decimated_time(time: FloatArray, factor: int) -> FloatArray:
    """The instants of the kept samples; the phase is that of :func:`ident.decimation.decimate`."""
    step = (time[-1] - time[0]) / (time.shape[0] - 1)
    index = decimate_index(time.shape[0], factor)
    return np.asarray(time[0] + step * index)
