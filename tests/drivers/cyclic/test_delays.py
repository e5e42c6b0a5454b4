"""Missed deadlines are told by what kept the process: late waking, late answers, long or interrupted work."""

from __future__ import annotations

import pytest

from drivers import Budgets
from drivers.cyclic.delays import ANSWERS, INTERRUPTED, WOKEN, WORK, Delays
from drivers.cyclic.pacemaker import Pacemaker
from tests.drivers.cyclic.test_loop import PERIOD, Run, run
from tests.drivers.fake_arm import Clock, FakeArm

BUSY = Budgets(receive_seconds=0.1, missed_in_a_row=50)


def causes(result: Run) -> dict[str, int]:
    told = result.result.missed_for
    assert sum(told.values()) == result.result.missed_cycles
    return {cause: count for cause, count in told.items() if count}


def test_a_stream_on_time_has_missed_nothing() -> None:
    assert causes(run()) == {}
    assert Delays().words() == ""


def test_drives_that_answer_late_are_to_blame() -> None:
    def slow(sync: int, arm: FakeArm) -> None:
        if sync == 400:
            arm.clock.now += 5.5 * PERIOD

    result = run(slow, budgets=BUSY)
    assert causes(result) == {ANSWERS: 4}
    assert "deadlines missed: 4 waiting for drives" in result.result.notes


@pytest.mark.parametrize(
    ("share", "cause"), [(1.0, WORK), (0.2, WORK), (0.05, INTERRUPTED), (0.0, INTERRUPTED)]
)
def test_work_that_was_interrupted_is_not_long_work(share: float, cause: str) -> None:
    """Of 29 ms after the answers some 3 ms were left in the period: a tenth of it fits in."""

    def long(arm: FakeArm) -> bool:
        if arm.syncs == 400:
            arm.clock.now += 0.029
        return True

    whole = run(alive=long, budgets=BUSY, processor=lambda clock: share * clock())
    assert causes(whole) == {cause: 6}


@pytest.mark.parametrize(
    ("overrun", "late_answers", "interrupted", "cause"),
    [
        (-0.001, False, 0.0, WOKEN),
        (0.0, False, 0.0, WOKEN),
        (0.003, True, 0.0, ANSWERS),
        (0.003, True, 0.004, ANSWERS),
        (0.003, False, 0.002, WORK),
        (0.003, False, 0.003, INTERRUPTED),
    ],
)
def test_one_cause_for_each(overrun: float, late_answers: bool, interrupted: float, cause: str) -> None:
    delays = Delays()
    delays.note(3, overrun, late_answers, interrupted)
    assert delays.missed == {WOKEN: 0, ANSWERS: 0, WORK: 0, INTERRUPTED: 0} | {cause: 3}
    assert delays.words() == f"deadlines missed: 3 {cause}"


def test_the_pacemaker_knows_when_the_wait_began() -> None:
    clock = Clock()

    def oversleep(seconds: float) -> None:
        clock.now += max(seconds, 0.010)

    pace = Pacemaker(0.004, clock, oversleep)
    clock.now += 0.001
    pace.wait()
    assert pace.overrun == pytest.approx(-0.003), "it began to wait in time and was woken late"
    assert pace.missed_now == 2
    clock.now += 0.020
    pace.wait()
    assert pace.overrun > 0.004 and pace.missed_now >= 1
