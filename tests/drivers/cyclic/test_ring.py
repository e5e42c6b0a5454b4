from __future__ import annotations

import os

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from drivers.cyclic.pacemaker import Pacemaker
from drivers.frames.ring import Request, Ring
from tests.drivers.fake_arm import Clock


def row(k: int) -> tuple[float, ...]:
    return (k, k * 0.5, k + 1, k + 2, -k, -k - 1, 3, 4, 7 - k, 8, 0xFFFF, 1, True, False)


def test_rows_come_back_as_written_also_around_the_end() -> None:
    ring = Ring.create(2, 4)
    seen = []
    for k in range(11):
        assert ring.write(*row(k))
        if k % 3 == 2:
            seen.append(ring.read())
    rows = np.concatenate([*seen, ring.read()])
    assert rows["cycle"].tolist() == list(range(11))
    assert rows["position"].tolist() == [[-k, -k - 1] for k in range(11)]
    assert rows["velocity"].tolist() == [[7 - k, 8] for k in range(11)]
    assert rows["statusword"][0].tolist() == [0xFFFF, 1]
    assert rows["complete"][5].tolist() == [True, False]
    ring.close()


def test_a_full_ring_refuses_instead_of_overwriting() -> None:
    ring = Ring.create(2, 3)
    assert [ring.write(*row(k)) for k in range(5)] == [True, True, True, False, False]
    assert ring.read()["cycle"].tolist() == [0, 1, 2]
    assert ring.write(*row(9))
    ring.close()


def test_two_openings_share_rows_and_the_stop() -> None:
    parent = Ring.create(2, 8)
    child = Ring(os.dup(parent.descriptor), 2, 8)
    child.write(*row(1))
    assert parent.read()["cycle"].tolist() == [1]
    assert child.requested() is None
    parent.request(Request.ABORT)
    assert child.requested() is Request.ABORT
    child.close()
    parent.close()


def test_deadlines_are_absolute_and_skipped_ones_counted() -> None:
    clock = Clock()
    pace = Pacemaker(0.004, clock, clock.sleep)
    start = clock.now
    pace.wait()
    clock.now += 0.0130  # a stall over three deadlines, into the fourth period
    lateness = pace.wait()
    assert pace.missed_now == 2
    assert abs(lateness - 0.009) < 1e-9
    assert not pace.late_now
    pace.wait()
    assert pace.missed_now == 0
    assert abs(clock.now - start - 5 * 0.004) < 1e-9


def test_late_is_more_than_half_a_period() -> None:
    clock = Clock()
    pace = Pacemaker(0.004, clock, clock.sleep)
    for stall, late in ((0.0050, False), (0.0063, True), (0.0, False)):
        clock.now += stall
        pace.wait()
        assert pace.late_now is late
        clock.now = pace.deadline


@given(st.lists(st.floats(0.0, 0.02), min_size=1, max_size=30))
def test_no_stall_makes_a_burst(stalls: list[float]) -> None:
    clock = Clock()
    pace = Pacemaker(0.004, clock, clock.sleep)
    start, previous, deadlines = clock.now, -1.0, 0
    for stall in stalls:
        clock.now += stall
        lateness = pace.wait()
        deadlines += 1 + pace.missed_now
        assert lateness >= -1e-9
        assert abs(pace.deadline - start - deadlines * 0.004) < 1e-9
        assert clock.now - previous >= 0.25 * 0.004 - 1e-9
        assert clock.now - pace.deadline <= 0.75 * 0.004 + 1e-9
        previous = clock.now
