"""A cut-off for the positions, proposed from their spectrum.

Two limits are known. Five times the bandwidth of the motion leaves what is to be seen as it is (the field's
rule; Gautier 1997). Beyond the frequency at which the motion sinks into the noise a filter only lets noise
through, which double differentiation makes large (Wiener's argument). The proposal is the lower of both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ident.ordered import median
from ident.preparation.spectrum import PositionSpectrum
from robots.arrays import FloatArray

_TIMES_BANDWIDTH = 5.0
_POWER_OF_MOTION = 0.99
"""Share of the acceleration's power that the bandwidth of the motion holds."""

_BAND = 1.0
"""Hz over which the spectrum is averaged before it is compared with the noise."""

_LARGEST_SHARE = 0.8
"""Of half the sampling rate."""

_FAR = 2.0
"""A factor between cut-off and proposal from which on it is reported."""


@dataclass(frozen=True)
class CutoffProposal:
    """Proposed cut-off per joint and for the arm.

    Attributes:
        motion: (n,) bandwidth of each joint's motion, Hz.
        noise: (n,) frequency at which each joint's motion sinks into the noise, Hz.
        hz: for the arm, one filter for all joints: the median of the joints' proposals.
    """

    motion: FloatArray
    noise: FloatArray
    hz: float

    def is_far_from(self, cutoff_hz: float) -> bool:
        """Whether a cut-off is off by more than a factor of two."""
        return not 1 / _FAR <= cutoff_hz / self.hz <= _FAR


def propose_cutoff(spectrum: PositionSpectrum) -> CutoffProposal:
    """Propose a low-pass for the positions.

    Args:
        spectrum: of measured positions.
    """
    highest = _LARGEST_SHARE * spectrum.rate / 2
    smooth = _averaged(spectrum)
    joints = range(smooth.shape[1])
    noise = np.array([_into_noise(spectrum, smooth[:, j], j, highest) for j in joints])
    motion = np.array([_bandwidth(spectrum, smooth[:, j], j, noise[j]) for j in joints])
    proposals = np.minimum(_TIMES_BANDWIDTH * motion, noise)
    return CutoffProposal(motion, noise, float(f"{median(np.asarray(proposals)):.2g}"))


def _averaged(spectrum: PositionSpectrum) -> FloatArray:
    """Power over bands of a hertz, so that a single line of the periodogram does not decide."""
    width = max(1, round(_BAND / spectrum.frequency[0]))
    kernel = np.ones(width) / width
    return np.stack(
        [np.convolve(np.pad(p, width, "edge"), kernel, "same") for p in spectrum.power.T], axis=1
    )[width:-width]


def _into_noise(spectrum: PositionSpectrum, power: FloatArray, joint: int, highest: float) -> float:
    """First frequency at which motion and noise have the same power."""
    sunk = np.flatnonzero(power < 2 * spectrum.noise[joint])
    return float(min(spectrum.frequency[sunk[0]], highest)) if sunk.size else highest


def _bandwidth(spectrum: PositionSpectrum, power: FloatArray, joint: int, noise: float) -> float:
    """Frequency that holds the acceleration's power up to where its spectrum is lowest.

    Beyond that valley the noise of the positions, differentiated twice, outgrows the motion. The motion is
    where speeds are largest: of accelerations, those of a noise that is not white may be larger.
    """
    chosen = spectrum.frequency <= noise
    if np.count_nonzero(chosen) < 2:
        return noise
    frequency = spectrum.frequency[chosen]
    acceleration = power[chosen] * frequency**4
    speed = power[chosen] * frequency**2
    peak = int(np.argmax(speed[frequency <= max(noise / 2, frequency[0])]))
    valley = peak + int(np.argmin(acceleration[peak:])) + 1
    motion = np.maximum(spectrum.power[chosen, joint][:valley] - spectrum.noise[joint], 0.0)
    gathered = np.cumsum(motion * frequency[:valley] ** 4)
    if gathered[-1] == 0.0:
        return noise
    return float(frequency[np.searchsorted(gathered, _POWER_OF_MOTION * gathered[-1])])
