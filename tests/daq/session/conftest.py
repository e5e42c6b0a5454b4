"""One bench for the tests of a module: simulated drives on a bus, as a real arm would be on it."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers import Channel
from drivers.simulated import SimulatedArm
from robots import Robot
from tests.daq.session.commissioned import commissioned, real_identity


@pytest.fixture
def passed(emps: Robot, own_catalogue: Path) -> None:
    """The arm on the bench has been commissioned."""
    commissioned(real_identity(emps, 2))


@pytest.fixture(scope="module")
def bench(worker_id: str, request: pytest.FixtureRequest) -> Iterator[Channel]:
    """A multicast channel on which the drives of the one-axis arm, seed 2, are at home when a test begins."""
    worker = int(worker_id.removeprefix("gw")) + 1 if worker_id.startswith("gw") else 0
    run = os.environ.get("PYTEST_XDIST_TESTRUNUID", str(os.getpid())) + request.node.name
    port = 20000 + zlib.crc32(run.encode()) % 12000
    channel = Channel("udp_multicast", f"239.75.{worker % 256}.1:{port}")
    with SimulatedArm("emps", channel, 2):
        yield channel
