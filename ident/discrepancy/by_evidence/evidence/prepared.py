"""Recordings as the evidence reads them: torque and motion through one low-pass, then samples left out.

The torque passes the filter of the positions, so both sides of y = X β + E θ + … hold the same content, and
nothing above the rate of the rows is left to be folded down. No second filter is needed then.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.ndimage import binary_dilation

from ident.discrepancy.by_evidence.evidence.expected_motion import expected_motion
from ident.discrepancy.by_evidence.evidence.repeated_motion import is_timeless, lengthened, shorter
from ident.discrepancy.by_evidence.evidence.slow import without_slow
from ident.discrepancy.repeats import motion_of_others, not_repeating, repeat_length
from ident.effects import State
from ident.effects.family import PlacedEffect
from ident.errors import IdentificationError
from ident.preparation.observed_torque import asked_torque, load_torque
from ident.recording import Recording
from ident.signals import low_pass, motion, own_samples
from robots.arrays import BoolArray, FloatArray, IntArray
from robots.description import Identification, Robot

ROW_RATE = 125.0
"""Hz, of the rows."""

_PASSED = 0.4
"""Of the row rate: the highest cut-off. Half would be folded."""

_FINER = 2
"""Samples per row at which effects are evaluated: histories and rates of torques need them closer."""

_EDGE = 5.0
"""Periods of the cut-off at both ends in which a filtered acceleration is not to be trusted."""

_FEWEST_ROWS = 50

_MINIMUM_SPEED = 0.01
_MARGIN = 0.08
"""Rows are left out where a joint is slower than this share of its limit, and so many s on both sides: there
filtered signs look like friction that falls with speed."""

TURNED = 0.99
"""Of friction, where it has turned its sign: what is short by a hundredth is below the misfit of any arm."""

_STEP_SAMPLES = 40
"""Per period of the cut-off, that the filter's answer is seen with."""


Simulated = Callable[[Recording], FloatArray | None]
"""Of a recording: positions (samples, n) without noise, rad (or m); None where there are none."""


@dataclass(frozen=True)
class Part:
    """One recording.

    Attributes:
        own: motion at the rows, of this sample.
        other: motion at ``finer`` times the rows without this sample's noise: that of the other periods where
            the trajectory repeats, of a simulation where there is one. Its torque is what was asked of the
            drives: in the other periods, or else as it was measured.
        torque: rows × joints, N·m (or N).
        used: rows × joints, away from standstills.
        period: rows per period of the trajectory, None where it does not repeat.
        finer: samples of ``other`` per row.
        sample_time: of the recording, s.
        simulated: whether ``other`` is of a simulation.
    """

    own: State
    other: State
    torque: FloatArray
    used: BoolArray
    period: int | None
    finer: int
    sample_time: float
    simulated: bool = False

    @property
    def rows(self) -> int:
        return int(self.torque.shape[0])

    @property
    def at_rows(self) -> State:
        """The other periods' motion at the rows."""
        return self.other.part(slice(None, None, self.finer))

    def columns(self, effect: PlacedEffect) -> FloatArray:
        """Of an effect at the other periods' motion, rows × joints × p."""
        if self._shorter is None or not is_timeless(effect):
            return effect.columns(self.other)[:: self.finer]
        assert self.period is not None
        return lengthened(effect.columns(self._shorter)[:: self.finer], self.period, self.rows)

    @cached_property
    def _shorter(self) -> State | None:
        return None if self.period is None else shorter(self.other, self.period * self.finer)


@dataclass(frozen=True)
class Prepared:
    """All recordings of one kind (to fit, or to validate), one after the other."""

    robot: Robot
    parts: tuple[Part, ...]

    @property
    def torque(self) -> FloatArray:
        """Rows × joints."""
        return np.concatenate([part.torque for part in self.parts])

    @property
    def used(self) -> BoolArray:
        return np.concatenate([part.used for part in self.parts])

    @property
    def segment(self) -> IntArray:
        """(rows,) which recording."""
        return np.repeat(np.arange(len(self.parts)), [part.rows for part in self.parts])

    @property
    def repeats(self) -> bool:
        """Whether every trajectory repeats, so that noise is told from what does not."""
        return all(part.period is not None for part in self.parts)

    @property
    def apart(self) -> bool:
        """Whether no sample's own noise is in the motion that columns are made of."""
        return all(part.simulated or part.period is not None for part in self.parts)

    def not_repeating(self, values: FloatArray) -> FloatArray:
        """What of rows × joints does not repeat, less friction that changes over a recording."""
        cuts = np.cumsum([part.rows for part in self.parts])[:-1]
        pieces = []
        for part, piece in zip(self.parts, np.split(values, cuts), strict=True):
            assert part.period is not None
            left = not_repeating(piece, part.period)
            pieces.append(without_slow(part.own, part.used, left, part.period))
        return np.concatenate(pieces)


def settings_for(robot: Robot, recording: Recording) -> Robot:
    """The arm with filters for rows of the evidence."""
    rate = 1.0 / recording.sample_time
    stride = _stride(recording, max(1, int(rate / ROW_RATE + 1e-6)))
    settings = robot.identification
    cutoff = min(settings.cutoff_hz, _PASSED * rate / stride)
    changed = {
        "cutoff_hz": cutoff,
        "decimation": stride,
        "derivative_accuracy": 8,
        "minimum_speed": max(settings.minimum_speed, _MINIMUM_SPEED),
        "standstill_margin": max(settings.standstill_margin, _MARGIN, _reach(cutoff, settings.filter_order)),
    }
    return robot.model_copy(update={"identification": settings.model_copy(update=changed)})


def _reach(cutoff_hz: float, order: int) -> float:
    """s until friction that turns its sign has done so behind the filter, forward and backward."""
    step = 1.0 / (_STEP_SAMPLES * cutoff_hz)
    time = step * np.arange(-_EDGE * _STEP_SAMPLES, _EDGE * _STEP_SAMPLES)
    sign = np.where(time < 0.0, -1.0, 1.0)
    seen = low_pass(sign[:, np.newaxis], cutoff_hz, step, order)[:, 0]
    return float(np.abs(time[np.abs(seen - sign) > 1.0 - TURNED]).max())


def prepare(robot: Robot, recordings: Sequence[Recording], simulated: Simulated | None = None) -> Prepared:
    """Filter and thin recordings, as if recorded without a pause.

    Args:
        robot: with the settings of :func:`settings_for`.
        recordings: one or more.
        simulated: shows the motion of a recording that does not repeat without its noise; its own where None.

    Raises:
        IdentificationError: no recording, or one that is too short.
    """
    if not recordings:
        raise IdentificationError("no recording to examine")
    parts, started = [], 0.0
    for recording in recordings:
        parts.append(_part(robot, recording, started, simulated))
        started += float(recording.time[-1] - recording.time[0])
    return Prepared(robot, tuple(parts))


def _part(robot: Robot, recording: Recording, started: float, simulated: Simulated | None) -> Part:
    settings = own_samples(recording, robot.identification)
    step = recording.sample_time
    stride = _stride(recording, settings.decimation)
    untrimmed = settings.model_copy(update={"trim_samples": (0, 0)})
    whole = motion(recording.time, recording.position, untrimmed)
    everything = settings.model_copy(
        update={"decimation": 1, "trim_samples": (0, 0), "torque_filter": "positions"}
    )
    period = repeat_length(recording.reference, step)
    if period is not None and period % stride:
        period = None
    time = recording.time - recording.time[0] + started
    keep = _kept(recording, settings, stride)
    asked = asked_torque(robot, recording, everything)
    carried = asked.seen(asked.torque)
    torque = carried - load_torque(robot, recording, everything)
    measured = whole.position, whole.velocity, whole.acceleration
    state = State(*measured, time, carried, recording.load, period, asked=asked)
    own = state.part(keep)
    finer = _FINER if stride % _FINER == 0 else 1
    used = _away_from_standstill(robot, own, step, settings)
    # A joint that hardly ever turns, or swings about where it is, stands: of five rows nothing is noise.
    used &= np.count_nonzero(used[::stride], axis=0) >= _FEWEST_ROWS
    other = own
    if period is not None:
        # Of the samples that are kept: ends that the filter has spoiled would spoil all other periods' phase.
        other = motion_of_others(own, period)
        other = expected_motion(own, other, used, settings.cutoff_hz, step, period)
    positions = simulated(recording) if simulated is not None and period is None else None
    if positions is not None:
        found = motion(recording.time, positions, untrimmed)
        motion_of = found.position, found.velocity, found.acceleration
        other = State(*motion_of, time, carried, recording.load, measured=state, asked=asked).part(keep)
    return Part(
        own=own.part(slice(None, None, stride)),
        other=other.part(slice(None, None, stride // finer)),
        torque=torque[keep][::stride],
        used=used[::stride],
        period=None if period is None else period // stride,
        finer=finer,
        sample_time=step,
        simulated=positions is not None,
    )


def _stride(recording: Recording, most: int) -> int:
    """Samples per row: the most that divide the period of the trajectory, where it repeats."""
    period = repeat_length(recording.reference, recording.sample_time)
    if period is None:
        return most
    return max(k for k in range(1, most + 1) if period % k == 0)


def _kept(recording: Recording, settings: Identification, stride: int) -> slice:
    """Samples away from both ends, a whole number of rows."""
    samples = recording.time.shape[0]
    least = int(np.ceil(_EDGE / (settings.cutoff_hz * recording.sample_time)))
    start, end = (max(least, trim) for trim in settings.trim_samples)
    rows = (samples - start - end) // stride
    if rows < _FEWEST_ROWS:
        raise IdentificationError(
            f"{recording.name}: {samples} samples are too short a record;"
            f" allowed: at least {start + end + _FEWEST_ROWS * stride}"
        )
    return slice(start, start + rows * stride)


def _away_from_standstill(robot: Robot, state: State, step: float, settings: Identification) -> BoolArray:
    """Samples × joints: the joint and every drive that moves with it are fast enough, with a margin."""
    transmission = robot.transmission_matrix
    limit = settings.minimum_speed * robot.velocity_limits
    slow = np.abs(state.velocity) <= limit
    slow |= (np.abs(state.velocity @ transmission.T) <= limit) @ (transmission != 0.0)
    reach = round(settings.standstill_margin / step)
    return np.asarray(~binary_dilation(slow, np.ones((2 * reach + 1, 1), dtype=np.bool_)))
