"""What the tests of the drivers share."""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import count

import pytest

import robots
from drivers import Channel
from robots import Robot

_NUMBERS = count()


@pytest.fixture(scope="session")
def tx40() -> Robot:
    return robots.load("tx40")


@pytest.fixture
def new_channel() -> Callable[[], Channel]:
    """A multicast group that no other test, worker or run on this machine uses at the same time."""

    def make() -> Channel:
        process = os.getpid()
        return Channel(
            "udp_multicast", f"239.{180 + next(_NUMBERS) % 70}.{process >> 8 & 0xFF}.{process & 0xFF}"
        )

    return make
