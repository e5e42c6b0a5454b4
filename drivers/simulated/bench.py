"""The drives' position loops coupled to the plant, from one SYNC to the next.

This is the one code path of the simulated arm: the process on the bus and the run without a bus both
call :meth:`Bench.begin_cycle` and :meth:`Bench.finish_cycle`, so equal references give equal bits. Time
advances by one SYNC period per cycle, whatever the clock says.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivers.errors import DriveError
from drivers.simulated import noise
from drivers.simulated.control_loop import ControlLoop
from drivers.simulated.plant import STEP_RATE, Plant
from drivers.simulated.set_points import AxisMode, SetPoints
from drivers.simulated.truth import PlantTruth
from robots import Robot
from robots.arrays import BoolArray, FloatArray, IntArray

_TORQUE_STREAM, _ENCODER_STREAM, _IDLE_STREAM = 1, 2, 3


@dataclass(frozen=True)
class Snapshot:
    """What the drives see at a SYNC, at the drive outputs, each (n,)."""

    position: FloatArray
    """Encoder readings in counts (whole numbers)."""
    set_point: FloatArray
    """Internal set-points in counts, not rounded."""
    control_signal: FloatArray
    """What the controller step at this instant puts on the motors."""


class Bench:
    """Position loops, encoders and plant of one simulated arm.

    The random streams start afresh whenever the first axis is released after all were braked: runs
    with equal seeds and references are equal, whatever happened between them.

    Args:
        robot: the description; its controller is what the drives run.
        truth: the arm that is driven.

    Raises:
        DriveError: the SYNC period is no multiple of the controller's sample time.
    """

    def __init__(self, robot: Robot, truth: PlantTruth) -> None:
        self.robot = robot
        self.seed = truth.seed
        sample_time = robot.controller.sample_time
        self._steps = max(1, math.ceil(sample_time * STEP_RATE - 1e-9))
        self.plant = Plant(robot, truth, sample_time / self._steps)
        self._loop = ControlLoop(robot.controller)
        self.set_points = SetPoints(robot.n, robot.controller.interpolation)
        counts = robot.counts_per_output_unit
        self.encoder = noise.Encoder(counts, np.array(truth.encoder_noise))
        self._counts_per_unit = counts
        self._torque_noise = noise.TorqueNoise(
            np.array(truth.torque_noise), truth.torque_noise_time_constant, self.plant.step_time
        )
        self._gain = np.array(truth.gain)
        self._idle = noise.stream(self.seed, 0, _IDLE_STREAM)
        self._torque_stream = self._encoder_stream = self._idle
        self.runs = 0
        self.period = 0.0
        self._samples = 0
        self.set_period(robot.bus.cycle_time)
        self._errors = np.zeros((self._samples, robot.n))
        self._output = np.zeros(robot.n)
        self._off: BoolArray = np.ones(robot.n, dtype=np.bool_)

    def set_period(self, period: float) -> None:
        """Sets the SYNC period, s.

        Raises:
            DriveError: it is no multiple of the controller's sample time.
        """
        sample_time = self.robot.controller.sample_time
        if not is_multiple(period, sample_time):
            raise DriveError(
                f"simulated arm: SYNC period {period:g} s; allowed: multiples of the controller's "
                f"sample_time {sample_time:g} s"
            )
        self.period = period
        self._samples = round(period / sample_time)

    @property
    def at_rest(self) -> bool:
        """True where all brakes are engaged and the arm stands still."""
        return self.plant.at_rest

    def begin_cycle(self, modes: IntArray, targets: FloatArray) -> Snapshot:
        """The instant of a SYNC: latches modes and targets, reads the encoders, takes a controller step.

        Args:
            modes: an :class:`AxisMode` per axis, (n,).
            targets: target positions in counts at the drive outputs, (n,).
        """
        off = modes == AxisMode.BRAKED
        released = self._off & ~off
        if released.any() and self._off.all():
            self._start_run()
        stream = self._idle if self._off.all() and not released.any() else self._encoder_stream
        self._errors = self.encoder.block(stream, self._samples)
        counts = self.encoder.read(self.plant.drive_position(), self._errors[0])
        position = counts / self._counts_per_unit
        if released.any():
            self._release(released, position)
        if released.any() or (off != self._off).any():
            self.plant.engage(off)
        self._off = off
        self.set_points.set_modes(modes)
        self.set_points.latch(targets / self._counts_per_unit, self.period, self._samples)
        self.set_points.sample(0)
        self._control(position)
        following = np.where(off, position, self.set_points.position)
        return Snapshot(counts, following * self._counts_per_unit, self._output)

    def finish_cycle(self) -> None:
        """From the SYNC to the next one: controller samples and plant steps of one period."""
        if self.plant.at_rest:
            return
        torques = self._torque_noise.block(self._torque_stream, self._samples * self._steps)
        for sample in range(self._samples):
            if sample > 0:
                self.set_points.sample(sample)
                counts = self.encoder.read(self.plant.drive_position(), self._errors[sample])
                self._control(counts / self._counts_per_unit)
            drive = self._gain * self._output
            for step in range(self._steps):
                self.plant.step(drive + torques[sample * self._steps + step])

    def _control(self, position: FloatArray) -> None:
        if self._off.all():
            self._output = np.zeros(self.robot.n)
            return
        output = self._loop.step(self.set_points.position, self.set_points.velocity, position)
        self._output = np.where(self._off, 0.0, output)

    def _start_run(self) -> None:
        self._torque_stream = noise.stream(self.seed, self.runs, _TORQUE_STREAM)
        self._encoder_stream = noise.stream(self.seed, self.runs, _ENCODER_STREAM)
        self._torque_noise.reset()
        self.runs += 1

    def _release(self, axes: BoolArray, position: FloatArray) -> None:
        self.set_points.start_at(axes, position)
        self._loop.reset(axes, position, self.plant.holding_torque() / self._gain)


def is_multiple(period: float, sample_time: float) -> bool:
    """True where a SYNC period (s) holds a whole number, at least one, of controller samples."""
    ratio = period / sample_time
    return round(ratio) >= 1 and abs(ratio - round(ratio)) < 1e-6
