"""The state in which a recording starts."""

from __future__ import annotations

import numpy as np

from ident.recording import Recording
from robots.arrays import FloatArray

_WINDOW = 0.016
"""s, at least, from which the velocity is taken: short against any motion, long against noise."""

_FEWEST = 9
"""Samples, at least."""

_STANDING = 0.01
"""Share of the velocity limits; an arm of which no joint is faster starts at rest."""


def start_velocity(recording: Recording, limits: FloatArray) -> FloatArray:
    """Joint velocities (n,) at the first sample: of the cubic through the first ones, or zero at rest.

    A recording starts in motion where it is a piece after a gap, or was begun while the arm moved.

    Args:
        recording: whose measured positions count.
        limits: (n,) velocity limits.
    """
    samples = max(_FEWEST, int(np.ceil(_WINDOW / recording.sample_time)) + 1)
    if recording.time.shape[0] < samples:
        return np.zeros(recording.joints)
    time = recording.time[:samples] - recording.time[0]
    powers = (time[:, np.newaxis] / time[-1]) ** np.arange(4)
    fitted = np.linalg.lstsq(powers, recording.position[:samples], rcond=None)[0]
    velocity = np.asarray(fitted[1] / time[-1])
    return velocity if (np.abs(velocity) > _STANDING * limits).any() else np.zeros(recording.joints)
