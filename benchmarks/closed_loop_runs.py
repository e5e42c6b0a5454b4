"""Recordings of an independent simulated arm, whose truth and noise are known: what Monte Carlo runs on.

The arm is that of ``drivers.simulated``: its own dynamics, bristle friction, encoders with counts, drives
that step at their own rate. Nothing of it is shared with the simulation that gives the instruments.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivers.simulated import PlantTruth, draw_truth, simulate_offline
from ident import Recording
from robots import Robot
from robots.arrays import FloatArray

_HARMONICS = 5
_RAMP = 0.5
"""s over which the motion begins and ends."""


def motion(robot: Robot, duration: float, seed: int) -> FloatArray:
    """Set-points that start and end at home at rest, samples × joints, rad or m.

    Five harmonics of 2/duration with random phases; the fastest moment takes 60 % of a joint's speed, and no
    joint leaves 80 % of its range.
    """
    generator = np.random.default_rng(seed)
    time = np.arange(0.0, duration, robot.bus.cycle_time)
    shape = np.zeros((time.size, robot.n))
    for joint in range(robot.n):
        for order in range(1, _HARMONICS + 1):
            phase, size = generator.uniform(0.0, 2.0 * np.pi), generator.uniform(0.5, 1.0) / order
            shape[:, joint] += size * np.sin(4.0 * np.pi * order / duration * time + phase)
    rise = np.clip(np.minimum(time, time[-1] - time) / _RAMP, 0.0, 1.0)
    shape = shape * (rise**3 * (10.0 - 15.0 * rise + 6.0 * rise**2))[:, np.newaxis]
    speed = np.abs(np.gradient(shape, robot.bus.cycle_time, axis=0)).max(axis=0)
    home = np.array(robot.home)
    room = 0.8 * np.minimum(robot.upper - home, home - robot.lower)
    factor = np.minimum(0.6 * robot.velocity_limits / speed, room / np.abs(shape).max(axis=0))
    return np.asarray(home + factor * shape)


def noisy_truth(robot: Robot, seed: int, encoder: float = 1.0, run: int = 0) -> PlantTruth:
    """An arm drawn around its description, with so many times its encoder noise.

    Args:
        robot: the description.
        seed: of the arm.
        encoder: factor on the noise of the readings before they are rounded to counts.
        run: seed of the noise; the arm stays the same.
    """
    truth = draw_truth(robot, seed)
    noise = tuple(encoder * deviation for deviation in truth.encoder_noise)
    return replace(truth, seed=run, encoder_noise=noise)


def record(robot: Robot, truth: PlantTruth, reference: FloatArray) -> Recording:
    """What a capture of that run would hold."""
    run = simulate_offline(robot, truth, reference)
    return Recording("simulated arm", run.time, run.reference, run.position, run.control_signal)
