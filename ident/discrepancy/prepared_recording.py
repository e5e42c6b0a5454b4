"""One recording as the search looks at it: measured motion, instruments, torque, and which rows count."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.ndimage import binary_dilation

from ident.closed_loop.at_once import at_once
from ident.decimation import DecimationFilter, decimate, decimate_index, decimation_reach
from ident.discrepancy.repeats import motion_of_others, not_repeating, repeat_length
from ident.effects import Effect, State
from ident.effects.family import PlacedEffect
from ident.parameters.base import BaseParameters
from ident.preparation.observed_torque import asked_torque, load_torque
from ident.recording import Recording
from ident.signals import kept_samples, motion, own_samples
from robots.arrays import BoolArray, FloatArray
from robots.description import Identification, Robot
from robots.identity_cache import IdentityCache

_EDGE = 5.0
"""Periods of the cut-off frequency at both ends in which a filtered acceleration is not to be trusted."""

_CHANNELS_AT_ONCE = 96
"""Channels filtered together: bounds the memory of the decimation."""

_EFFECTS = 16
"""Of a model and of what was found last, whose columns are kept."""


@dataclass(frozen=True)
class PreparedRecording:
    """A recording, filtered and trimmed.

    Attributes:
        recording: what was recorded.
        started: s from the start of the first recording to the time zero of this one.
        measured: the motion at the full rate, samples × joints.
        instruments: the same motion without this sample's own noise: the mean of the other periods where
            the trajectory repeats, else the measured motion itself.
        full_torque: at the full rate, samples × joints, N·m (or N).
        torque: the same decimated, rows × joints.
        moving: rows × joints, away from reversals and standstills.
        time: (rows,) s, of the rows.
        period: samples of the full rate per period of the trajectory, None where it does not repeat.
        settings: of filters and decimation.
    """

    recording: Recording
    started: float
    measured: State
    instruments: State
    full_torque: FloatArray
    torque: FloatArray
    moving: BoolArray
    time: FloatArray
    period: int | None
    settings: Identification
    _of_effects: tuple[IdentityCache[FloatArray], IdentityCache[FloatArray]] = field(
        default_factory=lambda: (IdentityCache(_EFFECTS), IdentityCache(_EFFECTS)), repr=False, compare=False
    )

    @property
    def decimation(self) -> int:
        """Samples per row."""
        return self.settings.decimation

    @property
    def row_time(self) -> float:
        """s from row to row."""
        return self.recording.sample_time * self.decimation

    @property
    def decimation_filter(self) -> DecimationFilter:
        """Before the samples between rows are left out."""
        return self.settings.decimation_filter

    @property
    def rows(self) -> int:
        return int(self.torque.shape[0])

    def thin(self, columns: FloatArray) -> FloatArray:
        """Full-rate columns, samples × joints × p, through the decimation that the torque went through."""
        return thinned(columns, self.decimation, self.decimation_filter)

    def columns_of(self, effect: PlacedEffect, measured: bool = False) -> FloatArray:
        """An effect's decimated columns at the instruments (or the measured motion): rows × joints × p."""
        return self._decimated(effect, self.measured if measured else self.instruments)

    def columns(self, base: BaseParameters, instruments: bool = False) -> FloatArray:
        """The decimated base regressor at the measured motion (or the instruments'), rows × joints × b.

        Columns of effects are kept: models that follow each other differ by what was found alone.
        """
        state, kept = (self.measured, self.instruments)[instruments], self._of_effects[instruments]
        rows, joints = self.torque.shape
        columns = np.empty((rows, joints, base.independent.size))
        for effect, places, own in base.columns_of_effects:
            whole = kept.of(effect, partial(self._decimated, effect, state))
            columns[:, :, places] = whole[:, :, own]
        return columns

    def _decimated(self, effect: Effect, state: State) -> FloatArray:
        return self.thin(effect.columns(state))

    def residual(self, base: BaseParameters, beta: FloatArray) -> FloatArray:
        """Decimated torque less that of base parameters (b,), rows × joints, N·m (or N)."""
        return np.asarray(self.torque - self.columns(base) @ beta)

    def noise_of(self, residual: FloatArray) -> FloatArray:
        """What of a full-rate residual (samples × joints) does not repeat, decimated; rows × joints.

        Friction that changes over the recording is left out: that is a finding, no noise.
        """
        if self.period is None:
            return self.thin(residual)
        return self.thin(without_drift(self.measured, not_repeating(residual, self.period), self.period))


def prepared_recording(
    robot: Robot, recording: Recording, started: float = 0.0, *, as_identified: bool = False
) -> PreparedRecording:
    """Filter one recording.

    Args:
        robot: the arm and its identification settings.
        recording: one uninterrupted piece.
        started: s from the start of the first recording to the start of this one.
        as_identified: with the rows of an identification: ends trimmed by the settings alone, not as those
            of a record that is cut in motion, and torque through the filter that the rows go through.

    Raises:
        IdentificationError: too short, or a cut-off that its sampling does not allow.
    """
    settings = own_samples(recording, robot.identification)
    if not as_identified:
        settings = edges_trimmed(settings, recording.sample_time)
    keep = kept_samples(recording.time.shape[0], settings)
    whole = motion(recording.time, recording.position, settings.model_copy(update={"trim_samples": (0, 0)}))
    time = recording.time + started
    everything = settings.model_copy(update={"decimation": 1, "trim_samples": (0, 0)})
    period = repeat_length(recording.reference, recording.sample_time)
    if not as_identified:
        # Both sides of the model through one filter: what is quicker then passes for nothing that is slower.
        # Where nothing repeats noise is told by how little it goes on from row to row, so it stays as it is.
        smooth = "positions" if period is not None else "none"
        everything = everything.model_copy(update={"torque_filter": smooth})
    asked = asked_torque(robot, recording, everything)
    carried = asked.seen(asked.torque)
    torque = carried - load_torque(robot, recording, everything)
    motion_of = whole.position, whole.velocity, whole.acceleration
    state = State(*motion_of, time, carried, recording.load, period, asked=asked)
    measured = state.part(keep)
    kept_time = time[keep]
    return PreparedRecording(
        recording=recording,
        started=started,
        measured=measured,
        instruments=measured if period is None else motion_of_others(state, period).part(keep),
        full_torque=torque[keep],
        torque=thinned(torque[keep], settings.decimation, settings.decimation_filter),
        moving=_moving(robot, measured, recording.sample_time, settings),
        time=kept_time[decimate_index(kept_time.shape[0], settings.decimation)],
        period=period,
        settings=settings,
    )


def prepared_recordings(
    robot: Robot, recordings: Sequence[Recording], *, as_identified: bool = False
) -> tuple[PreparedRecording, ...]:
    """Recordings one after the other, as if without a pause; arguments as of :func:`prepared_recording`.

    Raises:
        IdentificationError: as :func:`prepared_recording`.
    """
    prepared, started = [], 0.0
    for recording in recordings:
        offset = started - float(recording.time[0])
        prepared.append(prepared_recording(robot, recording, offset, as_identified=as_identified))
        started += float(recording.time[-1] - recording.time[0])
    return tuple(prepared)


def regressors(prepared: Sequence[PreparedRecording], base: BaseParameters) -> tuple[FloatArray, FloatArray]:
    """Rows × joints × b of all recordings: at the measured motion, and at that of the instruments.

    Both are the same array where nothing repeats.
    """
    kinds = (False, True) if any(piece.period is not None for piece in prepared) else (False,)
    found = at_once(lambda kind: np.concatenate([piece.columns(base, kind) for piece in prepared]), kinds)
    return found[0], found[-1]


def edges_trimmed(settings: Identification, sample_time: float) -> Identification:
    """Settings whose trim covers what the filter of the positions does to a record that is cut in motion."""
    least = int(np.ceil(_EDGE / (settings.cutoff_hz * sample_time))) + 2 * settings.decimation
    start, end = settings.trim_samples
    return settings.model_copy(update={"trim_samples": (max(start, least), max(end, least))})


def thinned(columns: FloatArray, decimation: int, kind: DecimationFilter) -> FloatArray:
    """Decimate samples × joints (× p); channels that are zero throughout are not filtered."""
    if decimation == 1:
        return columns
    samples = columns.shape[0]
    flat = columns.reshape(samples, -1)
    index = decimate_index(samples, decimation)
    thin = np.zeros((index.shape[0], flat.shape[1]))
    alive = np.flatnonzero(flat.any(axis=0))
    for start in range(0, alive.size, _CHANNELS_AT_ONCE):
        chosen = alive[start : start + _CHANNELS_AT_ONCE]
        thin[:, chosen] = decimate(flat[:, chosen], decimation, kind)
    return thin.reshape(-1, *columns.shape[1:])


def _moving(robot: Robot, state: State, sample_time: float, settings: Identification) -> BoolArray:
    """Rows × joints: every drive that moves with the joint is fast enough, with a margin around."""
    transmission = robot.transmission_matrix
    limit = settings.minimum_speed * robot.velocity_limits
    joints = np.abs(state.velocity) > limit
    drives = np.abs(state.velocity @ transmission.T) > limit
    slow = ~joints | (~drives @ (transmission != 0.0))
    reach = round(settings.standstill_margin / sample_time)
    reach = max(reach, decimation_reach(settings.decimation, settings.decimation_filter))
    wide = binary_dilation(slow, np.ones((2 * reach + 1, 1), dtype=np.bool_))
    return np.asarray(~wide[decimate_index(wide.shape[0], settings.decimation)])


def without_drift(motion: State, noise: FloatArray, period: int) -> FloatArray:
    """Noise less what of it is friction that changes over the recording: that is a finding, no noise."""
    time = motion.time
    if time is None:
        return noise
    share = ((time - time[0]) / (time[-1] - time[0]))[:, np.newaxis]
    rest = noise.copy()
    for joint in range(noise.shape[1]):
        speed = motion.velocity[:, [joint]]
        friction = np.hstack([np.sign(speed), speed])
        basis = not_repeating(np.hstack([share * friction, share**2 * friction]), period)
        scale = np.maximum(np.linalg.norm(basis, axis=0), 1e-300)
        rest[:, joint] -= basis / scale @ np.linalg.lstsq(basis / scale, noise[:, joint], rcond=None)[0]
    return rest
