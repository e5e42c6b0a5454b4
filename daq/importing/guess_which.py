"""Which columns are time, position, reference and torque: by name, and by what the data do."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from daq.importing.channels import Channels
from daq.importing.log_quantities import unit_of
from daq.importing.proof import derivative_of, is_same, slope_between, smooth
from daq.recording.errors import CaptureError
from ident import Recording
from ident.listing import SHOWN, listed
from ident.preparation.cutoff import propose_cutoff
from ident.preparation.noise import narrowest_friction_width
from ident.preparation.resampling import clock_of, longest_gap
from ident.preparation.spectrum import PositionSpectrum, position_spectrum
from robots import Identification
from robots.arrays import BoolArray, FloatArray

_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_PERIODS = (5e-5, 0.1)
"""s; sampling periods of arms' logs."""
_RISING = 0.1
"""Share of the steps of a time column that must not be 0."""
_CUTOFFS = (1.0, 0.4)
"""Hz, and share of the sampling rate, between which the cut-off is chosen."""
_GAPS_AT = 10.0
"""Hz; a cut-off as arms have it, by which gaps are judged before there is one."""
_WIDTHS = (1e-6, 0.02)
"""rad/s or m/s."""
_ROUNDED = 1.05
"""So that two digits are never below."""
_VELOCITY = 0.99
"""Correlation with the velocity from which on a channel is one, whatever its name: friction comes near."""
_FOLLOWS = 0.3
"""Of the motion's size: how far a position may be from its reference."""


def position_of(path: Path, series: Sequence[Channels], joints: int) -> Channels:
    """The measured positions: as many columns as the arm has joints, or the most there are below.

    Raises:
        CaptureError: no columns look like positions.
    """
    marks = {"error", "external", "reference", "computed"}
    moving = [c for c in series if np.ptp(c.values, axis=0).any()]
    named = [c for c in moving if c.kind == "position" and not c.marks & marks and len(c.columns) <= joints]
    if not named:
        raise CaptureError(
            f"{path}: no column looks like a measured position; give --columns; {present(series)}"
        )
    most = max(len(c.columns) for c in named)
    felt = {c.parent for c in moving if c.kind == "torque" and not c.marks & marks} - {""}
    return max((c for c in named if len(c.columns) == most), key=lambda c: _position_score(c, felt))


def _position_score(channel: Channels, felt: set[str]) -> int:
    """How likely it is the measured position that goes with the torques; ``felt`` are their parents."""
    marks = channel.marks
    joint = channel.words[-1:] == ("q",)  # theta is the motor's where there is q
    own = "motor" in marks or joint
    return 2 * ("measured" in marks) + own - 3 * ("second" in marks) + 2 * (channel.parent in felt)


def present(series: Sequence[Channels]) -> str:
    """What there is, short."""
    return f"present: {listed([c.label for c in series], few=SHOWN) or 'none'}"


def torques_of(path: Path, others: Sequence[Channels]) -> list[Channels]:
    """What by its name was measured of the torque; a current or a control signal where there is no torque.

    Several where their names say the same; those that never change are left out.

    Raises:
        CaptureError: nothing looks like it.
    """
    kinds = {"torque": 3, "current": 2, "signal": 1}
    live = [c for c in others if np.ptp(c.values, axis=0).any()]
    named = [c for c in live if c.kind in kinds and not c.marks & {"error", "external"}]
    if not named:
        raise CaptureError(
            f"{path}: no column looks like a torque or a current; give --columns; {present(others)}"
        )
    scores = [kinds[c.kind] + 2 * ("measured" in c.marks) - 4 * ("computed" in c.marks) for c in named]
    return [c for c, score in zip(named, scores, strict=True) if score == max(scores)]


def time_of(
    path: Path, same: Sequence[Channels], samples: int, rate: float | None
) -> tuple[FloatArray, dict[str, Any], str]:
    """Times in s of the samples, what the map says of them, and a sentence.

    Raises:
        CaptureError: no column is time, and no sampling rate was given.
    """
    if rate is not None:
        return (
            np.arange(samples) / rate,
            {"sample_rate_hz": rate},
            f"time: {rate:g} samples per second, as given",
        )
    rising = [c for c in same if len(c.columns) == 1 and rises(c.values[:, 0])]
    named = [c for c in rising if c.kind == "time"] or [c for c in rising if not c.kind]
    for channel in named:
        step = float(np.ptp(channel.values[:, 0]) / (samples - 1))
        unit = next((u for u, scale in _UNITS.items() if _PERIODS[0] <= step * scale <= _PERIODS[1]), None)
        if unit is not None:
            file = {} if channel.file is None else {"file": channel.file}
            words = f"time: {channel.label}, {1e3 * step * _UNITS[unit]:.4g} ms apart"
            times = channel.values[:, 0] * _UNITS[unit]
            return times, {"column": channel.columns[0], "unit": unit, **file}, words
    raise CaptureError(f"{path}: no column looks like time; give --sample-rate (samples per second)")


def rises(values: FloatArray) -> bool:
    """Whether a column never falls, and rises often: stamps may be coarse, and a row written twice."""
    steps = np.diff(values)
    return bool((steps >= 0).all() and np.count_nonzero(steps) > _RISING * len(steps))


@dataclass(frozen=True)
class Sampled:
    """Joint positions of a log on an even grid, for proofs.

    Attributes:
        name: of the log.
        taken: (samples,) s.
        grid: (M,) s; evenly over the longest stretch without a long gap.
        position: samples × n, rad or m.
        moving: which columns of the log's channels the joints are.
        raised: times the proposed cut-off that is used.
    """

    name: str
    taken: FloatArray
    grid: FloatArray
    position: FloatArray
    moving: list[int]
    raised: float = 1.0

    @classmethod
    def of(cls, name: str, stamps: FloatArray, position: FloatArray, moving: list[int]) -> Sampled:
        clock = clock_of(name, stamps, position)
        taken = clock.taken
        cuts = [0, *(np.flatnonzero(np.diff(taken) > longest_gap(_GAPS_AT)) + 1), len(taken)]
        begin, end = max(pairwise(cuts), key=lambda ends: ends[1] - ends[0])
        count = int((taken[end - 1] - taken[begin]) / clock.period + 1e-6) + 1
        grid = taken[begin] + clock.period * np.arange(count)
        even = np.column_stack([np.interp(grid, taken, q) for q in position.T])
        return cls(name, taken, grid, even, moving)

    def even(self, values: FloatArray) -> FloatArray:
        """M × channels on the even grid."""
        return np.column_stack([np.interp(self.grid, self.taken, column) for column in values.T])

    @cached_property
    def period(self) -> float:
        return float((self.grid[-1] - self.grid[0]) / (len(self.grid) - 1))

    @cached_property
    def _spectrum(self) -> PositionSpectrum:
        recording = Recording(self.name, self.grid, None, self.position, np.zeros_like(self.position))
        return position_spectrum((recording,))

    @cached_property
    def friction_width(self) -> float:
        """Speed at which dry friction is fully there: as narrow as the noise of the positions lets it."""
        narrowest = narrowest_friction_width(self._spectrum, Identification(cutoff_hz=self.cutoff))
        return float(f"{np.clip(_ROUNDED * narrowest, *_WIDTHS):.2g}")

    @cached_property
    def cutoff(self) -> float:
        """Low-pass of the positions that their spectrum proposes, Hz."""
        proposed = self.raised * propose_cutoff(self._spectrum).hz
        return float(f"{np.clip(proposed, _CUTOFFS[0], _CUTOFFS[1] / self.period):.3g}")

    @cached_property
    def velocity(self) -> FloatArray:
        """Of the smoothed positions, samples × n."""
        return derivative_of(smooth(self.position, self.period, self.cutoff), self.period)

    def is_derivative(self, channel: Channels) -> bool:
        """Whether a channel is the velocity, in whatever unit."""
        other = smooth(self.even(channel.values[:, self.moving]), self.period, self.cutoff)
        correlation = abs(slope_between(self.velocity, other)[1])
        return is_same(correlation) if channel.kind == "velocity" else correlation > _VELOCITY

    def is_followed(self, channel: Channels) -> bool:
        """Whether the position follows a channel: named a reference, and never far from the position."""
        if "reference" not in channel.marks or channel.kind not in ("position", ""):
            return False
        other = self.even(channel.values[:, self.moving])
        slope, correlation = slope_between(self.position, other)
        return is_same(correlation) and correlation > 1 - _FOLLOWS and slope > 0

    def unit_of_reference(self, channel: Channels, unit: str, scale: FloatArray, turning: BoolArray) -> str:
        """The position's unit, or the other of the two where the reference is in that one.

        Args:
            channel: the reference.
            unit: of the position.
            scale: (n,) SI per unit of the position.
            turning: (n,) which joints turn; the others slide.
        """
        small = ["deg" in unit, "mm" in unit]
        other = self.even(channel.values[:, self.moving]) * scale
        for kind, mask in enumerate((turning, ~turning)):
            slope = slope_between(self.position[:, mask], other[:, mask])[0]
            if mask.any() and slope and abs(np.log(abs(slope))) > 1.0:
                small[kind] = not small[kind]
        return unit_of(turning, small[0], small[1])
