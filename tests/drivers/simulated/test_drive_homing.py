"""Homing of simulated drives: the index is found, the drive stands, and what cannot be done is said."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
import pytest

from robots import Robot
from tests.drivers.simulated.wire import (
    ENABLED,
    PERIOD,
    Wire,
    word_of,
)


def homing(w: Wire, node: int, method: int, offset: int = 0) -> None:
    """One drive in homing mode, all enabled."""
    w.send(0x000, b"\x01\x00")
    w.write(node, 0x6060, 0, b"\x06")
    w.write(node, 0x6098, 0, bytes([method]))
    w.write(node, 0x607C, 0, struct.pack("<i", offset))
    w.enable()


HOMING_BITS, REACHED, ATTAINED, HOMING_ERROR = 0x3400, 0x0400, 0x1000, 0x2000


@pytest.mark.parametrize(("method", "direction"), [(33, -1), (34, 1)])
def test_homing_finds_the_next_index_and_stands(
    wire: Callable[..., Wire], tx40: Robot, method: int, direction: int
) -> None:
    w, turn, offset = wire(), tx40.drive[2].encoder_counts, 1234
    homing(w, 3, method, offset)
    drive = w.group.drives[2]
    began = round(w.group.bench.plant.drive_position()[2] * tx40.counts_per_output_unit[2])
    target = w.here()
    for _ in range(3):
        w.cycle(0x0F, target)
    assert word_of(w, 3) & HOMING_BITS == REACHED, "not started"
    seen, positions = [], []
    for _ in range(2000):
        w.cycle(0x1F, target)
        seen.append(word_of(w, 3) & HOMING_BITS)
        positions.append(w.group.bench.plant.drive_position()[2] * tx40.counts_per_output_unit[2])
        if seen[-1] == REACHED | ATTAINED:
            break
    order = list(dict.fromkeys(seen))
    assert order in ([0, ATTAINED, ATTAINED | REACHED], [REACHED, 0, ATTAINED, ATTAINED | REACHED])
    index = (began // turn + (direction > 0)) * turn
    assert 0 < (positions[-1] - began) * direction < 1.5 * turn, "and the way to stop"
    speed = np.abs(np.diff(positions)) / PERIOD
    assert speed.max() < 1.1 * drive.dictionary.integer(0x6099, 2)
    for _ in range(100):
        w.cycle(0x0F, target)
    assert word_of(w, 3) & HOMING_BITS == REACHED | ATTAINED
    assert w.states() == [ENABLED] * 6 and w.emergencies() == []
    # The other axes have not moved, and the homed one holds where it stopped.
    now = w.group.bench.plant.drive_position() * tx40.counts_per_output_unit
    assert abs(now[2] - positions[-1]) < 500
    assert drive.dictionary.integer(0x6064) == pytest.approx(now[2] - index + offset, abs=10)
    np.testing.assert_allclose(np.delete(now, 2), np.delete(target, 2), atol=100)


def test_homing_where_it_stands_moves_nothing(wire: Callable[..., Wire]) -> None:
    w = wire()
    homing(w, 1, 37, offset=-500)
    target = w.here()
    for _ in range(20):
        w.cycle(0x1F, target)
    assert word_of(w, 1) & HOMING_BITS == REACHED | ATTAINED
    assert w.group.drives[0].dictionary.integer(0x6064) == pytest.approx(-500, abs=5)


def test_homing_that_is_given_up_stops_and_one_that_cannot_be_done_says_so(
    wire: Callable[..., Wire],
) -> None:
    w = wire()
    homing(w, 1, 34)
    target = w.here()
    for word in [0x1F] * 60 + [0x0F] * 150:
        w.cycle(word, target)
    assert word_of(w, 1) & HOMING_BITS == REACHED
    resting = w.here()[0]
    assert resting != target[0]
    for _ in range(20):
        w.cycle(0x0F, target)
    assert w.here()[0] == pytest.approx(resting, abs=20)
    w.group.drives[0].dictionary.set(0x6098, 0, 17)
    for _ in range(3):
        w.cycle(0x1F, target)
    assert word_of(w, 1) & HOMING_BITS == REACHED | HOMING_ERROR
