"""The process of the simulated arm: one bus, one loop.

It reads one JSON line on standard input that says what to simulate, answers with one JSON line on standard
output once every node has booted (or with the reason why not), and then serves frames until its
parent is gone: standard input closes, the parent's process id changes, or SIGTERM comes. SIGINT is left to
the parent.
"""

from __future__ import annotations

import json
import os
import select
import signal
import sys
import time
from collections.abc import Callable
from typing import Any

import can

from drivers.bus.access import listen_for_traffic, open_bus
from drivers.bus.bus_lock import BusLock
from drivers.bus.error_frames import ERROR_FLAG
from drivers.bus.ports import FramePort
from drivers.cyclic import realtime
from drivers.errors import BusError, BusOccupied, DriveError
from drivers.frames.channel import Channel
from drivers.simulated.device import described_devices
from drivers.simulated.faults import Faults
from drivers.simulated.frame_sender import FrameSender
from drivers.simulated.group import DriveGroup
from drivers.simulated.quirks import quirks_of
from drivers.simulated.scenario import EMPTY, Scenario, load_scenario
from drivers.simulated.seal import sealed_content, write_seal
from drivers.simulated.truth import PlantTruth, draw_truth
from robots import RobotFileError, load

LOCK_ROLE = "drives"
_PARENT_CHECK = 0.1
"""How often the process looks whether its parent still lives, s."""


class _Lifeline:
    """Knows when to end: the parent closed the pipe or died, or SIGTERM came."""

    def __init__(self, parent: int) -> None:
        self._parent = parent
        self._cut = False
        self._next = 0.0
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, self._on_signal)

    def _on_signal(self, number: int, frame: object) -> None:
        self._cut = True

    def holds(self, now: float) -> bool:
        """Whether to go on; asks the system only now and then."""
        if now >= self._next and not self._cut:
            self._next = now + _PARENT_CHECK
            readable, _, _ = select.select([sys.stdin.buffer], [], [], 0)
            closed = bool(readable) and not os.read(sys.stdin.fileno(), 4096)
            self._cut = closed or os.getppid() != self._parent
        return not self._cut


def main() -> int:
    """Runs until the lifeline is cut; exit code 0, or 2 where it could not start."""
    lifeline = _Lifeline(os.getppid())
    order = json.loads(_read_line())
    channel = Channel(order["interface"], order["channel"])
    try:
        robot = load(order["robot"])
        truth = PlantTruth.from_dict(order["truth"]) if order["truth"] else draw_truth(robot, order["seed"])
        scenario = _scenario(order["scenario"])
        scenario.check(robot)
        quirks = quirks_of(order["profile"])
        with BusLock(channel, LOCK_ROLE):
            _require_silence(channel)
            with open_bus(channel, bitrate=robot.bus.bitrate) as bus:
                faults = Faults.from_dict(order["faults"])
                sender = FrameSender(bus)
                group = DriveGroup(
                    robot,
                    truth,
                    sender,
                    faults,
                    scenario,
                    noise_seed=order["noise_seed"],
                    send_together=sender.together,
                    devices=described_devices(robot, quirks),
                )
                group.boot(time.monotonic())
                # Answers in time even where ordinary processes keep the processors busy.
                realtime.prepare(realtime.DRIVES_PRIORITY)
                _say({"truth": _told(truth, scenario, order["seal"])})
                serve(group, sender.port, lifeline.holds)
    except (BusError, DriveError, RobotFileError, can.CanError) as error:
        _say({"error": type(error).__name__, "message": str(error)})
        return 2
    return 0


def _scenario(given: str | dict[str, Any] | None) -> Scenario:
    """A scenario from its file, or as its plain numbers."""
    if given is None:
        return EMPTY
    return load_scenario(given) if isinstance(given, str) else Scenario.from_dict(given)


def _told(truth: PlantTruth, scenario: Scenario, seal: str | None) -> dict[str, Any] | None:
    """What the parent learns of the arm: everything, or nothing where it goes into a sealed file."""
    if seal is None:
        return truth.as_dict()
    write_seal(seal, sealed_content(truth, scenario))
    return None


def serve(group: DriveGroup, port: FramePort, goes_on: Callable[[float], bool]) -> None:
    """Serves frames to booted drives until ``goes_on`` (asked with the monotonic time, s) says no.

    Raises:
        can.CanError: the bus fails.
    """
    now = time.monotonic()
    while goes_on(now):
        port.wait(max(min(group.next_event(now) - now, _PARENT_CHECK), 0.0))
        now = time.monotonic()
        frames = port.drain()
        for cob_id, data in frames:
            if not cob_id & ERROR_FLAG:
                group.receive(cob_id, data, now)
        if frames:
            now = time.monotonic()
        group.tick(now, heard_all=not frames)


def _require_silence(channel: Channel) -> None:
    heard = listen_for_traffic(channel)
    if heard:
        ids = ", ".join(f"0x{cob_id:03X}" for cob_id in sorted(heard)[:4])
        raise BusOccupied(
            f"{channel} is occupied: frames arrive on it ({ids}) before the simulated drives started;"
            " give another --channel"
        )


def _read_line() -> str:
    """The first line of standard input, read without a buffer so that closing it can be seen later."""
    data = b""
    while not data.endswith(b"\n"):
        part = os.read(sys.stdin.fileno(), 65536)
        if not part:
            raise SystemExit(2)
        data += part
    return data.decode()


def _say(answer: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()
