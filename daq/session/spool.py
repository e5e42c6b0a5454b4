"""A run under way, written for readers in other processes: a few lines a second beside its recording.

The service reads this and never touches the process that streams: however many look, no cycle waits for them.
"""

from __future__ import annotations

import json
import logging
import time
from pathlib import Path
from typing import IO

import numpy as np

from daq.session.states import Conduct
from daq.session.watching import Watcher
from drivers import Samples, StreamResult
from robots import Robot
from trajectories import Trajectory

log = logging.getLogger(__name__)

INTERVAL = 0.1
"""s between two lines."""


def spool_path(capture: Path) -> Path:
    """Where the lines of a recording go."""
    return capture.with_suffix(".live")


class Spooling:
    """A watcher that writes what it sees to a file and hands it on.

    Args:
        inner: who watches besides.
        robot: the arm.
        capture: that the stream is recorded in; the lines go beside it.
    """

    def __init__(self, inner: Watcher, robot: Robot, capture: Path) -> None:
        self._inner = inner
        self._robot = robot
        self._path = spool_path(capture)
        self._file: IO[str] | None = None
        self._total = 0
        self._next = 0.0
        self._missed = 0
        self._incomplete = 0

    def begin(self, title: str, trajectory: Trajectory, conduct: Conduct) -> None:
        """A stream is about to start."""
        self._inner.begin(title, trajectory, conduct)
        self._total, self._next, self._missed, self._incomplete = len(trajectory.time), 0.0, 0, 0
        try:
            self._file = self._path.open("w", encoding="utf-8")
        except OSError as error:
            log.warning("%s: nobody can look on: %s", self._path, error)
            return
        joints = self._robot.joint
        units = [(joint.unit, joint.torque_unit) for joint in joints]
        self._write(
            {
                "kind": "begin",
                "title": title,
                "joints": [joint.name for joint in joints],
                "units": units,
                "cycles": self._total,
                "duration": round(self._total * self._robot.bus.cycle_time, 4),
            }
        )

    def samples(self, samples: Samples) -> None:
        """Samples have come: one line for all of them, ten times a second at most."""
        self._inner.samples(samples)
        if not len(samples):
            return
        period = self._robot.bus.cycle_time
        self._missed += int((np.floor(samples.lateness / period + 1e-9)).clip(min=0).sum())
        self._incomplete += int((~samples.complete).any(axis=1).sum())
        if time.monotonic() < self._next:
            return
        self._next = time.monotonic() + INTERVAL
        torque = self._robot.joint_torque(samples.control_signal[-1:])[0]
        self._write(
            {
                "kind": "samples",
                "cycle": int(samples.cycle[-1]),
                "time": round(float(samples.time[-1]), 4),
                "reference": _rounded(samples.reference[-1]),
                "position": _rounded(samples.position[-1]),
                "torque": _rounded(torque),
                "missed": self._missed,
                "incomplete": self._incomplete,
            }
        )

    def end(self, result: StreamResult | None) -> None:
        """It is over."""
        outcome = "failed" if result is None else result.outcome
        self._write(
            {"kind": "end", "outcome": outcome, "missed": 0 if result is None else result.missed_cycles}
        )
        if self._file is not None:
            self._file.close()
            self._file = None
        self._inner.end(result)

    def _write(self, line: dict[str, object]) -> None:
        if self._file is None:
            return
        try:
            self._file.write(json.dumps(line, separators=(",", ":")) + "\n")
            self._file.flush()
        except OSError as error:  # a full disk must not stop the arm
            log.warning("%s: nobody can look on any more: %s", self._path, error)
            self._file = None


def _rounded(values: np.ndarray) -> list[float]:
    return [round(float(value), 6) for value in values]
