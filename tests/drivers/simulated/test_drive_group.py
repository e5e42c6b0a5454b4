"""The drives as nodes: frames in, frames out, with a clock that the test turns."""

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
    PlantTruth,
    draw_truth,
    simulate_offline,
)
from drivers.simulated.faults import NO_FAULTS, HotMotor
from drivers.simulated.group import DriveGroup
from drivers.simulated.thermal import CONTINUOUS_SHARE, LIMIT, WARNING, MotorTemperature
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


@pytest.fixture
def wire(tx40: Robot, truth: PlantTruth) -> Callable[..., Wire]:
    return lambda faults=NO_FAULTS: Wire(tx40, truth, faults)


def test_boot_up_then_heartbeats_at_ten_hertz(wire: Callable[..., Wire]) -> None:
    w = wire()
    assert w.frames == [(0x700 + node, b"\x00") for node in range(1, 7)]
    w.frames.clear()
    w.wait(1.05)
    assert w.frames == [(0x700 + node, b"\x7f") for _ in range(10) for node in range(1, 7)]


@pytest.mark.parametrize(("command", "state"), [(0x01, 5), (0x02, 4), (0x80, 127)])
def test_nmt_commands_address_one_node_or_all(wire: Callable[..., Wire], command: int, state: int) -> None:
    w = wire()
    w.send(0x000, bytes([command, 3]))
    w.frames.clear()
    w.wait(0.11)
    assert dict(w.frames)[0x703] == bytes([state])
    assert dict(w.frames)[0x704] == b"\x7f"


def test_a_reset_node_boots_again_with_its_defaults(wire: Callable[..., Wire]) -> None:
    w = wire()
    w.write(3, 0x1017, 0, struct.pack("<H", 0))
    w.frames.clear()
    w.send(0x000, b"\x81\x03")
    assert w.frames == [(0x703, b"\x00")]
    assert w.group.drives[2].dictionary.integer(0x1017) == 100


def test_no_sdo_in_stopped_and_no_tpdo_outside_operational(wire: Callable[..., Wire]) -> None:
    w = wire()
    assert w.cycle(None) == {}
    w.send(0x000, b"\x02\x00")
    w.frames.clear()
    w.send(0x601, bytes.fromhex("4000100000000000"))
    assert w.frames == []


def test_tpdos_come_with_sync_in_operational(wire: Callable[..., Wire], tx40: Robot) -> None:
    w = wire()
    w.send(0x000, b"\x01\x00")
    answers = w.cycle(None)
    assert sorted(answers) == [1, 2, 3, 4, 5, 6]
    home = tx40.transmission_matrix @ tx40.home * tx40.counts_per_output_unit
    assert [answers[node][1] for node in range(1, 7)] == pytest.approx(home, abs=6)
    assert [answers[node][0] & STATE_MASK for node in range(1, 7)] == [0x40] * 6


@pytest.mark.parametrize("interpolation", ["linear", "spline", "hold"])
def test_when_a_target_is_reached(tx40: Robot, truth: PlantTruth, interpolation: str) -> None:
    controller = tx40.controller.model_copy(update={"interpolation": interpolation})
    w = Wire(tx40.model_copy(update={"controller": controller}), truth)
    start = w.enable()
    target = start + 1000
    demand = [w.group.drives[0].dictionary.integer(0x6062)]
    for _ in range(3):
        w.cycle(0x0F, target)
        demand.append(w.group.drives[0].dictionary.integer(0x6062))
    moved = {
        "linear": [0, 0, 1000, 1000],
        "spline": [0, 0, 500, 1000],
        "hold": [0, 1000, 1000, 1000],
    }[interpolation]
    assert np.array(demand) - start[0] == pytest.approx(moved, abs=5)


def test_the_arm_is_held_without_a_jump(wire: Callable[..., Wire]) -> None:
    w = wire()
    start = w.enable()
    for _ in range(200):
        w.cycle(0x0F, start)
        assert np.abs(w.here() - start).max() < 30
    assert w.emergencies() == []


def test_bus_and_offline_are_equal_bit_for_bit(tx40: Robot, truth: PlantTruth) -> None:
    time = np.arange(150) * PERIOD
    reference = np.array(tx40.home) + 0.2 * np.outer(1 - np.cos(2 * np.pi * time), [1, -1, 1, 1, 1, 1])
    scale = tx40.counts_per_output_unit
    targets = np.rint(reference @ tx40.transmission_matrix.T * scale)
    w = Wire(tx40, truth)
    w.send(0x000, b"\x01\x00")
    for word in (0x06, 0x07):
        for _ in range(3):
            w.cycle(word, targets[0])
    rows = [w.cycle(0x0F, target) for target in targets]
    counts = np.array([[row[node][1] for node in range(1, 7)] for row in rows])
    signal = np.array([[row[node][2] for node in range(1, 7)] for row in rows])
    run = simulate_offline(tx40, truth, reference)
    again = simulate_offline(tx40, truth, reference)
    to_joint = np.linalg.inv(tx40.transmission_matrix).T
    assert np.array_equal((counts / scale) @ to_joint, run.position)
    assert np.array_equal(signal * tx40.control_signal_per_count, run.control_signal)
    assert np.array_equal(run.true_position, again.true_position)
    assert np.abs(run.position - reference).max() < 0.05
    assert np.ptp(run.control_signal, axis=0).min() > 0.05


def one_run(w: Wire) -> np.ndarray:
    """Enables, holds for 30 cycles, disables; control signals of each cycle."""
    w.enable()
    rows = [w.cycle(0x0F, w.robot_home()) for _ in range(30)]
    for _ in range(100):
        w.cycle(0x07, w.robot_home())
    assert w.group.bench.at_rest
    return np.array([[values[2] for values in row.values()] for row in rows])


@pytest.mark.parametrize("name", ["tx40", "emps"])
def test_equal_seeds_are_equal_runs_and_each_run_has_its_own_noise(
    request: pytest.FixtureRequest, name: str
) -> None:
    robot = request.getfixturevalue(name)
    first, second = (Wire(robot, draw_truth(robot, 1)) for _ in range(2))
    second.wait(3.0)
    once, again = one_run(first), one_run(second)
    assert np.array_equal(once, again)
    assert not np.array_equal(once, one_run(first))


def test_how_many_syncs_come_before_the_arm_is_enabled_makes_no_difference(
    tx40: Robot, truth: PlantTruth
) -> None:
    """On a loaded machine the master waits for heartbeats and answers as long as they take."""

    def rows_after(syncs: int) -> list[dict[int, tuple[int, ...]]]:
        w = Wire(tx40, truth)
        w.send(0x000, b"\x01\x00")
        for _ in range(syncs):
            w.cycle(None)
        start = w.enable()
        return [w.cycle(0x0F, start) for _ in range(40)]

    assert rows_after(1) == rows_after(23)


def test_disabling_ramps_down_and_engages_the_brakes(wire: Callable[..., Wire]) -> None:
    w = wire()
    target = w.enable().astype(float)
    for _ in range(100):
        target += 400
        w.cycle(0x0F, target)
    places = [w.here()]
    for _ in range(300):
        w.cycle(0x07, target)
        places.append(w.here())
    assert w.states() == [SWITCHED_ON] * 6
    assert w.group.bench.at_rest
    assert (np.abs(places[-1] - places[0]) > 400).all()
    assert np.abs(np.diff(places, n=2, axis=0)).max() < 300


def test_quick_stop_ramps_down_and_disables(wire: Callable[..., Wire]) -> None:
    w = wire()
    target = w.enable().astype(float)
    for _ in range(60):
        target += 300
        w.cycle(0x0F, target)
    w.cycle(0x02, target)
    assert w.states() == [QUICK_STOP] * 6
    for _ in range(300):
        w.cycle(0x02, target)
    assert w.states() == [0x40] * 6
    assert w.group.bench.at_rest


def homing(w: Wire, node: int, method: int, offset: int = 0) -> None:
    """One drive in homing mode, all enabled."""
    w.send(0x000, b"\x01\x00")
    w.write(node, 0x6060, 0, b"\x06")
    w.write(node, 0x6098, 0, bytes([method]))
    w.write(node, 0x607C, 0, struct.pack("<i", offset))
    w.enable()


def word_of(w: Wire, node: int) -> int:
    return w.group.drives[node - 1].dictionary.integer(0x6041)


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


def test_an_encoder_that_forgets_wakes_up_at_zero(tx40: Robot, truth: PlantTruth) -> None:
    drives = tuple(
        d.model_copy(update={"position_reference": "homing"}) if k == 3 else d
        for k, d in enumerate(tx40.drive)
    )
    w = Wire(tx40.model_copy(update={"drive": drives}), truth)
    home = w.robot_home()
    home[3] = 0
    np.testing.assert_allclose(w.here(), home, atol=1)
    start = w.enable()
    for k in range(200):
        w.cycle(0x0F, start + 10 * k)
    np.testing.assert_allclose(w.here() - start, 10 * 199, atol=300)


@pytest.mark.parametrize(("option", "ramp"), [(1, 0x6084), (2, 0x6085)])
def test_halt_stops_on_the_ramp_of_605d_and_keeps_the_torque(
    wire: Callable[..., Wire], option: int, ramp: int
) -> None:
    w = wire()
    w.send(0x000, b"\x01\x00")
    w.write(1, 0x605D, 0, bytes([option, 0]))
    counts = abs(w.robot.counts_per_output_unit[0])
    w.write(1, ramp, 0, struct.pack("<I", round(2.0 * counts)))
    w.write(1, 0x6084 if ramp == 0x6085 else 0x6085, 0, struct.pack("<I", round(50.0 * counts)))
    target = w.enable().astype(float)
    step = np.zeros(6)
    for k in range(100):
        step[0] = 0.5 * counts * PERIOD * min(1.0, k / 50)
        target += step
        w.cycle(0x0F, target)
    demand = []
    for _ in range(150):
        target += step
        w.cycle(0x10F, target)
        demand.append(w.group.drives[0].dictionary.integer(0x6062))
    speed = np.diff(demand) / PERIOD / counts
    braking = np.diff(speed)[np.diff(speed) < -1e-4] / PERIOD
    assert np.median(braking) == pytest.approx(-2.0, rel=0.05)
    assert speed[-1] == 0.0 and w.states() == [ENABLED] * 6
    assert word_of(w, 1) & 0x1400 == 0x0400, "stands, and does not follow"


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
