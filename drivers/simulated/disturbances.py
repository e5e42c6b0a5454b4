"""What comes at the arm by time or by chance: noise, vibration, bursts, dither, lost samples.

All of it is drawn block by block, and the same whatever the blocks' sizes: the bus takes one SYNC period at
a time, a run without a bus takes many.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drivers.simulated import noise
from drivers.simulated.scenario import Scenario
from drivers.simulated.truth import PlantTruth
from robots.arrays import FloatArray

_TORQUE_STREAM, _BURST_STREAM, _WALK_STREAM, _MISS_STREAM = 1, 4, 5, 6


class Block(NamedTuple):
    """The disturbances of some controller samples."""

    scales: FloatArray
    """(samples, n) share of each control signal that reaches its current loop."""
    torques: FloatArray
    """(samples · steps, 2 n) on the rotors at the drive outputs, then on the joints, N·m."""


class Disturbances:
    """The disturbances of one run after the other.

    Args:
        truth: noise levels.
        scenario: noise factors and effects in time.
        step: plant step, s.
        steps: plant steps per controller sample.
    """

    def __init__(self, truth: PlantTruth, scenario: Scenario, step: float, steps: int) -> None:
        self._n = len(truth.gain)
        self._step, self._steps = step, steps
        self._scenario = scenario
        louder = scenario.noise.torque if scenario.noise is not None else 1.0
        colour = truth.torque_noise_time_constant
        if scenario.noise is not None and scenario.noise.time_constant is not None:
            colour = scenario.noise.time_constant
        self._noise = noise.TorqueNoise(louder * np.array(truth.torque_noise), colour, step)
        self._seed = truth.seed
        self.start(0)

    def start(self, run: int) -> None:
        """Begins a run with random streams of its own."""
        self._torque_stream = noise.stream(self._seed, run, _TORQUE_STREAM)
        self._burst_stream = noise.stream(self._seed, run, _BURST_STREAM)
        self._walk_stream = noise.stream(self._seed, run, _WALK_STREAM)
        self._miss_stream = noise.stream(self._seed, run, _MISS_STREAM)
        self._noise.reset()
        self._done = 0
        self._bursts = [(0, 0.0)] * len(self._scenario.torque_bursts)
        self._misses = [0] * len(self._scenario.missed_samples)

    def block(self, samples: int) -> Block:
        """Those of the next controller samples."""
        count = samples * self._steps
        torques = np.zeros((count, 2 * self._n))
        torques[:, : self._n] = self._noise.block(self._torque_stream, count)
        time = (self._done + np.arange(count)) * self._step
        for shaking in self._scenario.vibration:
            wave = np.sin(2.0 * np.pi * shaking.frequency * time + shaking.phase)
            torques[:, self._n + shaking.joint - 1] += shaking.amplitude * wave
        for square in self._scenario.dither:
            turns = square.frequency * time
            sign = np.where(turns - np.floor(turns) < 0.5, 1.0, -1.0)
            torques[:, self._n + square.joint - 1] += square.amplitude * sign
        for index, entry in enumerate(self._scenario.torque_bursts):
            walk = self._walk(index, samples)
            torques[:, self._n + entry.joint - 1] += np.repeat(walk, self._steps)
        self._done += count
        return Block(self._scales(samples), torques)

    def _walk(self, index: int, samples: int) -> FloatArray:
        """A random walk during bursts, zero between them."""
        entry = self._scenario.torque_bursts[index]
        sample_time = self._step * self._steps
        length = max(1, round(entry.duration / sample_time))
        begins = self._burst_stream.random(samples) < entry.rate * sample_time
        moves = self._walk_stream.standard_normal(samples) * entry.deviation / np.sqrt(length)
        left, value = self._bursts[index]
        walk = np.empty(samples)
        for k in range(samples):
            if left == 0 and begins[k]:
                left = length
            value = value + moves[k] if left > 0 else 0.0
            left = max(left - 1, 0)
            walk[k] = value
        self._bursts[index] = (left, float(value))
        return walk

    def _scales(self, samples: int) -> FloatArray:
        scales = np.ones((samples, self._n))
        sample_time = self._step * self._steps
        for index, entry in enumerate(self._scenario.missed_samples):
            begins = self._miss_stream.random(samples) < entry.rate * sample_time
            left = self._misses[index]
            for k in range(samples):
                if left == 0 and begins[k]:
                    left = entry.samples
                if left > 0:
                    scales[k, entry.drive - 1] = 0.0
                    left -= 1
            self._misses[index] = left
        return scales
