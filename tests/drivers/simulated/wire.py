"""A master without a bus for simulated drives, with a clock that the test turns."""

from __future__ import annotations

import struct

import numpy as np

from drivers.simulated import Faults, PlantTruth
from drivers.simulated.faults import NO_FAULTS
from drivers.simulated.group import DriveGroup
from robots import Robot

PERIOD = 0.004
SWITCHED_ON, ENABLED, QUICK_STOP, FAULT = 0x23, 0x27, 0x07, 0x08
STATE_MASK = 0x6F


class Wire:
    """A master's view of the drives, without a bus: sends frames, collects answers."""

    def __init__(self, robot: Robot, truth: PlantTruth, faults: Faults = NO_FAULTS) -> None:
        self.robot = robot
        self.frames: list[tuple[int, bytes]] = []
        self.now = 100.0
        self.group = DriveGroup(robot, truth, lambda cob_id, data: self.frames.append((cob_id, data)), faults)
        self.group.boot(self.now)

    def send(self, cob_id: int, data: bytes = b"") -> None:
        self.group.receive(cob_id, data, self.now)

    def wait(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end:
            self.now = min(end, max(self.now, self.group.next_event(self.now)))
            self.group.tick(self.now, heard_all=True)

    def write(self, node: int, index: int, subindex: int, data: bytes) -> None:
        request = struct.pack("<BHB", 0x23 | (4 - len(data)) << 2, index, subindex) + data.ljust(4, b"\0")
        self.send(0x600 + node, request)
        assert self.frames[-1] == (0x580 + node, struct.pack("<BHB", 0x60, index, subindex) + bytes(4))

    def cycle(self, controlword: int | None, targets: np.ndarray | None = None) -> dict[int, tuple[int, ...]]:
        """RPDOs, SYNC; the TPDOs by node."""
        if controlword is not None:
            targets = self.here() if targets is None else targets
            for node, target in enumerate(targets, start=1):
                self.send(0x200 + node, struct.pack("<Hi", controlword, int(target)))
        first = len(self.frames)
        self.send(0x080)
        self.now += self.robot.bus.cycle_time
        self.group.tick(self.now, heard_all=True)
        return {
            cob_id - 0x180: struct.unpack("<Hih", data)
            for cob_id, data in self.frames[first:]
            if 0x180 < cob_id < 0x200
        }

    def here(self) -> np.ndarray:
        return np.array([drive.dictionary.integer(0x6064) for drive in self.group.drives])

    def robot_home(self) -> np.ndarray:
        """Target counts of the home posture."""
        return np.rint(self.robot.transmission_matrix @ self.robot.home * self.robot.counts_per_output_unit)

    def states(self) -> list[int]:
        return [drive.dictionary.integer(0x6041) & STATE_MASK for drive in self.group.drives]

    def emergencies(self) -> list[tuple[int, int]]:
        """(node, code) of each EMCY so far."""
        return [
            (cob_id - 0x080, int.from_bytes(data[:2], "little"))
            for cob_id, data in self.frames
            if 0x081 <= cob_id <= 0x0FF
        ]

    def enable(self) -> np.ndarray:
        self.send(0x000, b"\x01\x00")
        self.cycle(0x06)
        start = self.here()
        for word in (0x07, 0x0F):
            self.cycle(word, start)
        assert self.states() == [ENABLED] * len(start)
        return start


def word_of(w: Wire, node: int) -> int:
    return w.group.drives[node - 1].dictionary.integer(0x6041)
