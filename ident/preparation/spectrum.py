"""The spectrum of measured positions: motion at low frequencies, the encoder's noise at high ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.filters import power_density
from ident.recording import Recording
from robots.arrays import FloatArray

_WINDOW = 2.0
"""s; length of the averaged pieces: half a hertz of resolution."""

_TAIL = (0.5, 0.95)
"""Share of half the sampling rate in which noise is looked for."""

_REWEIGHTED = 10


@dataclass(frozen=True)
class PositionSpectrum:
    """Power densities of all joints, one-sided.

    Attributes:
        frequency: (f,) Hz, without zero.
        power: f × joints, rad²/Hz (or m²/Hz).
        noise: (n,) density of the white part, rad²/Hz (or m²/Hz).
        rate: samples per second.
    """

    frequency: FloatArray
    power: FloatArray
    noise: FloatArray
    rate: float

    @property
    def deviation(self) -> FloatArray:
        """(n,) standard deviation of the white noise of a sample, rounding included; rad (or m)."""
        return np.asarray(np.sqrt(self.noise * self.rate / 2))

    @property
    def acceleration(self) -> FloatArray:
        """Power of the acceleration, noise included; f × joints, (rad/s²)²/Hz."""
        return np.asarray(self.power * (2 * np.pi * self.frequency[:, np.newaxis]) ** 4)


def position_spectrum(recordings: tuple[Recording, ...]) -> PositionSpectrum:
    """Welch's periodogram of all recordings together, each weighted by its length.

    Computed from second differences, whose spectrum is flat enough not to leak, and taken back to positions.

    Args:
        recordings: of one arm; sampled in the same way.
    """
    step = recordings[0].sample_time
    # Short records give short pieces; the tail still holds enough frequencies to average.
    shortest = min(recording.time.shape[0] - 2 for recording in recordings)
    piece = max(8, min(round(_WINDOW / step), shortest))
    total, weight = np.zeros(1), 0
    frequency = np.empty(0)
    for recording in recordings:
        differences = np.diff(recording.position, 2, axis=0)
        frequency, power = power_density(differences, 1 / step, piece)
        total = total + power * recording.time.shape[0]
        weight += recording.time.shape[0]
    frequency = frequency[1:]
    gain = (2 * np.sin(np.pi * frequency * step)) ** 4
    density = np.asarray(total / weight)[1:] / gain[:, np.newaxis]
    noise = np.array([_white_part(frequency, column, 0.5 / step) for column in density.T])
    return PositionSpectrum(frequency, density, noise, 1 / step)


def _white_part(frequency: FloatArray, power: FloatArray, nyquist: float) -> float:
    """N of power ≈ N + c/f⁴ in the tail: white noise, beside motion under white torque noise.

    A periodogram scatters in proportion to its mean, so each point is weighted by the fit itself.
    """
    tail = (frequency > _TAIL[0] * nyquist) & (frequency < _TAIL[1] * nyquist)
    if not tail.any() or not power[tail].any():
        return 0.0
    shape = (nyquist / frequency[tail]) ** 4
    columns = np.stack([np.ones_like(shape), shape], axis=1)
    scale = float(power[tail].mean())
    fitted = np.full(shape.size, 1.0)
    parts = np.zeros(2)
    for _ in range(_REWEIGHTED):
        parts = two_shares(columns / fitted[:, np.newaxis], power[tail] / scale / fitted)
        fitted = np.maximum(columns @ parts, 1e-9)
    return float(parts[0] * scale)


def two_shares(columns: FloatArray, values: FloatArray) -> FloatArray:
    """(2,) least squares of values (f,) by two columns of which neither counts less than nothing."""
    both = np.asarray(np.linalg.lstsq(columns, values, rcond=None)[0], dtype=np.float64)
    if (both >= 0.0).all():
        return both
    squares = np.sum(columns**2, axis=0)
    alone = np.maximum(columns.T @ values, 0.0) / np.where(squares > 0.0, squares, 1.0)
    best = int(np.argmax(alone**2 * squares))  # by how much each takes off alone
    return np.where(np.arange(2) == best, alone, 0.0)
