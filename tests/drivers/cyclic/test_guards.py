"""Guards, each at its bound: what is allowed passes, what is just beyond it does not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import robots
from drivers import ArmSession, Budgets, BusError, Channel, DriveError, Request
from drivers.cia402 import State
from drivers.cyclic.following import STANDSTILL_SHARE
from drivers.cyclic.motion_checks import MotionChecks
from drivers.cyclic.ramp import GENTLE, approach
from drivers.frames.job import TorqueLimit
from drivers.frames.layout import DriveLink
from drivers.frames.units import Units
from drivers.simulated import draw_truth
from drivers.simulated.in_process import InProcessBus, stream_in_process
from drivers.simulated.set_points import AxisMode
from robots import Robot
from tests.drivers.cyclic.test_loop import NODES, run, stream_job
from tests.drivers.cyclic.test_stops import three_periods
from tests.drivers.fake_arm import FakeArm
from tests.drivers.setup.test_setup import drives

LINKS = tuple(DriveLink(node, f"drive {node}", heartbeat=0.1) for node in NODES)


def torque_reasons(signals: list[tuple[int, int, int]]) -> list[str | None]:
    """What a guard of 10 N·m (0.1 a count of axis 0, −0.05 of axis 1) says of signals, SYNC by SYNC."""
    limits = (TorqueLimit("elbow", ((0, 0.1), (1, -0.05)), 10.0),)
    checks = MotionChecks(replace(stream_job(), torque_limits=limits, budgets=Budgets()))
    seen: Any = SimpleNamespace(complete=[False] * 3, position=[0] * 3)
    found = []
    for signal in signals:
        seen.control_signal = list(signal)
        found.append(checks.check(seen, [0, 0, 0]))
    return found


@pytest.mark.parametrize("sign", [1, -1])
def test_the_torque_guard_has_its_tolerance_its_sign_and_its_patience(sign: int) -> None:
    assert set(torque_reasons([(sign * 105, 0, 0)] * 100)) == {None}, "10.5 N·m are 5 % above 10"
    above = torque_reasons([(sign * 106, 0, 0)] * 7)
    assert above[:5] == [None] * 5, "five SYNCs are forgiven"
    assert above[5] == f"torque of joint elbow is {sign * 10.6:g} for 6 SYNCs; allowed: 10"
    dip = [(sign * 106, 0, 0)] * 5 + [(0, 0, 0)]
    assert set(torque_reasons(dip * 5)) == {None}, "and counted anew"
    assert torque_reasons([(sign * 60, -sign * 95, 0)] * 6)[5] is not None, "drives of a joint add up"


@pytest.mark.parametrize("sign", [1, -1])
def test_the_window_of_the_following_error_holds_on_both_sides(sign: int) -> None:
    checks = MotionChecks(replace(stream_job(), following_error=np.array([100, 50, 100])))
    seen: Any = SimpleNamespace(complete=[True] * 3, position=[1000] * 3, control_signal=[0] * 3)
    assert checks.check(seen, [1000, 1000 + sign * 50, 1000]) is None
    said = checks.check(seen, [1000, 1000 + sign * 51, 1000])
    assert said == "following error of drive 2 is 51 counts; allowed: 50"
    for step, off in enumerate((50, 51), start=1):  # of an axis that moves, too
        seen.position = [1000 + step] * 3
        said = checks.check(seen, [1000 + step, 1000 + step + sign * off, 1000 + step])
        assert (said is not None) == (off > 50)


def look_healthy(arm: FakeArm) -> None:
    """Statuswords say that set-points are followed (bit 12): nothing in them asks for a closer look."""
    for axis in arm.axes:
        axis.extra_bits = 0x1000


def beating(until: int) -> Callable[[int, FakeArm], None]:
    """Heartbeats of all drives every 0.1 s, of the second one until a SYNC."""

    def script(number: int, arm: FakeArm) -> None:
        look_healthy(arm)
        for node in NODES if number % 25 == 0 else ():
            if node != 2 or number < until:
                arm.put(0x700 + node, b"\x05", 0.0001)

    return script


def test_a_heartbeat_that_stays_away_is_noticed() -> None:
    assert run(beating(10_000), links=LINKS).result.outcome == "completed"
    done = run(beating(200), links=LINKS)
    assert done.result.outcome == "aborted"
    assert done.result.reason.startswith("no heartbeat from drive 2 in 0.3")
    assert not any(axis.targets[-1] != axis.targets[-2] for axis in done.arm.axes)
    assert run(beating(0), links=LINKS).result.reason == "drive 2 has sent no heartbeat in 1 s"


def test_a_drive_that_has_started_anew_is_noticed_although_it_looks_healthy() -> None:
    healthy = beating(10_000)

    def script(number: int, arm: FakeArm) -> None:
        healthy(number, arm)
        for state in (b"\x00", b"\x05") if number == 210 else ():
            arm.put(0x702, state, 0.0001)

    done = run(script, links=LINKS)
    assert done.result.reason.startswith("drive 2 has started anew (boot-up message)")
    assert done.result.outcome == "fault" and done.result.cycles < 250


def test_a_drive_that_left_operational_is_noticed_although_it_looks_healthy() -> None:
    healthy = beating(10_000)

    def script(number: int, arm: FakeArm) -> None:
        healthy(number, arm)
        if number == 210:
            arm.put(0x702, b"\x7f", 0.0001)

    done = run(script, links=LINKS)
    assert done.result.reason.startswith("drive 2 left NMT operational (its heartbeat says 127)")
    assert done.result.outcome == "fault" and done.result.cycles < 250


@pytest.mark.parametrize(("code", "ends"), [(0x4310, True), (0xFF01, True), (0x0000, False)])
def test_an_emergency_of_an_axis_that_looks_healthy_ends_the_stream(code: int, ends: bool) -> None:
    healthy = beating(10_000)

    def script(number: int, arm: FakeArm) -> None:
        healthy(number, arm)
        if number == 200:
            arm.put(0x082, code.to_bytes(2, "little") + bytes(6))

    done = run(script, links=LINKS)
    assert (done.result.outcome == "fault") == ends
    if ends:
        assert done.result.reason.startswith(f"drive 2 sent an emergency; EMCY 0x{code:04X}")
        assert done.result.cycles < 250


def test_an_emergency_is_looked_at_when_it_comes_and_not_with_the_next_heartbeat() -> None:
    """Heartbeats come with every 25th SYNC; the later of two emergencies between them ends it later."""
    healthy, cycles = beating(10_000), []
    for at in (201, 219):

        def script(number: int, arm: FakeArm, at: int = at) -> None:
            healthy(number, arm)
            if number == at:
                arm.put(0x082, b"\x10\x43" + bytes(6))

        cycles.append(run(script, links=LINKS).result.cycles)
    assert cycles[1] - cycles[0] > 9, "the ramps differ"


@pytest.mark.parametrize("request_", [Request.HALT, Request.ABORT, Request.STOP])
def test_no_axis_loses_its_torque_before_the_arm_stands(tx40: Robot, request_: Request) -> None:
    """By the drives' quick stop, which has to be held, and by the master's ramp."""
    seen: list[tuple[np.ndarray, list[bool]]] = []
    enabled: list[list[bool]] = []
    words = {0x200 + drive.node_id: False for drive in tx40.drive}

    def watch(bus: InProcessBus) -> None:
        receive = bus.group.receive

        def spy(cob_id: int, data: bytes, now: float) -> None:
            receive(cob_id, data, now)
            if cob_id in words:
                words[cob_id] = data[0] & 0x0F == 0x0F  # enable operation
            if cob_id == 0x080:
                enabled.append(list(words.values()))
                torque = [drive.mode is not AxisMode.BRAKED for drive in bus.group.drives]
                seen.append((bus.group.bench.plant.joint_position(), torque))

        bus.group.receive = spy  # type: ignore[method-assign]

    done = stream_in_process(
        tx40,
        draw_truth(tx40, 3),
        three_periods(tx40),
        requests={200: request_},
        period_ends=(150, 300),
        setup=watch,
    )
    assert done.result is not None and done.result.outcome == "stopped"
    speed = np.abs(np.diff([position for position, _ in seen], axis=0)) / tx40.bus.cycle_time
    share = speed / tx40.velocity_limits
    torque = np.array([has for _, has in seen])[1:]
    assert share.max() > 0.1, "it was in motion"
    for axis in range(tx40.n):  # a drive that stops by itself brakes when its own axis stands
        lost = np.flatnonzero(torque[:-1, axis] & ~torque[1:, axis])
        assert len(lost) == 1, "once on, once off"
        assert share[lost[0], axis] < 0.03, "and stood when the torque went"
    if request_ is not Request.HALT:  # a drive that brakes on its own ramp (605C) would hide it
        told = np.flatnonzero(~np.array(enabled)[1:].all(axis=1) & torque.any(axis=1))
        assert share[told].max(initial=0.0) <= STANDSTILL_SHARE, "nor was it told to before"


def test_an_approach_keeps_to_its_share_of_the_velocity() -> None:
    slow, quick = np.array([0.2, 1.0]), np.array([1e6, 1e6])
    path = approach(np.zeros(2), np.array([0.3, -0.1]), slow, quick, 0.004)
    peak = np.abs(np.diff(path, axis=0)).max(axis=0) / 0.004
    assert (peak <= GENTLE * slow * 1.0001).all()
    assert peak[0] == pytest.approx(GENTLE * slow[0], rel=0.01), "and uses it"


def test_counts_end_where_607a_ends() -> None:
    units = Units(np.eye(1), np.ones(1), np.ones(1), ("a",))
    assert units.counts([[2.0**31 - 1], [-(2.0**31)]]).ravel().tolist() == [2**31 - 1, -(2**31)]
    for beyond in (2.0**31, -(2.0**31) - 1):
        with pytest.raises(DriveError, match="does not fit into 32-bit counts"):
            units.counts([[beyond]])


def test_the_span_of_coupled_joints_is_the_sum_of_theirs() -> None:
    units = Units(np.array([[1.0, -1.0], [0.0, -2.0]]), np.ones(2), np.ones(2), ("a", "b"))
    assert units.output_span(np.array([0.5, 1.0])).tolist() == [1.5, 2.0]


def test_an_arm_has_one_session_at_a_time() -> None:
    emps, channel = robots.load("emps"), Channel("virtual", "one-session")
    with drives(emps, channel):
        with ArmSession(emps, channel), pytest.raises(BusError, match="is occupied: another armhil run"):
            ArmSession(emps, channel).open()
        with ArmSession(emps, channel) as session:
            assert session.drives


def test_an_axis_whose_reading_stands_still_loses_its_torque_while_the_others_still_brake() -> None:
    """Its drive regulates on a position that is not there: no ramp means anything to it."""

    def stand_still(number: int, arm: FakeArm) -> None:
        arm.axes[2].frozen = number > 150

    done = run(stand_still, following_error=np.full(3, 100_000))
    assert "drive 3 reads the same" in done.result.reason
    off = [len(axis.controlwords) - axis.controlwords[::-1].index(0x0F) for axis in done.arm.axes]
    assert done.arm.axes[2].controlwords[off[2]] == 0x00, "disable voltage, in one step"
    assert off[2] < min(off[:2]) - 2, "not only once the ramp of the others is over"
    assert all(axis.state is State.SWITCH_ON_DISABLED for axis in done.arm.axes)
