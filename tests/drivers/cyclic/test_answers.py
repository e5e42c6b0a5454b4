"""A sample is what a drive said once: second, forged and odd TPDOs, before and after the true one."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest

from drivers import Budgets, Channel
from drivers.bus import ports
from drivers.cia402 import State
from drivers.cyclic.answers import DOUBLES_FORGIVEN, DOUBLES_WITHIN, Answers
from drivers.frames.layout import DriveLink, tpdo_layouts
from tests.drivers.cyclic.test_guards import LINKS, beating
from tests.drivers.cyclic.test_loop import NODES, PERIOD, Run, all_off, run
from tests.drivers.fake_arm import WORDS, FakeArm

LAYOUT = tpdo_layouts(16)[0]
FORGED = 31111
"""A control signal that no drive of the fake arm has."""
TWO_NODES = "two nodes with id"


def forge(arm: FakeArm, axis: int, delay: float, size: int = 8) -> None:
    """Another frame in the name of a drive: as it speaks, except for the control signal."""
    drive = arm.axes[axis]
    data = LAYOUT.pack(WORDS[drive.state], drive.position, FORGED) + bytes(8)
    arm.put(0x180 + drive.node, data[:size], delay)


@dataclass
class Forger:
    """Forges frames at the given SYNCs and, where asked, lets the drives answer at random instants."""

    plan: dict[int, list[tuple[int, float]]]
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    sent: int = 0

    @classmethod
    def drawn(cls, seed: int, frames: int, syncs: int = 440) -> Forger:
        rng = np.random.default_rng(seed)
        plan: dict[int, list[tuple[int, float]]] = {}
        for _ in range(frames):
            moment = (int(rng.integers(len(NODES))), float(rng.uniform(0.0, PERIOD)))
            plan.setdefault(int(rng.integers(2, syncs)), []).append(moment)
        return cls(plan, rng)

    def __call__(self, number: int, arm: FakeArm) -> None:
        for axis in arm.axes:
            late = self.rng.random() < 0.01
            axis.delay = float(self.rng.uniform(4e-3, 5e-3) if late else self.rng.uniform(1e-4, 2.3e-3))
        for axis_number, delay in self.plan.get(number, ()):
            forge(arm, axis_number, delay)
            self.sent += 1


def complete_forgeries(done: Run) -> int:
    """Rows whose forged values pass for samples."""
    return int((done.rows["complete"] & (done.rows["control_signal"] == FORGED)).sum())


@pytest.mark.parametrize("frames", [1, 2, 8, 60])
def test_no_forged_frame_at_any_instant_is_a_sample_and_no_run_ends_as_if_nothing_had_been(
    frames: int,
) -> None:
    met = 0
    for seed in range(12):
        forger = Forger.drawn(seed, frames)
        done = run(forger)
        assert complete_forgeries(done) == 0, seed
        assert forger.sent and done.result.doubtful, seed
        if frames > 10:
            assert done.result.outcome == "aborted" and TWO_NODES in done.result.reason, seed
        met += bool((done.rows["control_signal"] == FORGED).any())
    assert met or frames > 10, "forged values are in the record, as what they are"


def test_answers_that_are_late_and_nothing_else_are_no_second_ones() -> None:
    done = run(Forger({}, np.random.default_rng(5)))
    assert done.result.outcome == "completed"
    assert done.result.doubtful == ()
    assert 0 < done.result.incomplete_cycles < 40


def test_a_late_answer_costs_its_row_and_the_next_one_where_two_are_there() -> None:
    """Which of the two belongs to the later SYNC, nobody knows; the rows before are as they were."""

    def late(number: int, arm: FakeArm) -> None:
        arm.axes[1].delay = 0.0041 if number == 250 else 0.0002

    done = run(late)
    assert done.result.outcome == "completed" and done.result.doubtful == ()
    first, second = np.flatnonzero(~done.rows["complete"][:, 1])
    assert second == first + 1 and done.rows["complete"][:, [0, 2]].all()


@pytest.mark.parametrize("delay", [0.0, 0.0001, 0.0003, 0.0023, 0.0039])
def test_a_single_second_frame_costs_its_row_and_is_told(delay: float) -> None:
    def twice(number: int, arm: FakeArm) -> None:
        if number == 250:
            forge(arm, 2, delay)

    done = run(twice)
    assert done.result.outcome == "completed"
    assert done.result.doubtful == ("drive 3 answered 1 SYNCs more than once: they are incomplete",)
    assert done.result.incomplete_cycles == 2, (
        "its own row, and the one before: frames may have changed places"
    )
    rows = np.flatnonzero(~done.rows["complete"][:, 2])
    assert rows[1] == rows[0] + 1 and done.rows["complete"][:, :2].all()
    assert complete_forgeries(done) == 0


def test_a_true_frame_that_comes_only_after_the_next_sync_uncovers_the_forged_one_before() -> None:
    """The forged frame has answered the SYNC, and its row would be out before the true one is there."""

    def swapped(number: int, arm: FakeArm) -> None:
        arm.axes[1].delay = 0.0041 if number == 250 else 0.0002
        if number == 250:
            forge(arm, 1, 0.0005)

    done = run(swapped)
    assert (done.rows["control_signal"] == FORGED).any()
    assert complete_forgeries(done) == 0


def test_two_nodes_with_one_id_are_found_before_torque() -> None:
    def second_node(number: int, arm: FakeArm) -> None:
        forge(arm, 2, 0.0001)

    done = run(second_node)
    assert (done.result.outcome, done.result.cycles) == ("aborted", 0)
    assert done.result.reason == "two nodes with id 3: drive 3 has answered one SYNC twice, once"
    assert not any(axis.targets for axis in done.arm.axes)


def test_second_frames_that_come_again_and_again_end_the_stream_like_a_second_master() -> None:
    def second_node(number: int, arm: FakeArm) -> None:
        if number >= 200 and number % 30 == 0:
            forge(arm, 0, 0.0001)

    done = run(second_node)
    assert done.result.outcome == "aborted"
    assert done.result.reason.startswith("two nodes with id 1: drive 1 has answered one SYNC twice, 3 times")
    assert all_off(done.arm)
    assert done.arm.axes[0].state is State.SWITCH_ON_DISABLED
    assert max(done.largest_acceleration(axis) for axis in range(3)) <= 1.0


@pytest.mark.parametrize("size", [0, 6, 7])
def test_frames_of_another_length_are_counted_and_told(size: int) -> None:
    def odd(number: int, arm: FakeArm) -> None:
        if number in (200, 300):
            forge(arm, 1, 0.0001, size)

    done = run(odd)
    assert done.result.outcome == "completed"
    told = f"drive 2 sent 2 TPDOs of {size} bytes, another length than mapped: no samples"
    assert told in done.result.doubtful
    assert (~done.rows["complete"][:, 1]).sum() == 4


def test_a_frame_that_is_too_long_is_told_as_well() -> None:
    answers = Answers([DriveLink(2, "drive 2", control_signal_bits=8)], [1])
    answers.odd_size(0, 8)
    assert answers.words() == ("drive 2 sent 1 TPDOs of 8 bytes, another length than mapped: no samples",)


def test_a_drive_that_sends_nothing_but_short_frames_has_not_answered() -> None:
    def short(number: int, arm: FakeArm) -> None:
        arm.axes[0].mute = number >= 200
        if number >= 200:
            forge(arm, 0, 0.0001, 6)

    done = run(short)
    assert (done.result.outcome, done.result.reason) == ("aborted", "no TPDO from drive 1 in 4 SYNCs")
    assert any("TPDOs of 6 bytes" in words for words in done.result.doubtful)


def answered(answers: Answers, frames: int) -> str | None:
    """One SYNC that the only drive answers with so many frames of one TPDO."""
    for _ in range(frames):
        answers.part(0, 1)
    return answers.close()


def test_second_answers_are_forgiven_where_they_are_rare() -> None:
    answers = Answers([DriveLink(7, "drive 7")], [1])
    answers.forgiven = DOUBLES_FORGIVEN
    answers.close()
    for _ in range(5):
        for _ in range(DOUBLES_FORGIVEN):
            assert answered(answers, 2) is None
        for _ in range(DOUBLES_WITHIN):
            assert answered(answers, 1) is None
    assert answers.twice == [10]
    for _ in range(DOUBLES_FORGIVEN):
        assert answered(answers, 2) is None
    assert answered(answers, 2) == "two nodes with id 7: drive 7 has answered one SYNC twice, 3 times"


def test_an_answer_that_was_owed_is_no_second_one_but_its_row_is_none_either() -> None:
    answers = Answers([DriveLink(7, "drive 7")], [1])
    answers.close()
    assert [answered(answers, n) for n in (0, 0, 3)] == [None] * 3
    assert (answers.doubled, answers.swapped, answers.twice) == ([True], [False], [0])
    assert [answered(answers, n) for n in (1, 0, 1, 1)] == [None] * 4
    assert answered(answers, 2) is not None, "what was owed before an ordinary answer is forgotten"
    assert answers.swapped == [True]


def test_each_of_two_tpdos_may_come_once() -> None:
    answers = Answers([DriveLink(4, "drive 4", velocity_bits=32)], [2])
    answers.close()
    answers.part(0, 1)
    assert not answers.complete[0]
    answers.part(0, 1)
    answers.part(0, 2)
    assert answers.complete[0] and answers.missing == 0
    assert answers.close() == "two nodes with id 4: drive 4 has answered one SYNC twice, once"
    assert answers.doubled == [True]


def test_what_came_before_the_first_sync_is_not_counted() -> None:
    answers = Answers([DriveLink(4, "drive 4")], [1])
    assert answered(answers, 3) is None
    assert answers.twice == [0]


def test_drives_that_may_be_late_by_many_syncs_have_their_rows_held_as_long() -> None:
    """Three SYNCs get forged answers alone, the true ones come in a burst: none of the forged is a sample."""

    def stalled(number: int, arm: FakeArm) -> None:
        for axis in arm.axes:
            axis.delay = 0.0165 - 0.004 * (number - 250) if 250 <= number < 254 else 0.0002
        if 250 <= number < 253:
            for axis_number in range(3):
                forge(arm, axis_number, 0.0005)

    forged_samples = [complete_forgeries(run(stalled, budgets=Budgets(held_cycles=n))) for n in (1, 10)]
    assert forged_samples[0] > 0 and forged_samples[1] == 0
    assert Budgets.on(Channel("udp_multicast", "239.1.1.1"), 0.004).held_cycles == 25
    assert Budgets.on(Channel("socketcan", "can0"), 0.004).held_cycles == 1


UDP = Budgets.on(Channel("udp_multicast", "239.1.1.1"), PERIOD)


@pytest.mark.parametrize("budgets", [Budgets(), UDP], ids=["bus", "udp"])
@pytest.mark.parametrize("heartbeat", [b"", b"\x7f", b"\x00"], ids=["dead", "pre-operational", "boots"])
def test_what_speaks_in_place_of_a_drive_that_is_gone_is_never_a_sample(
    budgets: Budgets, heartbeat: bytes
) -> None:
    """Nobody answers twice then: what tells is that no heartbeat follows, or one of another state."""
    healthy = beating(250)

    def gone(number: int, arm: FakeArm) -> None:
        healthy(number, arm)
        arm.axes[1].mute = number >= 253
        if number > 253:
            forge(arm, 1, 0.0002)
        if number >= 250 and number % 25 == 0 and heartbeat:
            arm.put(0x702, heartbeat, 0.0001)

    done = run(gone, links=LINKS, budgets=budgets)
    assert done.result.outcome == "fault"
    assert (done.rows["control_signal"] == FORGED).any()
    assert complete_forgeries(done) == 0
    before = done.rows["complete"][:120]
    assert before.all(), "what came before its last heartbeat is believed"


def test_rows_that_heartbeats_confirm_are_all_there_and_complete() -> None:
    done = run(beating(10_000), links=LINKS)
    assert (done.result.outcome, done.result.cycles) == ("completed", 400)
    assert done.rows["complete"].all()
    np.testing.assert_array_equal(done.rows["cycle"], np.arange(400))


def test_the_last_rows_have_their_heartbeats_waited_for() -> None:
    """A drive that beats seldom: nothing but the wait after torque is off would confirm the last rows."""

    def seldom(number: int, arm: FakeArm) -> None:
        for node in NODES if number % 90 == 0 else ():
            arm.put(0x700 + node, b"\x05", 0.0001)

    links = tuple(DriveLink(node, f"drive {node}", heartbeat=0.36) for node in NODES)
    done = run(seldom, links=links)
    assert (done.result.outcome, done.result.cycles) == ("completed", 400)
    assert done.rows["complete"].all()
    assert all_off(done.arm)


def test_where_frames_were_lost_on_this_side_no_answer_of_late_is_believed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A drive's own answer may be among them, and a forged one in its place looks like any other."""
    lost = [0]
    monkeypatch.setattr(ports._MessagePort, "overflows", lambda port: lost[0])

    def overflowing(number: int, arm: FakeArm) -> None:
        arm.axes[1].mute = number == 250
        if number == 250:
            forge(arm, 1, 0.0002)
            lost[0] = 1

    done = run(overflowing)
    assert (done.result.outcome, done.result.overflows) == ("completed", 1)
    assert (done.rows["control_signal"] == FORGED).any()
    assert complete_forgeries(done) == 0
    assert done.result.incomplete_cycles == 2, "the SYNC before and this one"
