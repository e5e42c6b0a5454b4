"""Any sequence of faults, delays and stops ends disabled and braked.

No axis is enabled that was not asked for, and no set-point jumps.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import robots
from benchmarks.fault_cases import largest_acceleration, random_motion
from drivers import Request
from drivers.cia402 import State
from drivers.simulated import draw_truth
from drivers.simulated.faults import (
    BusOff,
    DeadAt,
    EmergencyAt,
    Faults,
    FrozenEncoder,
    HotMotor,
    LostFrames,
)
from drivers.simulated.in_process import InProcessBus, stream_in_process
from drivers.simulated.state_machine import State as DriveState
from tests.drivers.cyclic.test_loop import EVENTS, run
from tests.drivers.fake_arm import FakeArm

NODES, CYCLES = st.integers(1, 6), st.integers(1, 380)
LENGTHS = st.sampled_from([1, 2, 5, 40])
FRAMES = st.builds(LostFrames, NODES, CYCLES, LENGTHS)
ONE_FAULT = st.one_of(
    *(st.builds(lambda f, n=name: Faults(**{n: (f,)}), FRAMES)
      for name in ("lost_tpdos", "lost_rpdos", "late_tpdos", "late_rpdos")),
    st.builds(lambda *a: Faults(emergencies=(EmergencyAt(*a),)), NODES, CYCLES, st.sampled_from([0x4310])),
    st.builds(lambda *a: Faults(dead=(DeadAt(*a),)), NODES, CYCLES),
    st.builds(lambda *a: Faults(frozen_encoders=(FrozenEncoder(*a),)), NODES, CYCLES),
    st.builds(lambda *a: Faults(hot_motors=(HotMotor(*a),)), NODES, CYCLES, st.just(3000.0)),
    st.builds(lambda cycle: Faults(bus_off=(BusOff(cycle),)), CYCLES),
)  # fmt: skip
REQUESTS = st.dictionaries(CYCLES, st.sampled_from(list(Request)), max_size=2)


def together(faults: list[Faults]) -> Faults:
    """All of several sets of faults."""
    return Faults(**{f.name: sum((getattr(one, f.name) for one in faults), ()) for f in fields(Faults)})


class Witness:
    """Notes every way up that a drive takes, and whether the stream was already over."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.enabled: dict[int, int] = {}
        witness = self
        original = InProcessBus.send

        def send(bus: InProcessBus, msg: object, timeout: float | None = None) -> None:
            before = [drive.machine.state for drive in bus.group.drives]
            original(bus, msg, timeout)  # type: ignore[arg-type]
            for drive, was in zip(bus.group.drives, before, strict=True):
                up = drive.machine.state is DriveState.OPERATION_ENABLED is not was
                witness.enabled[drive.node_id] = witness.enabled.get(drive.node_id, 0) + up

        monkeypatch.setattr(InProcessBus, "send", send)


@settings(max_examples=14, phases=(Phase.explicit, Phase.generate, Phase.shrink))
@given(st.lists(ONE_FAULT, max_size=3), REQUESTS, st.integers(0, 2**16), st.none() | CYCLES)
def test_whatever_happens_the_simulated_arm_ends_disabled_and_braked(
    faults: list[Faults], requests: dict[int, Request], seed: int, kill_at: int | None
) -> None:
    robot = robots.load("tx40")
    # A pause that nobody takes back is ended in time.
    pauses = {Request.PAUSE, Request.PAUSE_AFTER} & set(requests.values())
    requests = {400: Request.STOP, **requests} if pauses else requests
    reference = random_motion(robot, np.random.default_rng(seed))
    with pytest.MonkeyPatch.context() as patch:
        witness = Witness(patch)
        done = stream_in_process(
            robot,
            draw_truth(robot, seed),
            reference,
            together(faults),
            requests=requests,
            kill_at=kill_at,
            period_ends=(150, 300),
        )
    # Plain values: a failed assertion would print every row of the run.
    powered, worst = done.bus.powered, largest_acceleration(robot, done)
    cycles = done.rows["cycle"].tolist()
    outcome, reason = (
        (done.result.outcome, done.result.reason) if done.result is not None else ("killed", "-")
    )
    assert not powered
    # The drives' brakes are engaged by now; what still swings comes to rest on them.
    done.bus.sleep(2.0)
    for _ in range(500):
        done.bus.group.run_period(on_sync=False)
    at_rest = done.bus.group.bench.at_rest
    assert at_rest, "every brake is engaged and nothing moves"
    assert max(witness.enabled.values()) <= 1, "an axis that has lost its torque is not led up again"
    assert worst <= 1.0
    assert cycles == list(range(len(cycles)))
    assert reason
    assert (outcome == "completed") <= (len(cycles) == len(reference))


@settings(max_examples=60)
@given(
    st.lists(st.tuples(st.integers(0, 520), st.sampled_from(sorted(EVENTS)), st.integers(0, 2)), max_size=4),
    st.none() | st.integers(0, 520),
)
def test_a_drive_that_belongs_to_somebody_else_is_never_spoken_to(
    events: list[tuple[int, str, int]], stop_at: int | None
) -> None:
    def script(number: int, arm: FakeArm) -> None:
        for when, what, index in events:
            if number == when:
                EVENTS[what](arm, index)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tests.drivers.cyclic.test_loop.FakeArm", with_bystander)
        done = run(script, stop_at=stop_at)
    stranger = done.arm.axes[3]
    assert (stranger.state, stranger.controlwords) == (State.SWITCH_ON_DISABLED, [])
    assert not any(cob_id & 0x7F == stranger.node for cob_id in done.arm.order if cob_id > 0x80)
    for axis in done.arm.axes[:3]:
        climbs = [a < 0x0F <= b for a, b in zip(axis.controlwords, axis.controlwords[1:], strict=False)]
        assert sum(climbs) <= 1, "nothing is enabled twice"


def with_bystander(nodes: tuple[int, ...], *arguments: object) -> FakeArm:
    """The same bus with one more drive on it."""
    return FakeArm((*nodes, 99), *arguments)  # type: ignore[arg-type]


def test_a_set_point_that_would_jump_is_not_sent() -> None:
    """The last line of defence: a reference that was damaged after it was checked."""
    path = np.tile(1000 / np.array([1e5, -1e5, 2e5]), (300, 1))
    path[150:] += 0.2
    done = run(path=path)
    assert done.result.outcome == "aborted"
    assert "set-point of drive 1 would have jumped by 20000 counts in one cycle" in done.result.reason
    assert max(max(abs(np.diff(axis.targets))) for axis in done.arm.axes) < 100
    assert replace(done.result, reason="").cycles < 160
