"""The simulated arm without a bus: the same drives and plant, as fast as the machine allows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivers.errors import DriveError
from drivers.frames.samples import Samples
from drivers.simulated.bench import Bench
from drivers.simulated.device import (
    described_devices,
    increments_per_output_unit,
    units_per_output_unit,
)
from drivers.simulated.scenario import EMPTY, Scenario
from drivers.simulated.truth import PlantTruth
from robots import Robot
from robots.arrays import FloatArray, IntArray

_OPERATION_ENABLED = 0x1237
"""6041h of a drive that follows its targets."""


@dataclass(frozen=True)
class SimulatedRun:
    """One run, sampled at each SYNC. The first four fields are what a master would have recorded.

    ``cycle`` and ``time`` (s) have shape (N,), the others (N, n). Positions are of the joints, rad or m.
    """

    cycle: IntArray
    time: FloatArray
    reference: FloatArray
    position: FloatArray
    control_signal: FloatArray
    true_position: FloatArray
    """Joint positions without encoder, (N, n)."""
    true_velocity: FloatArray
    """Joint velocities, (N, n)."""

    def after(self, cycles: int) -> SimulatedRun:
        """The same without its first cycles."""
        arrays = {name: getattr(self, name)[cycles:] for name in self.__dataclass_fields__}
        return SimulatedRun(**arrays)

    def samples(self) -> Samples:
        """The rows that a master would have recorded: every drive enabled, every TPDO and SYNC in time."""
        shape = self.position.shape
        return Samples(
            cycle=self.cycle,
            time=self.time,
            reference=self.reference,
            position=self.position,
            control_signal=self.control_signal,
            statusword=np.full(shape, _OPERATION_ENABLED, dtype=np.uint16),
            complete=np.ones(shape, dtype=np.bool_),
            lateness=np.zeros(len(self.cycle)),
        )


def simulate_offline(
    robot: Robot,
    truth: PlantTruth,
    reference: FloatArray,
    *,
    cycle_time: float | None = None,
    scenario: Scenario = EMPTY,
    periods: int = 1,
    warm_up: int = 0,
    start: FloatArray | None = None,
    seed: int | None = None,
) -> SimulatedRun:
    """Streams a reference to the simulated arm without a bus.

    Row 0 is the target that the drives latch at the SYNC that enables them; the arm then stands at
    ``start``.

    Args:
        robot: the description.
        truth: the arm that is driven.
        reference: joint positions, (N, n), one row per SYNC, rad or m: one period of them.
        cycle_time: SYNC period, s; the robot's own where None.
        scenario: what the arm has besides.
        periods: how often the reference is repeated, one period after the other.
        warm_up: how many further periods come before those and are left out of the result: the arm is then
            in its periodic motion, and warm.
        start: joint positions, (n,), where the arm stands at first; ``robot.home`` where None.
        seed: of the noise; the truth's own where None.

    Returns:
        ``periods`` · N rows; ``cycle`` goes on counting through the warm-up.

    Raises:
        DriveError: the reference has the wrong shape, is not finite, or the cycle or the scenario does not
            fit.
    """
    rows = _checked(robot, reference)
    if periods < 1 or warm_up < 0:
        raise DriveError(f"periods {periods} and warm_up {warm_up}; allowed: at least 1 and at least 0")
    noisy = truth if seed is None else replace(truth, seed=seed)
    bench = Bench(robot, noisy, scenario)
    if cycle_time is not None:
        bench.set_period(cycle_time)
    if start is not None:
        bench.stand(np.asarray(start, dtype=np.float64))
    devices = described_devices(robot)
    scale = units_per_output_unit(robot, devices)
    per_increment = scale / increments_per_output_unit(robot, devices)
    targets = np.tile(np.rint(rows @ robot.transmission_matrix.T * scale), (warm_up + periods, 1))
    found = bench.run(np.rint(targets / per_increment))
    to_joint = np.linalg.inv(robot.transmission_matrix).T
    cycle = np.arange(len(targets), dtype=np.int64)
    resolution = control_signal_resolution(robot)
    run = SimulatedRun(
        cycle=cycle,
        time=cycle.astype(np.float64) * bench.period,
        reference=(targets / scale) @ to_joint,
        position=(np.rint(found.counts * per_increment) / scale) @ to_joint,
        control_signal=control_signal_counts(robot, found.control_signal) * resolution,
        true_position=found.position,
        true_velocity=found.velocity,
    )
    return run.after(warm_up * len(rows)) if warm_up else run


def _checked(robot: Robot, reference: FloatArray) -> FloatArray:
    rows = np.asarray(reference, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != robot.n:
        raise DriveError(f"reference has shape {rows.shape}; allowed: (N, {robot.n})")
    if not np.isfinite(rows).all():
        raise DriveError("reference holds values that are not finite")
    return rows


def control_signal_resolution(robot: Robot) -> FloatArray:
    """Control-signal units per count of each drive's control-signal object, (n,)."""
    return np.array([drive.control_signal.per_count for drive in robot.drive])


def control_signal_counts(robot: Robot, control_signal: FloatArray) -> FloatArray:
    """What the 16-bit control-signal objects hold of motors that turn with the drive outputs.

    Samples × n, whole numbers within ±32767.
    """
    counts = np.rint(control_signal / control_signal_resolution(robot))
    return np.asarray(np.clip(counts, -32767, 32767))
