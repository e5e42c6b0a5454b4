"""A motion that shows most effects: all joints at once, fast and slow, within the limits of the arm."""

from __future__ import annotations

import numpy as np

from robots import Robot
from robots.arrays import FloatArray

_HARMONICS = 5
_RANGE_SHARE = 0.6
_SPEED_SHARE = 0.5
_ACCELERATION_SHARE = 0.5
"""Shares of the limits that the motion uses."""
_RAMP = 1.0
"""Time in which the motion grows from standstill, and dies away, s."""


def exercise(robot: Robot, duration: float = 10.0, seed: int = 0) -> FloatArray:
    """Joint positions at each SYNC, (N, n), that start and end at rest at ``robot.home``.

    A sum of sines of random phases per joint (Swevers et al. 1997), under a window that starts and ends it,
    as large as range, speed and acceleration allow. No collision is looked for: it is for arms without walls.

    Args:
        robot: limits, home and SYNC period.
        duration: s.
        seed: of the phases and amplitudes.
    """
    cycle = robot.bus.cycle_time
    time = np.arange(round(duration / cycle), dtype=np.float64) * cycle
    rng = np.random.default_rng(np.random.SeedSequence([seed, 0xE4]))
    order = np.arange(1, _HARMONICS + 1)
    phases = 2.0 * np.pi * np.multiply.outer(time, order) / duration
    window = _window(time, duration)
    home, motion = np.array(robot.home), np.empty((len(time), robot.n))
    for j in range(robot.n):
        a, b = rng.standard_normal((2, _HARMONICS)) / order**0.5
        wave = window * (np.sin(phases) @ a + np.cos(phases) @ b)
        motion[:, j] = home[j] + _largest(robot, j, wave, cycle) * wave
    return motion


def _window(time: FloatArray, duration: float) -> FloatArray:
    """From 0 to 1 and back, twice continuously differentiable."""
    ramp = min(_RAMP, duration / 4)
    share = np.clip(np.minimum(time, duration - time) / ramp, 0.0, 1.0)
    return np.asarray(share**3 * (10.0 - 15.0 * share + 6.0 * share**2))


def _largest(robot: Robot, j: int, wave: FloatArray, cycle: float) -> float:
    """The largest amplitude of a wave that keeps to a joint's share of the limits."""
    room_up = _RANGE_SHARE * (robot.upper[j] - robot.home[j])
    room_down = _RANGE_SHARE * (robot.home[j] - robot.lower[j])
    speed = np.abs(np.gradient(wave, cycle)).max()
    acceleration = np.abs(np.gradient(np.gradient(wave, cycle), cycle)).max()
    return float(
        min(
            room_up / max(wave.max(), 1e-9),
            room_down / max(-wave.min(), 1e-9),
            _SPEED_SHARE * robot.velocity_limits[j] / speed,
            _ACCELERATION_SHARE * robot.acceleration_limits[j] / acceleration,
        )
    )
