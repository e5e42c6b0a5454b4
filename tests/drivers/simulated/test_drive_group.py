"""The drives as nodes: frames in, frames out, with a clock that the test turns."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np
import pytest

from drivers.simulated import (
    PlantTruth,
    draw_truth,
    simulate_offline,
)
from robots import Robot
from tests.drivers.simulated.wire import (
    ENABLED,
    PERIOD,
    QUICK_STOP,
    STATE_MASK,
    SWITCHED_ON,
    Wire,
    word_of,
)


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
