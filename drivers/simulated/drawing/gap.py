"""How large an effect is: the torque that the arm's own model cannot explain, against what noise leaves.

The residual is what an inverse dynamic model with the arm's true base figures leaves of the recorded
torque, filtered as an identification would. An effect's *gap* is the rms difference of that residual with and
without the effect, both without noise; the *noise floor* is the rms difference with and without noise,
both without the effect. No identification is involved.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from drivers.simulated.offline import SimulatedRun, simulate_offline
from drivers.simulated.physics.assemble import true_model
from drivers.simulated.scenario import EMPTY, Scenario
from drivers.simulated.truth import PlantTruth
from robots import Robot
from robots.arrays import FloatArray

_EDGE = 0.3
"""Left out at either end, where the filter has not settled, s."""
_ROW_RATE = 100.0
"""Rows per second that are looked at."""


@dataclass(frozen=True)
class Ruler:
    """Measures scenarios on one arm and one motion."""

    robot: Robot
    truth: PlantTruth
    reference: FloatArray
    """(N, n) per SYNC."""
    quiet: SimulatedRun
    """Without effect and noise."""
    residual: FloatArray
    """Of that run, rows × n, N·m at the joints."""
    floor: FloatArray
    """Noise floor, (n,), N·m."""

    @classmethod
    def of(cls, robot: Robot, truth: PlantTruth, reference: FloatArray) -> Ruler:
        """The ruler of an arm and a motion: one run without noise and one with.

        Args:
            robot: the description.
            truth: the arm, noise included.
            reference: (N, n) joint positions per SYNC, from ``robot.home``.
        """
        quiet = simulate_offline(robot, silent(truth), reference)
        noisy = simulate_offline(robot, truth, reference)
        residual = torque_residual(robot, truth, quiet)
        floor = _rms(torque_residual(robot, truth, noisy) - residual)
        return cls(robot, truth, reference, quiet, residual, floor)

    def gap(self, scenario: Scenario) -> FloatArray:
        """The gap that a scenario makes at each joint, (n,), N·m.

        Raises:
            DriveError: the scenario does not fit the arm.
        """
        quiet = scenario.model_copy(update={"noise": None})
        run = simulate_offline(self.robot, silent(self.truth), self.reference, scenario=quiet)
        return _rms(torque_residual(self.robot, self.truth, run) - self.residual)


def silent(truth: PlantTruth) -> PlantTruth:
    """The same arm without process torque and encoder noise."""
    none = (0.0,) * len(truth.gain)
    return replace(truth, torque_noise=none, encoder_noise=none)


def torque_residual(robot: Robot, truth: PlantTruth, run: SimulatedRun) -> FloatArray:
    """Recorded torque minus that of the arm's base figures, rows × n, N·m at the joints."""
    cycle = float(run.time[1] - run.time[0])
    recorded = robot.joint_torque(run.control_signal)
    position = _smooth(robot, run.position, cycle)
    velocity = np.gradient(position, cycle, axis=0)
    acceleration = np.gradient(velocity, cycle, axis=0)
    torque = _smooth(robot, recorded, cycle)
    edge, every = round(_EDGE / cycle), max(1, round(1.0 / (_ROW_RATE * cycle)))
    rows = slice(edge, len(position) - edge, every)
    return np.asarray(
        torque[rows] - _base_torque(robot, truth, position[rows], velocity[rows], acceleration[rows])
    )


def _base_torque(
    robot: Robot, truth: PlantTruth, position: FloatArray, velocity: FloatArray, acceleration: FloatArray
) -> FloatArray:
    model = true_model(robot, truth, EMPTY)
    data = model.createData()
    states = zip(position, velocity, acceleration, strict=True)
    links = np.array([pin.rnea(model, data, q, v, a) for q, v, a in states])
    matrix = robot.transmission_matrix
    speed, change = velocity @ matrix.T, acceleration @ matrix.T
    width = max(robot.identification.friction_width, 1e-4)
    drives = truth.per_drive("Ia") * change + truth.per_drive("Fv") * speed
    drives = drives + truth.per_drive("Fc") * np.tanh(speed / width)
    return np.asarray(links + truth.per_drive("off") + drives @ matrix)


def _smooth(robot: Robot, samples: FloatArray, cycle: float) -> FloatArray:
    # Here, because the process of the drives imports this package and never draws: it starts sooner without.
    from scipy.signal import butter, sosfiltfilt

    cutoff = min(robot.identification.cutoff_hz, 0.45 / cycle)
    sections = butter(robot.identification.filter_order, cutoff, fs=1.0 / cycle, output="sos")
    return np.asarray(sosfiltfilt(sections, samples, axis=0))


def _rms(rows: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.mean(np.square(rows), axis=0)))
