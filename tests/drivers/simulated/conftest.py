"""What the tests of the simulated arm share."""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import count

import pytest

import robots
from drivers import Channel
from drivers.simulated import PlantTruth, draw_truth, nominal_truth
from robots import Robot

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
def new_channel() -> Callable[[], Channel]:
    """A multicast group that no other test, worker or run on this machine uses at the same time."""

    def make() -> Channel:
        process = os.getpid()
        return Channel("udp_multicast", f"239.{80 + next(_NUMBERS) % 100}.{process >> 8 & 0xFF}.{process & 0xFF}")

    return make
