"""How noisy the measured positions are, and what that asks of the friction sign."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.ordered import distinct
from ident.preparation.spectrum import PositionSpectrum
from ident.recording import Recording
from robots.arrays import FloatArray
from robots.description import Identification, Robot

_SIGN_CHATTERS_BELOW = 3.0
"""Speeds within so many deviations of their noise have no sign."""

_SMALL_STEPS = 200
"""Increments of up to so many quanta are looked at; rounding in a file spoils larger ones."""

_MULTIPLE = 0.05
"""Departure from a whole multiple, in quanta, that rounding in a file explains."""

_MOSTLY = 0.9
_FEWEST_STEPS = 20


@dataclass(frozen=True)
class NoiseEstimate:
    """Noise of the measured positions and of the speeds computed from them.

    Attributes:
        position: (n,) deviation of a joint's position sample, rad (or m).
        velocity: (n,) deviation of q̇̂ after the low-pass, rad/s (or m/s).
        quantum: (n,) smallest step of the drive outputs' positions, rad (or m); nan where there is none.
    """

    position: FloatArray
    velocity: FloatArray
    quantum: FloatArray

    @property
    def friction_width(self) -> float:
        """The narrowest tanh(q̇/width) that noise does not swing at standstill on any joint."""
        return float(_SIGN_CHATTERS_BELOW * self.velocity.max())


def narrowest_friction_width(spectrum: PositionSpectrum, settings: Identification) -> float:
    """As :attr:`NoiseEstimate.friction_width`, from the spectrum of the positions alone."""
    return float(_SIGN_CHATTERS_BELOW * _velocity_deviation(spectrum, settings).max())


def noise_estimate(
    robot: Robot, recordings: tuple[Recording, ...], spectrum: PositionSpectrum, settings: Identification
) -> NoiseEstimate:
    """Noise from the tail of the spectrum, quantisation from the smallest increments.

    Args:
        robot: its transmission leads to the encoders.
        recordings: measured positions.
        spectrum: of these recordings.
        settings: the low-pass that the speeds come from.
    """
    return NoiseEstimate(
        position=spectrum.deviation,
        velocity=_velocity_deviation(spectrum, settings),
        quantum=np.array([smallest_step(_increments(recordings, row)) for row in robot.transmission_matrix]),
    )


def _increments(recordings: tuple[Recording, ...], row: FloatArray) -> FloatArray:
    """(samples − 1,) of one drive's positions, all recordings; ``row`` of the transmission."""
    return np.concatenate([np.diff(recording.position @ row) for recording in recordings])


def _velocity_deviation(spectrum: PositionSpectrum, settings: Identification) -> FloatArray:
    """√∫(2πf)²·|H|²·N df with H the forward-reverse Butterworth."""
    frequency = np.linspace(0.0, spectrum.rate / 2, 2000)
    passed = 1.0 / (1.0 + (frequency / settings.cutoff_hz) ** (2 * settings.filter_order)) ** 2
    power = np.trapezoid((2 * np.pi * frequency) ** 2 * passed, frequency)
    return np.asarray(np.sqrt(power * spectrum.noise))


def smallest_step(increments: FloatArray) -> float:
    """The quantum of which small increments (samples − 1,) are whole multiples; nan where there is none."""
    sizes = np.abs(increments)
    moved = sizes[sizes > 1e-9 * sizes.max(initial=0.0)]
    if moved.size < _FEWEST_STEPS:
        return float("nan")
    quantum = float(moved.min())
    small = moved[moved < _SMALL_STEPS * quantum]
    multiples = small / quantum
    if small.size < _FEWEST_STEPS:
        return float("nan")
    whole = np.abs(multiples - np.rint(multiples)) < _MULTIPLE
    return quantum if whole.mean() >= _MOSTLY and distinct(np.rint(multiples)).size > 1 else float("nan")
