"""The cyclic loop against scripted drives in virtual time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robots
from drivers import Budgets, Channel, StreamResult
from drivers.cia402 import State
from drivers.cyclic.foreign import is_answer
from drivers.cyclic.loop import Loop
from drivers.frames.job import Job
from drivers.frames.layout import DriveLink
from drivers.frames.ring import Request, Ring
from drivers.frames.units import Units
from tests.drivers.fake_arm import Clock, FakeArm

NODES = (1, 2, 3)
ACCELERATION = np.array([8.0, 12.0, 20.0])
UNITS = Units(np.eye(3), np.array([1e5, -1e5, 2e5]), np.full(3, 0.1), ("a", "b", "c"))
START = 1000 / UNITS.counts_per_output_unit
PERIOD = 0.004
Script = Callable[[int, FakeArm], None]


def reference(n: int = 400) -> np.ndarray:
    """Out and back, all joints at 80 % of the acceleration limit."""
    t = np.arange(n) / (n - 1)
    bell = 64 * (t * (1 - t)) ** 3
    return START + bell[:, None] * 0.8 * ACCELERATION * PERIOD**2 / np.abs(np.diff(bell, 2)).max()


@dataclass
class Run:
    result: StreamResult
    rows: np.ndarray
    arm: FakeArm

    def largest_acceleration(self, axis: int) -> float:
        """Share of the limit, over all targets that this axis latched under torque."""
        targets = np.array(self.arm.axes[axis].targets) / UNITS.counts_per_output_unit[axis]
        count = 2 / abs(UNITS.counts_per_output_unit[axis]) / PERIOD**2
        return float((np.abs(np.diff(targets, 2)).max() / PERIOD**2 - count) / ACCELERATION[axis])


def run(
    script: Script | None = None,
    *,
    alive: Callable[[FakeArm], bool] = lambda arm: True,
    stop_at: int | None = None,
    capacity: int = 4096,
    path: np.ndarray | None = None,
    budgets: Budgets | None = None,
    processor: Callable[[Clock], float] = lambda clock: clock(),
    **changes: Any,
) -> Run:
    job = stream_job(capacity, path, budgets)
    ring = Ring.create(3, capacity)

    def whole_script(number: int, arm: FakeArm) -> None:
        if script is not None:
            script(number, arm)
        if number == stop_at:
            ring.request(Request.ABORT)

    clock = Clock()
    arm = FakeArm(NODES, clock, whole_script)
    try:
        job = replace(job, **changes)
        loop = Loop(
            job,
            arm,
            ring,
            lambda: alive(arm),
            clock=clock,
            sleep=clock.sleep,
            processor=lambda: processor(clock),
        )
        result = loop.run()
        return Run(result, ring.read(), arm)
    finally:
        arm.shutdown()
        ring.close()


def stream_job(capacity: int = 4096, path: np.ndarray | None = None, budgets: Budgets | None = None) -> Job:
    """What the loop is to do with three drives."""
    return Job(
        channel=Channel("virtual", "unused"),
        bitrate=1_000_000,
        links=tuple(DriveLink(node, f"drive {node}") for node in NODES),
        cycle_time=PERIOD,
        units=UNITS,
        reference=UNITS.counts(reference() if path is None else path),
        velocity=np.full(3, 10.0),
        acceleration=ACCELERATION,
        following_error=np.full(3, 20000),
        start_tolerance=np.full(3, 0.02),
        budgets=budgets or Budgets(),
        parent=0,
        ring_capacity=capacity,
    )


def all_off(arm: FakeArm) -> bool:
    return all(axis.state in (State.SWITCH_ON_DISABLED, State.FAULT) for axis in arm.axes)


def test_a_whole_stream() -> None:
    done = run()
    assert (done.result.outcome, done.result.cycles) == ("completed", 400)
    assert (done.result.missed_cycles, done.result.late_cycles, done.result.incomplete_cycles) == (0, 0, 0)
    assert all_off(done.arm)
    assert np.array_equal(done.rows["target"], UNITS.counts(reference()))
    assert done.rows["cycle"].tolist() == list(range(400))
    assert done.rows["complete"].all()
    # The fake reaches at SYNC k what it latched at SYNC k−1: row k pairs target k with the answer to SYNC k.
    assert np.array_equal(done.rows["position"][1:], done.rows["target"][:-1])
    assert max(done.largest_acceleration(axis) for axis in range(3)) <= 1.0


def test_every_cycle_is_sync_then_one_rpdo_per_drive() -> None:
    order = run().arm.order
    syncs = [i for i, cob_id in enumerate(order) if cob_id == 0x080]
    cycles = [order[a + 1 : b] for a, b in pairwise(syncs)]
    bare = [[cob_id for cob_id in cycle if cob_id != 0x77F] for cycle in cycles]
    with_rpdos = [cycle for cycle in bare if cycle]
    assert all(cycle == [0x201, 0x202, 0x203] for cycle in with_rpdos)
    assert bare.index(with_rpdos[0]) <= 1, "SYNCs without RPDO only before the first answers"
    assert all(cycle[0] == 0x77F for cycle in cycles if 0x77F in cycle), "the heartbeat follows the SYNC"


def test_axes_climb_together_and_hold_their_position_while_they_do() -> None:
    path = START + np.array([0.01, 0.0, -0.01]) + np.zeros((5, 3))
    done = run(path=path)
    words = [axis.controlwords for axis in done.arm.axes]
    assert words[0] == words[1] == words[2]
    first = [word for i, word in enumerate(words[0]) if i == 0 or words[0][i - 1] != word]
    assert first == [0x06, 0x07, 0x0F, 0x07, 0x06, 0x00]
    assert [axis.targets[0] for axis in done.arm.axes] == [1000, 1000, 1000]
    assert done.result.outcome == "completed"


def test_an_axis_that_waits_for_its_brake_holds_up_the_others() -> None:
    def slow(number: int, arm: FakeArm) -> None:
        arm.axes[1].stuck = number < 100

    done = run(slow)
    assert done.result.outcome == "completed"
    together = {axis.controlwords.index(0x0F) for axis in done.arm.axes}
    assert len(together) == 1 and together.pop() > 90


@pytest.mark.parametrize(
    ("bits", "hint"),
    [
        (0x210, ""),
        (0x010, "; its statusword says that it does not"),
        (0x200, "; its power stage has no voltage"),
    ],
)
def test_a_drive_that_does_not_climb_is_named(bits: int, hint: str) -> None:
    """Whether it has a voltage (bit 4) and listens to the bus (bit 9, remote) stands in its statusword."""

    def stuck(number: int, arm: FakeArm) -> None:
        arm.axes[2].stuck = arm.axes[2].state is State.READY
        arm.axes[2].extra_bits = bits

    done = run(stuck)
    assert done.result.outcome == "aborted"
    told = "drive 3 stayed in state 'ready to switch on' for 2 s after 'switch on'"
    assert done.result.reason.startswith(told + hint) and bool(hint) == (done.result.reason != told)
    assert done.result.cycles == 0
    assert not any(axis.targets for axis in done.arm.axes)


def test_a_drive_in_fault_is_never_commanded() -> None:
    def fault(number: int, arm: FakeArm) -> None:
        if number == 0:
            arm.fail(1, 0x7305)

    done = run(fault)
    assert done.result.outcome == "fault"
    assert done.result.reason.startswith("drive 2 cannot be enabled: it is in state 'fault'; EMCY 0x7305")
    assert set(done.arm.order) == {0x080, 0x77F, 0x000}


def test_a_silent_drive_is_named_before_anything_is_enabled() -> None:
    def silent(number: int, arm: FakeArm) -> None:
        arm.axes[0].silent = True

    done = run(silent)
    assert done.result.reason == "drive 1 sends no TPDO after 1 s of SYNC"
    assert set(done.arm.order) == {0x080, 0x77F, 0x000}


def test_an_arm_that_stands_elsewhere_does_not_move() -> None:
    done = run(path=reference() + np.array([0.0, 0.03, 0.0]))
    assert done.result.outcome == "aborted"
    assert "joint b stands 0.03 from the reference's first point; allowed: 0.02" in done.result.reason
    assert {target for axis in done.arm.axes for target in axis.targets} == {1000}
    assert all_off(done.arm)


def test_a_fault_stops_all_axes_by_a_ramp_and_is_explained() -> None:
    def fault(number: int, arm: FakeArm) -> None:
        if number == 200:
            arm.fail(1, 0x8611)

    done = run(fault)
    assert done.result.outcome == "fault"
    assert done.result.reason == (
        "drive 2 left operation enabled: it is in state 'fault'; EMCY 0x8611 (following error)"
    )
    assert all_off(done.arm)
    assert done.arm.axes[1].state is State.FAULT
    assert not any(word & 0x80 for axis in done.arm.axes for word in axis.controlwords)
    assert max(done.largest_acceleration(axis) for axis in (0, 2)) <= 1.0
    assert np.array_equal(done.rows["target"][-1], done.rows["target"][-2]), "the record ends at rest"


def test_quick_stop_and_loss_of_nmt_operational_stop_the_arm() -> None:
    def stop_quickly(number: int, arm: FakeArm) -> None:
        if number == 200:
            quick_stop(arm, 0)

    def stopped(number: int, arm: FakeArm) -> None:
        if number == 200:
            arm.put(0x703, b"\x04")

    assert "drive 1 left operation enabled: it is in state 'quick stop" in run(stop_quickly).result.reason
    result = run(stopped).result
    assert (result.outcome, result.reason) == ("fault", "drive 3 left NMT operational (its heartbeat says 4)")


def test_a_drive_that_starts_anew_is_told_by_name() -> None:
    def boot(number: int, arm: FakeArm) -> None:
        if number == 200:
            arm.put(0x702, b"\x00")

    result = run(boot).result
    assert (result.outcome, result.reason) == ("fault", "drive 2 has started anew (boot-up message)")
    assert (result.restarted, run().result.restarted) == (("drive 2",), ())


def test_a_drive_that_stays_behind_stops_the_arm() -> None:
    def freeze(number: int, arm: FakeArm) -> None:
        arm.axes[2].frozen = number > 150

    done = run(freeze)
    assert done.result.outcome == "aborted"
    assert "following error of drive 3 is" in done.result.reason
    assert all_off(done.arm)


def test_the_drives_own_following_error_bit_stops_the_arm() -> None:
    def bit(number: int, arm: FakeArm) -> None:
        arm.axes[0].extra_bits = 0x2000 if number > 150 else 0

    assert "drive 1 reports a following error" in run(bit).result.reason


def test_limits_that_act_inside_a_drive_are_counted_and_told() -> None:
    def script(number: int, arm: FakeArm) -> None:
        arm.axes[1].extra_bits = 0x1800 if 150 <= number < 157 else 0x1000

    result = run(script).result
    assert result.outcome == "completed"
    told = [note for note in result.notes if "bit 11" in note]
    assert len(told) == 1 and told[0].startswith("a limit inside drive 2 ") and " 7 SYNCs" in told[0]
    assert not [note for note in run().result.notes if "bit 11" in note]


def test_single_lost_answers_are_counted_and_more_than_the_budget_stops() -> None:
    def lose(number: int, arm: FakeArm) -> None:
        arm.axes[1].mute = number in (150, 200, 201, 202)

    done = run(lose)
    assert (done.result.outcome, done.result.incomplete_cycles) == ("completed", 4)
    assert (~done.rows["complete"]).sum(axis=0).tolist() == [0, 4, 0]

    def die(number: int, arm: FakeArm) -> None:
        arm.axes[1].silent = number >= 200

    done = run(die)
    assert (done.result.outcome, done.result.reason) == ("aborted", "no TPDO from drive 2 in 4 SYNCs")
    assert done.arm.axes[0].state is done.arm.axes[2].state is State.SWITCH_ON_DISABLED


def test_an_answer_that_comes_after_the_next_sync_does_not_pass_for_the_next_one() -> None:
    def late(number: int, arm: FakeArm) -> None:
        arm.axes[1].delay = {200: 0.0041, 201: 0.0008}.get(number, 0.0002)

    done = run(late)
    assert done.result.outcome == "completed"
    missing = np.flatnonzero(~done.rows["complete"][:, 1])
    assert len(missing) == 2 and missing[1] == missing[0] + 1, (
        "the unanswered row and the doubly answered one"
    )
    good = done.rows["complete"].all(axis=1)
    good[0] = False
    before = np.roll(done.rows["target"], 1, axis=0)
    assert np.array_equal(done.rows["position"][good], before[good])


def test_waiting_for_slow_drives_puts_the_sync_off_but_loses_nothing() -> None:
    def slow(number: int, arm: FakeArm) -> None:
        for axis in arm.axes:
            axis.delay = 0.0102 if number % 50 == 0 else 0.0002

    done = run(slow, budgets=Budgets(receive_seconds=0.03))
    assert done.result.outcome == "completed"
    assert done.result.incomplete_cycles == 0
    assert (done.result.missed_cycles, done.result.late_cycles) == (8, 8)
    assert np.array_equal(done.rows["target"], UNITS.counts(reference()))
    assert min(np.diff(done.arm.sync_times)) >= 0.25 * PERIOD, "no burst to catch up"


def test_the_death_of_the_parent_stops_the_arm() -> None:
    done = run(alive=lambda arm: arm.syncs < 200)
    assert (done.result.outcome, done.result.reason) == (
        "aborted",
        "the process that started the stream died",
    )
    assert all_off(done.arm)
    assert max(done.largest_acceleration(axis) for axis in range(3)) <= 1.0


def test_a_reader_that_does_not_keep_up_stops_the_arm() -> None:
    done = run(capacity=150)
    assert (done.result.outcome, done.result.cycles) == ("aborted", 150)
    assert "ring is full" in done.result.reason
    assert all_off(done.arm)


def quick_stop(arm: FakeArm, index: int) -> None:
    axis = arm.axes[index]
    axis.state = State.QUICK_STOP if axis.state is State.OPERATION_ENABLED else axis.state


EVENTS: dict[str, Callable[[FakeArm, int], None]] = {
    "fault": lambda arm, index: arm.fail(index, 0x4310),
    "silent": lambda arm, index: setattr(arm.axes[index], "silent", True),
    "heard": lambda arm, index: setattr(arm.axes[index], "silent", False),
    "mute": lambda arm, index: setattr(arm.axes[index], "mute", True),
    "answers": lambda arm, index: setattr(arm.axes[index], "mute", False),
    "slow": lambda arm, index: setattr(arm.axes[index], "delay", 0.0035),
    "fast": lambda arm, index: setattr(arm.axes[index], "delay", 0.0002),
    "frozen": lambda arm, index: setattr(arm.axes[index], "frozen", True),
    "quick stop": quick_stop,
    "emcy": lambda arm, index: arm.put(0x081 + index, b"\x10\x43" + bytes(6)),
    "nmt": lambda arm, index: arm.put(0x701 + index, b"\x7f"),
}
SEQUENCES = st.lists(
    st.tuples(st.integers(0, 520), st.sampled_from(list(EVENTS)), st.integers(0, 2)), max_size=4
)


@settings(max_examples=60, deadline=None)
@given(SEQUENCES, st.none() | st.integers(0, 520))
def test_whatever_happens_set_points_stay_smooth_and_the_drives_end_disabled(
    events: list[tuple[int, str, int]], stop_at: int | None
) -> None:
    def script(number: int, arm: FakeArm) -> None:
        for when, what, index in events:
            if number == when:
                EVENTS[what](arm, index)

    done = run(script, stop_at=stop_at)
    deafened = {index for _, what, index in events if what == "silent"}
    for index, axis in enumerate(done.arm.axes):
        assert axis.silent or axis.state in (State.SWITCH_ON_DISABLED, State.FAULT)
        assert not any(word & 0x80 for word in axis.controlwords)
        # A drive that hears no SYNC latches nothing: set-points are judged where all were latched.
        if index not in deafened and len(axis.targets) > 2:
            assert done.largest_acceleration(index) <= 1.0
    assert (done.result.outcome == "completed") <= (done.result.cycles == 400)


def test_a_robot_of_the_shelf_has_a_window_wider_than_its_lag() -> None:
    from drivers.frames.job import following_error_window

    robot = robots.load("tx40")
    window = following_error_window(robot, robot.bus.cycle_time)
    lag = np.abs(robot.transmission_matrix) @ robot.velocity_limits * robot.bus.cycle_time
    assert np.all(window > 2 * lag)
    assert np.all(window < 1.0)


def test_brakes_have_their_time_also_where_not_all_axes_came_up() -> None:
    """Two axes are enabled and their brakes open when it shows that the third one stays where it is."""

    def stuck(number: int, arm: FakeArm) -> None:
        arm.axes[2].stuck = arm.axes[2].state is State.SWITCHED_ON and 0x00 not in arm.axes[2].controlwords

    done = run(stuck, brake_engage=0.12)
    reason = "drive 3 stayed in state 'switched on' for 2 s after 'enable operation'"
    assert done.result.reason.startswith(reason)
    for axis in done.arm.axes[:2]:
        down = axis.controlwords[len(axis.controlwords) - axis.controlwords[::-1].index(0x0F) :]
        assert down.index(0x06) >= 0.12 / PERIOD, "disable operation, until the brake has fallen in"
    assert all_off(done.arm)


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        (b"\x2b\x40\x60\x00\x06\x00\x00\x00", "writes object 6040:00 of node 2"),
        (b"\x21\x00\x16\x01\x08\x00\x00\x00", "writes object 1600:01 of node 2"),
        (b"\xc2\x7c\x60\x00\x04\x00\x00\x00", "writes object 607C:00 of node 2"),
        (b"\x0d\x00\x00\x00\x00\x00\x00\x00", "writes an object of node 2"),
        (b"\x2b", "writes an object of node 2"),
    ],
)
def test_a_program_that_writes_objects_of_a_drive_stops_the_arm(request_: bytes, words: str) -> None:
    def intrude(number: int, arm: FakeArm) -> None:
        if number == 200:
            arm.put(0x602, request_)

    done = run(intrude)
    assert done.result.outcome == "aborted"
    assert done.result.reason == f"another master is on the bus: it {words} (SDO)"
    assert all_off(done.arm)


@pytest.mark.parametrize("first", [0x40, 0x60, 0xA4, 0x80])
def test_a_program_that_only_reads_is_told(first: int) -> None:
    """As a maker's tool does that shows curves; an empty frame asks for nothing."""

    def look(number: int, arm: FakeArm) -> None:
        if number in (200, 210, 220):
            arm.put(0x602, bytes([first, 0x41, 0x60, 0, 0, 0, 0, 0]) if number != 220 else b"")

    done = run(look)
    assert done.result.outcome == "completed"
    assert "something else reads objects of node 2 (SDO) (3 times)" in done.result.notes


def test_answers_to_somebody_else_confirm_nothing() -> None:
    """The end of the watch (1016) is confirmed by the answer to that write, done or refused."""
    asked = b"\x16\x10\x01"
    for data, counts in (
        (b"\x60" + asked + bytes(4), True),
        (b"\x80" + asked + b"\x00\x00\x02\x06", True),
        (b"\x60\x40\x60\x00" + bytes(4), False),
        (b"\x4b" + asked + bytes(4), False),
        (b"\x60" + asked, False),
    ):
        assert is_answer(data, asked) == counts, data


def test_a_second_master_stops_the_arm() -> None:
    for cob_id, data, words in (
        (0x080, b"", "SYNC"),
        (0x000, b"\x02\x00", "NMT command"),
        (0x203, bytes(6), "RPDO1 of node 3"),
        (0x77F, b"\x05", "heartbeat of node 127"),
    ):

        def intrude(number: int, arm: FakeArm, frame: tuple[int, bytes] = (cob_id, data)) -> None:
            if number == 200:
                arm.put(*frame)

        done = run(intrude)
        assert done.result.outcome == "aborted"
        assert f"another master is on the bus: it has sent 0x{cob_id:03X} ({words})" in done.result.reason
        assert all_off(done.arm)
        assert max(done.largest_acceleration(axis) for axis in range(3)) <= 1.0
