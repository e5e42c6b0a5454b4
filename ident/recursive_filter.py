"""Recursive filters of samples, run forward and in reverse so that they shift nothing in time.

A low-pass by the bilinear transform has all its zeros at half the sampling rate and its poles p beside one
another near a constant's. Its impulse response is a sum of pᵏ, so samples are taken in blocks: within a block
it is a product with a matrix, and from block to block one complex number per pole is handed on. That has the
speed of LAPACK's band solver and, since no poles are multiplied out to a polynomial, less rounding; and
``scipy.linalg`` and ``scipy.signal`` take as long to load as a log takes to be filtered.

Sources: Oppenheim and Schafer, Discrete-Time Signal Processing (Butterworth and Chebyshev I prototypes,
bilinear transform, partial fractions); MATLAB's ``filtfilt`` for padding and initial states.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from robots.arrays import FloatArray

ComplexArray = NDArray[np.complex128]

_BLOCK = 32
"""Samples that are one product."""

_IN_CACHE = 1 << 16
"""Values that are filtered together: half a megabyte; of more, memory is asked for and cleared each time."""

_GONE = 1e-20
"""Of a pole's power; blocks so far apart do not know of each other."""


@dataclass(frozen=True)
class RecursiveFilter:
    """A filter g·(1 + z⁻¹)ᵐ / ∏(1 − pₖ·z⁻¹).

    Attributes:
        gain: g.
        poles: (N,) p, distinct, real ones and both of each pair.
        zeros: m, at most N.
    """

    gain: float
    poles: ComplexArray
    zeros: int

    @cached_property
    def steady(self) -> float:
        """What is left of a constant."""
        return float((self.gain * 2.0**self.zeros / np.prod(1.0 - self.poles)).real)

    @property
    def slowest(self) -> float:
        """Share of its state that it still has one sample later."""
        return float(np.abs(self.poles).max())

    def both_ways(self, series: FloatArray, padding: int) -> FloatArray:
        """Forward and in reverse, channels × samples in and out.

        Both ends are continued by their point reflections, and each pass begins in the state that its first
        sample would have left had it always been there.

        Args:
            series: channels × samples.
            padding: samples by which the ends are continued; fewer than there are.
        """
        samples = series.shape[1]
        found = np.empty(series.shape)
        rows = max(1, _IN_CACHE // max(samples, 1))
        for first in range(0, len(series), rows):
            part = series[first : first + rows]
            before = 2.0 * part[:, :1] - part[:, padding:0:-1]
            behind = 2.0 * part[:, -1:] - part[:, -2 : -2 - padding : -1]
            values = np.concatenate([before, part, behind], axis=1) if padding else part
            for _ in range(2):
                values = self._settled(values)[:, ::-1]
            found[first : first + rows] = values[:, padding : padding + samples]
        return found

    def _settled(self, values: FloatArray) -> FloatArray:
        """One pass, begun in the steady state of the first sample; channels × samples."""
        within, handed_on, powers = self._blocks
        (channels, samples), blocks = values.shape, -(-values.shape[1] // _BLOCK)
        driven = np.zeros((channels, blocks * _BLOCK))
        np.subtract(values, values[:, :1], out=driven[:, :samples])
        both = (driven.reshape(-1, _BLOCK) @ within).reshape(channels, blocks, -1)
        found = both[..., :_BLOCK]
        state = np.ascontiguousarray(both[..., _BLOCK:]).view(np.complex128)
        apart = 1
        while apart < blocks and np.abs(powers).max() > _GONE:
            state[:, apart:] += state[:, :-apart] * powers
            apart, powers = 2 * apart, powers**2
        found[:, 1:] += state[:, :-1].view(np.float64) @ handed_on
        filtered: FloatArray = found.reshape(channels, -1)[:, :samples]
        filtered += self.steady * values[:, :1]
        return filtered

    @cached_property
    def _blocks(self) -> tuple[FloatArray, FloatArray, ComplexArray]:
        """What a block's samples make of themselves and leave behind; what is left behind makes of the next
        block; and how much of it is left one block later.
        """
        apart = self.poles[:, np.newaxis] - self.poles
        np.fill_diagonal(apart, 1.0)
        share = self.gain * (self.poles + 1.0) ** self.zeros * self.poles ** (self.poles.size - self.zeros)
        share /= np.prod(apart, axis=1)
        weight = np.where(self.poles.imag == 0.0, 1.0, np.where(self.poles.imag > 0.0, 2.0, 0.0))
        poles, share = self.poles[weight > 0.0], (share * weight)[weight > 0.0]
        power = poles ** np.arange(_BLOCK)[:, np.newaxis]
        heard = share * power
        impulse = np.concatenate([[self.gain], heard.real.sum(axis=1)[:-1]])
        late = np.arange(_BLOCK) - np.arange(_BLOCK)[:, np.newaxis]
        own = np.where(late >= 0, impulse[np.maximum(late, 0)], 0.0)
        handed_on = np.stack([heard.real, -heard.imag], axis=2).reshape(_BLOCK, -1).T
        within = np.concatenate([own, power[::-1].copy().view(np.float64)], axis=1)
        return within, np.ascontiguousarray(handed_on), poles**_BLOCK


@lru_cache(maxsize=32)
def butterworth(order: int, cutoff: float) -> RecursiveFilter:
    """Butterworth's low-pass.

    Args:
        order: N.
        cutoff: −3 dB frequency, of half the sampling rate.
    """
    return _bilinear(-np.exp(1j * _angles(order)), cutoff, 1.0)


@lru_cache(maxsize=32)
def chebyshev(order: int, ripple: float, cutoff: float) -> RecursiveFilter:
    """Chebyshev's low-pass of type I and even order.

    Args:
        order: N, even: a constant is at the lower edge of the ripple.
        ripple: of the pass band, dB.
        cutoff: frequency at which the ripple ends, of half the sampling rate.
    """
    bend = np.arcsinh(1.0 / np.sqrt(10.0 ** (0.1 * ripple) - 1.0)) / order
    return _bilinear(-np.sinh(bend + 1j * _angles(order)), cutoff, 10.0 ** (-ripple / 20.0))


def _angles(order: int) -> FloatArray:
    return np.pi * np.arange(1 - order, order, 2) / (2 * order)


def _bilinear(poles: ComplexArray, cutoff: float, steady: float) -> RecursiveFilter:
    """The digital filter of an analogue one with these poles and its edge at 1 rad/s."""
    warped = np.tan(0.5 * np.pi * cutoff) * poles
    digital = (1.0 + warped) / (1.0 - warped)
    gain = steady * float(np.prod(1.0 - digital).real) / 2.0**poles.size
    return RecursiveFilter(gain, digital, poles.size)
