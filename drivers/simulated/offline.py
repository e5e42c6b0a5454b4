"""The simulated arm without a bus: the same drives and plant, as fast as the machine allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivers.errors import DriveError
from drivers.simulated.bench import Bench
from drivers.simulated.set_points import AxisMode
from drivers.simulated.truth import PlantTruth
from robots import Robot
from robots.arrays import FloatArray, IntArray


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


def simulate_offline(
    robot: Robot, truth: PlantTruth, reference: FloatArray, *, cycle_time: float | None = None
) -> SimulatedRun:
    """Streams a reference to the simulated arm without a bus.

    Row 0 is the target that the drives latch at the SYNC that enables them; the arm then stands at
    ``robot.home``.

    Args:
        robot: the description.
        truth: the arm that is driven.
        reference: joint positions, (N, n), one row per SYNC, rad or m.
        cycle_time: SYNC period, s; the robot's own where None.

    Raises:
        DriveError: the reference has the wrong shape, is not finite, or the cycle does not fit.
    """
    rows = np.asarray(reference, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != robot.n:
        raise DriveError(f"reference has shape {rows.shape}; allowed: (N, {robot.n})")
    if not np.isfinite(rows).all():
        raise DriveError("reference holds values that are not finite")
    bench = Bench(robot, truth)
    if cycle_time is not None:
        bench.set_period(cycle_time)
    scale = robot.counts_per_output_unit
    targets = np.rint(rows @ robot.transmission_matrix.T * scale)
    tracking = np.full(robot.n, AxisMode.TRACKING, dtype=np.int64)
    counts, control, position, velocity = (np.empty_like(rows) for _ in range(4))
    for k in range(len(rows)):
        position[k], velocity[k] = bench.plant.position, bench.plant.velocity
        snapshot = bench.begin_cycle(tracking, targets[k])
        counts[k], control[k] = snapshot.position, snapshot.control_signal
        bench.finish_cycle()
    to_joint = np.linalg.inv(robot.transmission_matrix).T
    cycle = np.arange(len(rows), dtype=np.int64)
    return SimulatedRun(
        cycle=cycle,
        time=cycle.astype(np.float64) * bench.period,
        reference=(targets / scale) @ to_joint,
        position=(counts / scale) @ to_joint,
        control_signal=control_signal_counts(robot, control) * control_signal_resolution(robot),
        true_position=position,
        true_velocity=velocity,
    )


def control_signal_resolution(robot: Robot) -> FloatArray:
    """Control-signal units per count of each drive's control-signal object, (n,)."""
    return np.array([drive.control_signal.per_count for drive in robot.drive])


def control_signal_counts(robot: Robot, control_signal: FloatArray) -> FloatArray:
    """What the 16-bit control-signal objects hold, samples × n, whole numbers within ±32767."""
    counts = np.rint(control_signal / control_signal_resolution(robot))
    return np.asarray(np.clip(counts, -32767, 32767))
