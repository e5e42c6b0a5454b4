"""No set-point leaves the envelope under torque, whoever has computed it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.cyclic.set_point_guard import SetPointGuard
from tests.drivers.cyclic.test_loop import ACCELERATION, PERIOD, START, UNITS, reference, run, stream_job

SIZE = np.abs(UNITS.counts_per_output_unit)
STEP = ACCELERATION * PERIOD**2 * SIZE
"""Counts per cycle² at the acceleration limits."""


def refusals(rows: list[list[int]], limits: tuple[np.ndarray, np.ndarray] | None = None) -> list[str | None]:
    """What the guard says to one set of set-points after the other."""
    guard = SetPointGuard(replace(stream_job(), position_limits=limits))
    return [guard.admit(targets, sent, lambda axis: True)[1] for sent, targets in pairwise(rows)]


def test_a_speed_that_would_jump_is_refused_by_name_and_value() -> None:
    # 150 counts per cycle are far below the velocity limit of 10 rad/s (4042 counts), not as a first step.
    rows = [[1000, -1000, 2000]] * 3 + [[1000, -1150, 2000]]
    words = "set-point speed of drive 2 would have jumped by -150 counts per cycle; allowed: 23"
    assert refusals(rows) == [None, None, words]


@pytest.mark.parametrize("sign", [1, -1])
def test_a_speed_that_grows_gently_is_refused_where_its_limit_is(sign: int) -> None:
    """No single change of it is too large: only the step says so."""
    limit = stream_job().largest_step[0]
    steps = np.arange(0, limit + 3 * STEP[0], int(STEP[0]), dtype=int)
    rows = [[sign * int(place), 0, 0] for place in np.cumsum(steps)]
    said = refusals(rows)
    first = next(k for k, words in enumerate(said) if words is not None)
    assert steps[first] <= limit < steps[first + 1], "the largest step that is allowed was the last one"
    step = sign * int(steps[first + 1])
    assert said[first] == (
        f"set-point of drive 1 would have jumped by {step} counts in one cycle; allowed: {limit}"
    )


def test_a_set_point_may_come_back_into_its_range_but_not_go_farther_out() -> None:
    limits = START - 0.1, START + np.array([0.1, 0.0001, 0.1])
    # The second axis counts backwards: its upper limit is the lowest count.
    lowest = round(float(UNITS.counts_per_output_unit[1] * limits[1][1]))
    start = [1000, lowest - 10, 2000]
    out, back = [1000, lowest - 11, 2000], [1000, lowest - 9, 2000]
    said = refusals([start, start, out], limits)
    assert said[0] is None
    assert said[1] is not None
    assert f"set-point of drive 2 would have left its range with {lowest - 11} counts" in said[1]
    assert refusals([start, start, back], limits) == [None, None]


def test_what_a_drive_without_torque_is_told_is_not_judged() -> None:
    guard = SetPointGuard(stream_job())
    targets = [900_000, 0, 0]
    assert guard.admit(targets, [0, 0, 0], lambda axis: axis > 0) == (targets, None)
    assert guard.admit([0, 0, 0], targets, lambda axis: True)[1] is not None


@pytest.mark.parametrize(("below_the_end", "goes_on"), [(20, 10), (5, 0)])
def test_in_place_of_what_is_refused_the_axes_coast_and_at_the_end_of_their_range_they_stay(
    below_the_end: int, goes_on: int
) -> None:
    limits = START - 0.1, START + 0.1
    guard = SetPointGuard(replace(stream_job(), position_limits=limits))
    here = round(float(UNITS.counts_per_output_unit[0] * limits[1][0])) - below_the_end
    guard.admit([here, -1000, 2000], [here - 10, -1000, 2000], lambda axis: True)
    allowed, reason = guard.admit([here + 4000, -1000, 2000], [here, -1000, 2000], lambda axis: True)
    assert reason is not None
    assert allowed == [here + goes_on, -1000, 2000]


@settings(max_examples=30)
@given(st.integers(1, 100), st.integers(0, 2**16), st.booleans())
def test_motions_within_the_limits_pass_and_a_step_above_them_does_not(
    share: int, seed: int, damaged: bool
) -> None:
    rng = np.random.default_rng(seed)
    pushes = rng.choice([-1.0, 0.0, 1.0], (200, 3)) * ACCELERATION * share / 100
    speed = np.clip(np.cumsum(pushes, axis=0) * PERIOD, -9.0, 9.0)
    path = START + np.cumsum(speed, axis=0) * PERIOD
    counts = UNITS.counts(path)
    if damaged:
        axis, row = int(rng.integers(3)), int(rng.integers(5, 195))
        counts[row, axis] += round(2 * STEP[axis]) + 8
    assert any(refusals(counts.tolist())) == damaged


def test_a_damaged_reference_stops_the_arm_before_the_drive_sees_it() -> None:
    """A step far below the velocity limit, yet ten times what the acceleration limit allows."""
    path = reference()
    path[200:] += np.array([10 * STEP[0] / SIZE[0], 0.0, 0.0])
    done = run(path=path)
    assert done.result.outcome == "aborted"
    assert "set-point speed of drive 1 would have jumped by" in done.result.reason
    assert max(done.largest_acceleration(axis) for axis in range(3)) <= 1.0


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_reference_that_leaves_the_range_is_not_followed_there(axis: int) -> None:
    path = reference()
    end = float(path[:, axis].max())
    upper = START + 100.0
    upper[axis] = START[axis] + 0.9 * (end - START[axis])
    done = run(path=path, position_limits=(START - 100.0, upper))
    assert done.result.outcome == "aborted"
    assert f"set-point of drive {axis + 1} would have left its range" in done.result.reason
    reached = np.array(done.arm.axes[axis].targets) / UNITS.counts_per_output_unit[axis]
    assert reached.max() <= upper[axis] + 4 / SIZE[axis]
