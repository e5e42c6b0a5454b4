"""The observation matrix: y = X β + ε (eq. 6) from recordings, both sides through the same filter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ident.decimation import decimate, decimate_index, decimation_reach
from ident.effects import (
    AsymmetricFriction,
    CoulombFriction,
    CurrentOffset,
    RigidBody,
    RotorInertia,
    State,
    ViscousFriction,
    WristCoupling,
)
from ident.effects.found import Found
from ident.errors import IdentificationError
from ident.filters import near
from ident.parameters.base import BaseParameters, random_states
from ident.parameters.regressor import RegressorModel
from ident.preparation.observed_torque import load_torque, observed_torque
from ident.preparation.row_memory import one_after_the_other, torques_of
from ident.recording import Recording
from ident.signals import Motion, kept_samples, motion
from robots.arrays import BoolArray, FloatArray, IntArray
from robots.description import Identification, Robot

_COLUMNS_AT_ONCE = 16
"""Columns filtered together: bounds the memory of the decimation on long records."""

_WITHOUT_HISTORY = (
    RigidBody,
    RotorInertia,
    ViscousFriction,
    CoulombFriction,
    AsymmetricFriction,
    CurrentOffset,
    WristCoupling,
)
"""Effects that look at each sample alone."""

_SAMPLES_AT_ONCE = 400
"""Samples at which the regressor is evaluated together: a piece of it stays in the cache."""


_LONG = 200_000
"""Samples of a motion that is decimated at once: 0.3 GB of columns for six axes."""
_FORGOTTEN = 128
"""Rows after which the decimation filter has forgotten the end of a record, to rounding."""

_STATES = 64
"""Random states that show which columns are zero by structure."""


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
    return _columns_of(base, recording, motion(recording.time, recording.position, settings), settings)


def _columns_of(
    base: BaseParameters, recording: Recording, moved: Motion, settings: Identification
) -> FloatArray:
    torque = None
    if any(isinstance(effect, Found) for effect in base.model.effects):
        whole = settings.model_copy(update={"decimation": 1})
        torque = observed_torque(base.model.robot, recording, whole)
        torque += load_torque(base.model.robot, recording, whole)
    state = State(moved.position, moved.velocity, moved.acceleration, moved.time, torque, recording.load)
    return _columns(base, state, settings)


def _columns(base: BaseParameters, state: State, settings: Identification) -> FloatArray:
    """The base regressor of a motion through the decimation filter."""
    samples = state.position.shape[0]
    if settings.decimation == 1:
        return base.columns(state)
    if samples > _LONG and all(isinstance(effect, _WITHOUT_HISTORY) for effect in base.model.effects):
        return _long_columns(base, state, settings)
    return _columns_at_once(base, state, settings)


def _columns_at_once(base: BaseParameters, state: State, settings: Identification) -> FloatArray:
    (samples, joints), count = state.position.shape, len(base.names)
    present, series = _series(base, state)
    joint, column = np.divmod(present, count)
    thin = np.zeros((count, joints, decimate_index(samples, settings.decimation).size))
    for start in range(0, present.size, _COLUMNS_AT_ONCE):
        part = slice(start, start + _COLUMNS_AT_ONCE)
        rows = decimate(series[part], settings.decimation, settings.decimation_filter, axis=1)
        thin[column[part], joint[part]] = rows
    return thin.transpose(2, 1, 0)


def _long_columns(base: BaseParameters, state: State, settings: Identification) -> FloatArray:
    """The same of a long motion, block by block, each with ends that the filter has forgotten in its core."""
    kept = decimate_index(state.position.shape[0], settings.decimation)
    rows = max(_LONG // settings.decimation // 2, 4 * _FORGOTTEN)
    parts = []
    for first in range(0, kept.size, rows):
        last = min(first + rows, kept.size)
        begin = kept[first - _FORGOTTEN] if first > _FORGOTTEN else 0
        end = min(last + _FORGOTTEN, kept.size)
        part = slice(begin, kept[end - 1] + 1)  # its last sample is kept, as that of every record is
        piece = State(state.position[part], state.velocity[part], state.acceleration[part])
        found = _columns_at_once(base, piece, settings)
        parts.append(found[len(found) - (end - first) : len(found) - (end - last)])
    return one_after_the_other(parts)


def _series(base: BaseParameters, state: State) -> tuple[IntArray, FloatArray]:
    """Which of the joints × b columns are not zero by structure, and these as rows, so that each is a run of
    memory for the filter. Evaluated piece by piece, since a piece stays in the cache; an effect with a
    history sees the whole motion at once.
    """
    samples = state.position.shape[0]
    found = [effect for effect in base.model.effects if isinstance(effect, Found)]
    if found:
        return _series_with_found(base, found, state)
    if not all(isinstance(effect, _WITHOUT_HISTORY) for effect in base.model.effects):
        full = base.columns(state).reshape(samples, -1)
        present = np.flatnonzero(full.any(axis=0))
        return present, np.ascontiguousarray(full[:, present].T)
    sight = base.columns(random_states(base.model.robot, 0, _STATES)).reshape(_STATES, -1)
    present = np.flatnonzero(sight.any(axis=0))
    joint, column = np.divmod(present, len(base.names))
    standard = joint * len(base.model.names) + base.independent[column]
    series = np.empty((present.size, samples))
    for start in range(0, samples, _SAMPLES_AT_ONCE):
        part = slice(start, start + _SAMPLES_AT_ONCE)
        piece = State(state.position[part], state.velocity[part], state.acceleration[part])
        columns = base.model.columns(piece)
        series[:, part] = columns.reshape(columns.shape[0], -1)[:, standard].T
    return present, series


def _series_with_found(
    base: BaseParameters, found: Sequence[Found], state: State
) -> tuple[IntArray, FloatArray]:
    """The same of a model with effects that were found, which come last and see the whole motion."""
    usual = RegressorModel(base.model.robot, base.model.effects[: -len(found)])
    standard = len(usual.names)
    plain = int(np.count_nonzero(base.independent < standard))
    alone = BaseParameters(usual, base.independent[:plain], base.relation[:plain, :standard])
    present, series = _series(alone, state)
    joint, column = np.divmod(present, plain)
    added = np.concatenate([effect.columns(state) for effect in found], axis=2)
    added = added[:, :, base.independent[plain:] - standard]
    alive = np.argwhere(added.any(axis=0))
    count = len(base.names)
    return (
        np.concatenate([joint * count + column, alive[:, 0] * count + plain + alive[:, 1]]),
        np.concatenate([series, added[:, alive[:, 0], alive[:, 1]].T]),
    )


def _rows_of(base: BaseParameters, index: int, recording: Recording, settings: Identification) -> Rows:
    robot = base.model.robot
    if recording.joints != robot.n:
        raise IdentificationError(
            f"{recording.name}: {recording.joints} joints; allowed: {robot.n}, as {robot.name} has"
        )
    keep = kept_samples(recording.time.shape[0], settings)
    torque = observed_torque(robot, recording, settings, as_rows=True)
    moved = motion(recording.time, recording.position, settings)
    regressor = _columns_of(base, recording, moved, settings)
    time = _decimated_time(recording.time[keep], settings.decimation)
    used = _fast_enough(robot, moved, recording.sample_time, settings)
    used = used[decimate_index(moved.time.shape[0], settings.decimation)]
    segment = np.full(time.shape[0], index, dtype=np.int64)
    return Rows(time, segment, torque, regressor, used)


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
    """The instants of the kept samples; the phase is that of :func:`ident.signals.decimate`."""
    step = (time[-1] - time[0]) / (time.shape[0] - 1)
    index = decimate_index(time.shape[0], factor)
    return np.asarray(time[0] + step * index)
