"""What the tests of daq share."""

from __future__ import annotations

import pytest

import robots
from robots import Robot


@pytest.fixture(scope="session")
def tx40() -> Robot:
    return robots.load("tx40")


@pytest.fixture(scope="session")
def emps() -> Robot:
    return robots.load("emps")
