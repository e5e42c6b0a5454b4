"""What the tests of the simulated arm share."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from itertools import count

import pytest

import robots
from drivers import Channel, open_bus
from drivers.simulated import PlantTruth, draw_truth, nominal_truth
from drivers.simulated.faults import NO_FAULTS, Faults
from drivers.simulated.frame_sender import FrameSender
from drivers.simulated.group import DriveGroup
from drivers.simulated.process import serve
from robots import Robot
from tests.drivers.simulated.wire import Wire

_NUMBERS = count(1)


@pytest.fixture(scope="session")
def tx40() -> Robot:
    return robots.load("tx40")


@pytest.fixture(scope="session")
def emps() -> Robot:
    return robots.load("emps")


@pytest.fixture(scope="session")
def truth(tx40: Robot) -> PlantTruth:
    return draw_truth(tx40, seed=5)


@pytest.fixture(scope="session")
def frictionless(tx40: Robot) -> PlantTruth:
    nominal = nominal_truth(tx40)
    zero = {name: 0.0 for name in nominal.parameters if name.startswith(("Fv", "Fc"))}
    return PlantTruth(**{**nominal.as_dict(), "parameters": nominal.parameters | zero})


@pytest.fixture
def serve_drives(tx40: Robot) -> Iterator[Callable[..., Channel]]:
    """Simulated drives in a thread of this process, on an in-process bus of their own."""
    stop = threading.Event()
    threads: list[threading.Thread] = []

    def start(robot: Robot = tx40, faults: Faults = NO_FAULTS) -> Channel:
        channel = Channel("virtual", f"simulated-{next(_NUMBERS)}")
        bus = open_bus(channel)
        sender = FrameSender(bus)
        group = DriveGroup(robot, draw_truth(robot), sender, faults)
        group.boot(time.monotonic())

        def run() -> None:
            with bus:
                serve(group, sender.port, lambda now: not stop.is_set())

        threads.append(threading.Thread(target=run))
        threads[-1].start()
        return channel

    yield start
    stop.set()
    for thread in threads:
        thread.join()


@pytest.fixture
def wire(tx40: Robot, truth: PlantTruth) -> Callable[..., Wire]:
    return lambda faults=NO_FAULTS: Wire(tx40, truth, faults)
