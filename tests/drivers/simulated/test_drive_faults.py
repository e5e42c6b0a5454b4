"""What ends in a fault of a simulated drive, and what of it is noticed on the bus."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
import pytest

from drivers.simulated import (
    DeadAt,
    EmergencyAt,
    Faults,
    LostFrames,
)
from drivers.simulated.faults import HotMotor
from drivers.simulated.thermal import CONTINUOUS_SHARE, LIMIT, WARNING, MotorTemperature
from tests.drivers.simulated.wire import (
    ENABLED,
    FAULT,
    Wire,
    word_of,
)


def test_a_following_error_faults_only_its_own_drive(wire: Callable[..., Wire]) -> None:
    w = wire()
    w.send(0x000, b"\x01\x00")
    w.write(4, 0x6065, 0, struct.pack("<I", 50))
    target = w.enable().astype(float)
    for _ in range(100):
        target += 500
        w.cycle(0x0F, target)
    assert w.emergencies() == [(4, 0x8611)]
    states = w.states()
    assert states.pop(3) == FAULT
    assert states == [ENABLED] * 5
    word = w.group.drives[3].dictionary.integer(0x6041)
    assert not word & 0x2000, "bit 13 is the mode's, and there is none in a fault"
    assert w.group.drives[3].dictionary.integer(0x603F) == 0x8611


def test_a_fault_is_reset_by_a_rising_edge_and_said_on_the_bus(wire: Callable[..., Wire]) -> None:
    w = wire(Faults(emergencies=(EmergencyAt(2, 20, 0x4310),)))
    start = w.enable()
    for _ in range(400):
        w.cycle(0x0F, start)
    assert w.emergencies() == [(2, 0x4310)]
    assert w.states()[1] == FAULT
    assert w.group.drives[1].dictionary.integer(0x1003, 1) == 0x4310
    w.cycle(0x80, start)
    assert w.emergencies() == [(2, 0x4310), (2, 0)]
    assert w.states()[1] == 0x40


def test_a_hot_motor_warns_and_then_stops_its_drive(wire: Callable[..., Wire]) -> None:
    w = wire(Faults(hot_motors=(HotMotor(3, 10, 100.0),)))
    start = w.enable()
    warned_at, cycles = None, 0
    while w.states()[2] != FAULT and cycles < 400:
        w.cycle(0x0F, start)
        cycles += 1
        celsius = w.group.drives[2].dictionary.integer(0x2200) / 10
        if word_of(w, 3) & 0x80 and warned_at is None:
            warned_at = celsius
            assert w.states()[2] == ENABLED and w.emergencies() == []
    assert warned_at == pytest.approx(WARNING, abs=0.5)
    assert celsius > LIMIT and 200 < cycles < 400, "100 K/s take most of a second"
    assert w.emergencies() == [(3, 0x4310)]
    assert [w.states()[k] for k in (0, 1, 3, 4, 5)] == [ENABLED] * 5


def test_the_winding_settles_where_its_current_puts_it() -> None:
    motor = MotorTemperature()
    motor.advance(CONTINUOUS_SHARE, 600.0)
    assert motor.celsius == pytest.approx(25.0 + 80.0 * (1 - np.exp(-1.0)))
    motor.advance(CONTINUOUS_SHARE, 1e5)
    assert motor.celsius == pytest.approx(105.0) and not motor.too_hot
    motor.advance(2 * CONTINUOUS_SHARE, 100.0)
    assert motor.too_hot, "twice the current heats four times as much"


def test_positions_beyond_607d_are_clipped_and_flagged(wire: Callable[..., Wire]) -> None:
    w = wire()
    w.send(0x000, b"\x01\x00")
    start = w.enable()
    limit = int(start[0]) + 200
    w.write(1, 0x607D, 2, struct.pack("<i", limit))
    target = start.astype(float)
    for _ in range(40):
        target[0] += 10
        w.cycle(0x0F, target)
    drive = w.group.drives[0]
    assert drive.dictionary.integer(0x6062) == limit
    assert drive.dictionary.integer(0x6041) & 0x800


def test_sync_that_stays_away_ends_in_a_fault_at_standstill(wire: Callable[..., Wire]) -> None:
    w = wire()
    target = w.enable().astype(float)
    for _ in range(60):
        target += 300
        w.cycle(0x0F, target)
    before = w.group.bench.plant.position.copy()
    w.wait(1.5)
    assert sorted(w.emergencies()) == [(node, 0x8250) for node in range(1, 7)]
    assert w.states() == [FAULT] * 6
    assert w.group.bench.at_rest
    assert np.abs(w.group.bench.plant.position - before).max() < 0.2


def test_set_points_that_stay_away_are_a_fault_of_their_drive_alone(wire: Callable[..., Wire]) -> None:
    """The RPDO deadline (1400:05): SYNC and heartbeats go on, and one drive hears no RPDO any more."""
    w = wire()
    w.write(1, 0x1400, 5, struct.pack("<H", 20))
    start = w.enable()

    def without_the_first() -> None:
        for node, target in enumerate(start[1:], start=2):
            w.send(0x200 + node, struct.pack("<Hi", 0x0F, int(target)))
        w.cycle(None)

    for _ in range(5):
        without_the_first()
    assert w.emergencies() == [] and w.states() == [ENABLED] * 6, "20 ms may pass"
    without_the_first()
    assert w.emergencies() == [(1, 0x8250)]
    for _ in range(400):
        without_the_first()
    assert w.states() == [FAULT] + [ENABLED] * 5
    assert w.emergencies() == [(1, 0x8250)], "the others have no deadline"


def test_frames_that_wait_are_not_taken_for_a_lost_sync(wire: Callable[..., Wire]) -> None:
    w = wire()
    start = w.enable()
    w.now += 5.0
    w.group.tick(w.now, heard_all=False)
    w.cycle(0x0F, start)
    assert w.emergencies() == []


def test_a_silent_master_is_noticed_after_its_first_heartbeat(wire: Callable[..., Wire]) -> None:
    w = wire()
    for node in range(1, 7):
        w.write(node, 0x1016, 1, struct.pack("<I", 0x7F << 16 | 100))
    start = w.enable()
    for _ in range(50):
        w.cycle(0x0F, start)
    assert w.emergencies() == []
    w.send(0x77F, b"\x05")
    for _ in range(300):
        w.cycle(0x0F, start)
    assert sorted(w.emergencies()) == [(node, 0x8130) for node in range(1, 7)]
    assert w.group.bench.at_rest


def test_a_stop_of_the_network_while_moving_is_a_fault(wire: Callable[..., Wire]) -> None:
    w = wire()
    start = w.enable()
    w.send(0x000, b"\x80\x02")
    for _ in range(200):
        w.cycle(0x0F, start)
    assert w.emergencies() == [(2, 0x8100)]
    assert w.group.drives[1].machine.state.value == FAULT


def test_another_period_in_one_drive_refuses_to_enable(wire: Callable[..., Wire]) -> None:
    w = wire()
    w.send(0x000, b"\x01\x00")
    w.write(5, 0x60C2, 1, b"\x05")
    for word in (0x06, 0x07, 0x0F, 0x0F):
        w.cycle(word)
    assert w.emergencies() == [(5, 0x6320)]
    assert w.states() == [ENABLED] * 4 + [FAULT, ENABLED]


def test_another_period_in_all_drives_is_the_period(wire: Callable[..., Wire]) -> None:
    w = wire()
    for node in range(1, 7):
        w.write(node, 0x60C2, 1, b"\x02")
    w.enable()
    assert w.group.bench.period == pytest.approx(0.002)


def test_mapping_is_fixed_while_there_is_torque(wire: Callable[..., Wire]) -> None:
    w = wire()
    w.enable()
    w.send(0x601, struct.pack("<BHBI", 0x23, 0x1400, 1, 0x201 | 1 << 31))
    assert w.frames[-1] == (0x581, struct.pack("<BHBI", 0x80, 0x1400, 1, 0x08000022))


def test_lost_frames_and_dead_nodes(wire: Callable[..., Wire]) -> None:
    """Cycle 0 is the SYNC that enabled; enable() ends with it."""
    faults = Faults(
        lost_tpdos=(LostFrames(2, 5, 3),),
        lost_rpdos=(LostFrames(3, 10),),
        dead=(DeadAt(6, 20),),
    )
    w = wire(Faults.from_dict(faults.as_dict()))
    target = w.enable().astype(float)
    missing: dict[int, list[int]] = {}
    held = []
    for cycle in range(1, 30):
        target += 10
        answers = w.cycle(0x0F, target)
        held.append(w.group.drives[2].dictionary.integer(0x607A) == target[2])
        for node in set(range(1, 7)) - set(answers):
            missing.setdefault(node, []).append(cycle)
    assert missing == {2: [5, 6, 7], 6: list(range(20, 30))}
    assert [k + 1 for k, kept in enumerate(held) if not kept] == [10]
    w.frames.clear()
    w.send(0x606, bytes.fromhex("4000100000000000"))
    w.wait(0.3)
    assert not [cob_id for cob_id, _ in w.frames if cob_id & 0x7F == 6]
    assert w.group.bench.plant.braked.tolist()[5]
