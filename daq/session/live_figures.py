"""The figures of a stream under way, kept up to date sample by sample, for whatever shows them."""

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np

from drivers import Samples
from drivers.frames.job import following_error_window
from robots import Robot
from robots.arrays import FloatArray

WINDOW = 1.0
"""Over which peaks and cycle times are taken, s."""


@dataclass(frozen=True)
class Figures:
    """What is known of a stream at a moment; arrays are per joint, SI.

    Attributes:
        cycle: of the last sample; −1 before the first.
        position: of the last sample.
        following_error: reference less position, of the last sample.
        following_error_share: of what ends the run, at the output of the joint's drive.
        torque: of the last sample, N·m (or N).
        torque_peak: largest magnitude within the last second.
        torque_limit: of the joints.
        cycle_time: mean over the last second, s; NaN before there is one.
        longest_cycle: within the last second, s.
        missed: deadlines at which no SYNC was sent, since the start.
        incomplete: SYNCs that some drive did not answer in time, since the start.
    """

    cycle: int
    position: FloatArray
    following_error: FloatArray
    following_error_share: FloatArray
    torque: FloatArray
    torque_peak: FloatArray
    torque_limit: FloatArray
    cycle_time: float
    longest_cycle: float
    missed: int
    incomplete: int


class LiveFigures:
    """Takes samples from one thread and gives figures to others.

    Args:
        robot: the arm.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._period = robot.bus.cycle_time
        self._rows = max(1, round(WINDOW / self._period))
        self._lock = threading.Lock()
        self._recent = Samples.empty(robot.n)
        self._missed = 0
        self._incomplete = 0
        self._window = following_error_window(robot, self._period)
        self._torque_limit = np.array([joint.torque for joint in robot.joint])

    def add(self, samples: Samples) -> None:
        """Samples have come."""
        if not len(samples):
            return
        # A SYNC that is late by k periods and a bit was due k deadlines ago.
        missed = int(np.floor(np.maximum(samples.lateness, 0.0) / self._period).sum())
        incomplete = int((~samples.complete.all(axis=1)).sum())
        with self._lock:
            joined = Samples.concatenate([self._recent, samples])
            last = slice(max(0, len(joined) - self._rows), None)
            self._recent = Samples(**{name: getattr(joined, name)[last] for name in vars(joined)})
            self._missed += missed
            self._incomplete += incomplete

    def now(self) -> Figures:
        """The figures at this moment."""
        with self._lock:
            recent, missed, incomplete = self._recent, self._missed, self._incomplete
        zeros = np.zeros(self._robot.n)
        if not len(recent):
            return Figures(
                -1, zeros, zeros, self._window, zeros, zeros, self._torque_limit, np.nan, np.nan, 0, 0
            )
        torque = self._robot.joint_torque(recent.control_signal)
        error = recent.reference[-1] - recent.position[-1]
        intervals = self._period + np.diff(recent.lateness)
        return Figures(
            cycle=int(recent.cycle[-1]),
            position=recent.position[-1],
            following_error=error,
            following_error_share=np.abs(self._robot.transmission_matrix @ error) / self._window,
            torque=torque[-1],
            torque_peak=np.abs(torque).max(axis=0),
            torque_limit=self._torque_limit,
            cycle_time=float(intervals.mean()) if intervals.size else float("nan"),
            longest_cycle=float(intervals.max()) if intervals.size else float("nan"),
            missed=missed,
            incomplete=incomplete,
        )
