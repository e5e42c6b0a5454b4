"""What the bus says of a stream that is killed, and what of its recording is lost."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np

from daq.recording.capture import CaptureError
from daq.recording.reader import read_capture
from drivers import Channel, open_bus
from drivers.frames.layout import RPDO, rpdo_cob_id, tpdo_cob_id
from drivers.frames.units import Units
from robots import Robot
from robots.arrays import FloatArray

SECONDS = 2.0


class Wire:
    """Hears what the drive says of its torque, and which targets it is sent; times are the kernel's."""

    def __init__(self, channel: Channel, robot: Robot) -> None:
        self._torque: list[tuple[float, bool]] = []
        self._targets: list[tuple[float, int]] = []
        (drive,) = robot.drive
        self._tpdo, rpdo = tpdo_cob_id(drive.node_id), rpdo_cob_id(drive.node_id)
        self._bus = open_bus(channel, [self._tpdo, rpdo])
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._ended.is_set():
            while (message := self._bus.recv(0.1)) is not None:
                if message.arbitration_id == self._tpdo:
                    self._torque.append((message.timestamp, message.data[0] & 0x6F == 0x27))
                else:
                    self._targets.append((message.timestamp, RPDO.unpack(message.data)[1]))

    def close(self) -> None:
        """After what has come so far."""
        self._ended.set()
        self._thread.join()
        self._bus.shutdown()

    @property
    def torque(self) -> bool:
        """Whether there was any at all."""
        return any(torque for _, torque in self._torque)

    def torque_at(self, moment: float) -> bool:
        """Whether there was torque then, s since the epoch."""
        return next((torque for when, torque in reversed(self._torque) if when <= moment), False)

    def rows_at(self, moment: float, robot: Robot) -> int | None:
        """How many rows of the motion had gone out then; None before its target has gone 1 % of its way.

        In which row it does is known, and one goes out per period: cycles that the master skipped count as
        lost. What is sent before the motion begins is where the arm stands.
        """
        sent = [(when, target) for when, target in self._targets if when <= moment]
        wanted = Units.of(robot).counts(path(np.array(robot.home), SECONDS, robot))[:, 0]
        way = np.abs(wanted - wanted[0])
        least = way.max() / 100
        gone = next((when for when, target in sent if abs(target - sent[0][1]) > least), None)
        if gone is None:
            return None
        return int(np.argmax(way > least)) + round((moment - gone) / robot.bus.cycle_time)


def lost_seconds(out: Path, rows: int | None, robot: Robot) -> float | None:
    """s of the motion that had gone out when it was killed and are not in the file; None where none had."""
    if rows is None:
        return None
    over = min(rows * robot.bus.cycle_time, SECONDS)
    try:
        samples = read_capture(out).samples
    except CaptureError:
        return over
    return max(0.0, over - float(samples.time[-1]) if len(samples) else over)


def path(start: FloatArray, seconds: float, robot: Robot) -> FloatArray:
    """A little out and back, from where the arm stands."""
    t = np.linspace(0.0, 1.0, round(seconds / robot.bus.cycle_time))
    bell = 64 * (t * (1 - t)) ** 3
    return np.asarray(start + 0.01 * bell[:, None])
