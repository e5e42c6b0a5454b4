"""``armhil sim``: the simulated arm alone on a bus, a bench for anyone's master."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from pathlib import Path
from types import FrameType

from drivers import BusError, Channel, DriveError
from drivers.simulated import SimulatedArm

_LOOK = 0.2
"""How often it is looked whether the drives still live, s."""


def run_simulation(
    robot_source: str,
    channel: Channel,
    seed: int,
    tell: Callable[[str], None],
    *,
    scenario: Path | None = None,
    seal: Path | None = None,
    profile: str = "cia402",
) -> None:
    """Serve until Ctrl-C or SIGTERM.

    Args:
        robot_source: name of a shipped arm or path of a robot.toml.
        channel: which bus.
        seed: which arm is drawn around the description.
        tell: gets one line when the drives have booted, and one at the end.
        scenario: file that says what the arm hides; only the process of the drives reads it.
        seal: file into which that process writes what the arm really is.
        profile: kind of drives.

    Raises:
        BusError: the bus cannot be opened or is occupied, or is inside one process only.
        DriveError: the description or the scenario cannot be used, the seal cannot be written, or the drives'
            process died.
    """
    if channel.interface == "virtual":
        raise BusError(f"{channel} lives inside one process; nobody else could reach the drives")
    ended = threading.Event()

    def end(number: int, frame: FrameType | None) -> None:
        ended.set()

    before = {number: signal.signal(number, end) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        with SimulatedArm(robot_source, channel, seed, scenario=scenario, seal=seal, profile=profile) as arm:
            if seal is not None:
                tell(f"sealed truth in {seal}")
            tell(f"simulated drives on {channel} (seed {seed}); Ctrl-C ends them")
            while not ended.wait(_LOOK):
                if not arm.running:
                    raise DriveError("the simulated drives' process ended by itself")
        tell("ended: no drive is left on the bus")
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
