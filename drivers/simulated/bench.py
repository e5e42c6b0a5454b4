"""The drives' position loops coupled to the plant, from one SYNC to the next.

The process on the bus calls :meth:`Bench.begin_cycle` and :meth:`Bench.finish_cycle`, the run without a bus
:meth:`Bench.run`. Both call the same compiled code with the same random streams, so equal references give
equal bits. Time advances by one SYNC period per cycle, whatever the clock says.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivers.errors import DriveError
from drivers.simulated import noise
from drivers.simulated.control_loop import ControlLoop
from drivers.simulated.device import described_increments
from drivers.simulated.disturbances import Block, Disturbances
from drivers.simulated.physics.entry_points import compiled
from drivers.simulated.plant import STEP_RATE, Plant
from drivers.simulated.scenario import EMPTY, Scenario
from drivers.simulated.set_points import AxisMode, SetPoints, interpolate, second_difference
from drivers.simulated.truth import PlantTruth
from robots import Robot
from robots.arrays import BoolArray, FloatArray, IntArray

_ENCODER_STREAM, _IDLE_STREAM = 2, 3
_CYCLES_AT_ONCE = 1000
"""SYNC periods for which a run without a bus draws its noise in one go: a few MB."""


@dataclass(frozen=True)
class Snapshot:
    """What the drives see at a SYNC, at the drive outputs, each (n,)."""

    position: FloatArray
    """Encoder readings in counts (whole numbers)."""
    set_point: FloatArray
    """Internal set-points in counts, not rounded."""
    control_signal: FloatArray
    """What the controller step at this instant puts on the motors."""


@dataclass(frozen=True)
class Recorded:
    """A run without a bus, one row per SYNC, each (N, n)."""

    counts: FloatArray
    """Encoder readings (whole numbers)."""
    control_signal: FloatArray
    position: FloatArray
    """True joint positions."""
    velocity: FloatArray
    """True joint velocities."""


class Bench:
    """Position loops, encoders and plant of one simulated arm.

    The random streams start afresh whenever the first axis is released after all were braked. Until then the
    encoders of the braked arm repeat one reading, so that nothing depends on how many SYNCs the master sends
    before it enables: runs with equal seeds and references are equal, whatever happened between them.

    Args:
        robot: the description; its controller is what the drives run.
        truth: the arm that is driven.
        scenario: what the arm has besides.
        counts: of the encoders per rad (or m) of drive output, signed, (n,); as described where None.

    Raises:
        DriveError: the SYNC period is no multiple of the controller's sample time, or the scenario does not
            fit the arm.
    """

    def __init__(
        self, robot: Robot, truth: PlantTruth, scenario: Scenario = EMPTY, counts: FloatArray | None = None
    ) -> None:
        self.robot = robot
        self.seed = truth.seed
        sample_time = robot.controller.sample_time
        self._steps = max(1, math.ceil(sample_time * STEP_RATE - 1e-9))
        self.plant = Plant(robot, truth, sample_time / self._steps, scenario)
        self._counts_per_unit = described_increments(robot) if counts is None else counts
        drives = self.plant.arm.drives
        self._loop = ControlLoop(
            robot.controller,
            self._counts_per_unit,
            self._steps,
            math.ceil(drives["position_delay"].max() / self.plant.step_time),
            math.ceil(drives["torque_delay"].max() / sample_time),
        )
        self.set_points = SetPoints(robot.n, robot.controller.interpolation)
        louder = scenario.noise.encoder if scenario.noise is not None else 1.0
        self.encoder = noise.Encoder(self._counts_per_unit, louder * np.array(truth.encoder_noise))
        self._disturbances = Disturbances(truth, scenario, self.plant.step_time, self._steps)
        self._gain = np.array(truth.gain)
        self.runs = 0
        self._encoder_stream = noise.stream(self.seed, 0, _ENCODER_STREAM)
        self._idle_error = self._draw_idle_error()
        self.period = 0.0
        self._samples = 0
        self.set_period(robot.bus.cycle_time)
        self._errors = np.zeros((self._samples, robot.n))
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

    def compile_ahead(self) -> None:
        """Has everything compiled that a cycle needs, so that the first one comes in time; moves nothing."""
        zeros = np.zeros((self._samples, self.robot.n))
        self._sample(zeros[0], zeros[0], zeros[0], zeros[0])
        still = Block(zeros, np.zeros((self._samples * self._steps, 2 * self.robot.n)))
        self._advance(zeros, zeros, zeros, zeros, still, np.empty((4, 1, self.robot.n)), sampled=True)

    def freeze_encoders(self, frozen: BoolArray) -> None:
        """Makes the encoders that are True repeat their last reading, (n,); the others read again."""
        self._loop.memory.frozen[:] = frozen

    def stand(self, position: FloatArray) -> None:
        """Puts the braked arm at a posture, joint positions (n,)."""
        self.plant.stand(position)
        self._loop.memory.path[:] = self.plant.drive_position()

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
        if self._off.all() and not released.any():
            self._errors = np.tile(self._idle_error, (self._samples, 1))
        else:
            self._errors = self.encoder.block(self._encoder_stream, self._samples)
        if released.any():
            counts = self.encoder.read(self.plant.drive_position(), self._errors[0])
            self._release(released, counts / self._counts_per_unit)
        if released.any() or (off != self._off).any():
            self._switch(off)
        self.set_points.set_modes(modes)
        self.set_points.latch(targets / self._counts_per_unit, self.period, self._samples)
        self.set_points.sample(0)
        memory = self._loop.memory
        now = self.set_points
        added = self._loop.fed_forward(now.velocity, now.acceleration)
        self._sample(now.position, now.velocity, added, self._errors[0])
        reached = self.set_points.position * self._counts_per_unit
        return Snapshot(
            memory.reported_counts.copy(),
            np.where(off, memory.counts, reached),
            memory.reported_signal.copy(),
        )

    def finish_cycle(self) -> None:
        """From the SYNC to the next one: controller samples and plant steps of one period."""
        if self.plant.at_rest:
            return
        block = self._disturbances.block(self._samples)
        set_points, slopes, changes = np.empty((3, self._samples, self.robot.n))
        for sample in range(self._samples):
            if sample > 0:
                self.set_points.sample(sample)
            set_points[sample], slopes[sample] = self.set_points.position, self.set_points.velocity
            changes[sample] = self.set_points.acceleration
        added = self._loop.fed_forward(slopes, changes)
        self._advance(
            set_points, slopes, added, self._errors, block, np.empty((4, 1, self.robot.n)), sampled=True
        )

    def run(self, targets: FloatArray) -> Recorded:
        """Releases all axes and streams targets to them, as one call of compiled code after the other.

        The same as :meth:`begin_cycle` (all axes tracking) and :meth:`finish_cycle` for each row, from an arm
        whose axes are all braked.

        Args:
            targets: target positions in counts at the drive outputs, (N, n).
        """
        self._start_run()
        first = self.encoder.read(self.plant.drive_position(), self._first_errors())
        everything = np.ones(self.robot.n, dtype=np.bool_)
        position = first / self._counts_per_unit
        self._release(everything, position)
        self._switch(~everything)
        rows = np.vstack([position, position, targets / self._counts_per_unit])
        found = np.empty((4, *targets.shape))
        for start in range(0, len(targets), _CYCLES_AT_ONCE):
            stop = min(start + _CYCLES_AT_ONCE, len(targets))
            self._run_block(rows[start : stop + 2], found[:, start:stop])
        return Recorded(*found)

    def _run_block(self, rows: FloatArray, found: FloatArray) -> None:
        """Some cycles: ``rows`` begins with the two targets before them; ``found`` is written."""
        cycles, samples = len(rows) - 2, self._samples
        # set-points and slopes as (cycles, samples, n), each sample of all periods at once.
        filled = np.empty((2, cycles, samples, self.robot.n))
        # The period from SYNC k runs from the target latched at k − 1 to that latched at k.
        targets = (rows[:-2], rows[1:-1], rows[2:])
        length = samples * (self.period / samples)
        for sample in range(samples):
            filled[0, :, sample], filled[1, :, sample] = interpolate(
                self.robot.controller.interpolation, targets, sample / samples, length
            )
        flat = filled.reshape(2, cycles * samples, self.robot.n)
        changes = np.repeat(second_difference(targets, length), samples, axis=0)
        added = self._loop.fed_forward(flat[1], changes)
        errors = self.encoder.block(self._encoder_stream, cycles * samples)
        block = self._disturbances.block(cycles * samples)
        self._advance(flat[0], flat[1], added, errors, block, found, sampled=False)

    def _sample(self, set_point: FloatArray, slope: FloatArray, added: FloatArray, error: FloatArray) -> None:
        plant, loop = self.plant, self._loop
        compiled.sample(plant.arm, plant.motion, loop.law, loop.memory, set_point, slope, added, error)

    def _advance(
        self,
        set_points: FloatArray,
        slopes: FloatArray,
        added: FloatArray,
        errors: FloatArray,
        block: Block,
        found: FloatArray,
        *,
        sampled: bool,
    ) -> None:
        state = compiled.run(
            self.plant.arm,
            self.plant.motion,
            self._loop.law,
            self._loop.memory,
            self._samples,
            sampled,
            set_points,
            slopes,
            added,
            errors,
            block.scales,
            block.torques,
            found[0],
            found[1],
            found[2],
            found[3],
        )
        self.plant.require_fine(state)

    def _first_errors(self) -> FloatArray:
        """The first reading's errors of the run that has just started, which the run will draw again."""
        return np.asarray(self.encoder.block(noise.stream(self.seed, self.runs - 1, _ENCODER_STREAM), 1)[0])

    def _switch(self, off: BoolArray) -> None:
        self.plant.engage(off)
        self._off = off
        self._loop.memory.off[:] = off

    def _start_run(self) -> None:
        self._disturbances.start(self.runs)
        self._encoder_stream = noise.stream(self.seed, self.runs, _ENCODER_STREAM)
        self.runs += 1
        self._idle_error = self._draw_idle_error()

    def _draw_idle_error(self) -> FloatArray:
        """Reading errors of the braked arm before the next run, (n,), in counts."""
        return np.asarray(self.encoder.block(noise.stream(self.seed, self.runs, _IDLE_STREAM), 1)[0])

    def _release(self, axes: BoolArray, position: FloatArray) -> None:
        self.set_points.start_at(axes, position)
        self._loop.reset(axes, position, self.plant.holding_torque() / self._gain)
        self._loop.memory.path[:] = self.plant.drive_position()


def is_multiple(period: float, sample_time: float) -> bool:
    """True where a SYNC period (s) holds a whole number, at least one, of controller samples."""
    return round(period / sample_time) >= 1 and abs(period / sample_time - round(period / sample_time)) < 1e-6
