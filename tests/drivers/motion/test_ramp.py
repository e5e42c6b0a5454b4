from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from drivers import DriveError
from drivers.cyclic.ramp import approach, stop_ramp
from drivers.session.envelope import check_envelope
from robots import Robot

PERIODS = st.sampled_from([0.001, 0.002, 0.004, 0.01])
SPEEDS = arrays(float, 4, elements=st.floats(-12.0, 12.0))
LIMITS = arrays(float, 4, elements=st.floats(0.5, 60.0))


@given(SPEEDS, LIMITS, PERIODS)
def test_stop_ramp_never_brakes_harder_than_the_limit_and_ends_at_rest(
    speed: np.ndarray, limit: np.ndarray, period: float
) -> None:
    last = np.array([0.1, -0.2, 1.0, 3.0])
    path = np.vstack([last - speed * period, last, stop_ramp(last - speed * period, last, limit, period)])
    path = np.vstack([path, path[-1:]])
    acceleration = np.diff(path, 2, axis=0) / period**2
    assert np.all(np.abs(acceleration) <= limit * (1 + 1e-6) + 1e-6)
    travelled = path[-1] - last
    assert np.all(travelled * speed >= -1e-12)
    assert np.all(np.abs(travelled) <= speed**2 / (2 * limit) + 1e-9)


def test_an_arm_at_rest_needs_no_ramp() -> None:
    assert stop_ramp(np.ones(3), np.ones(3), np.ones(3), 0.004).shape == (0, 3)


def test_a_stop_by_hand() -> None:
    """0.5 and −0.2 rad/s, at 2 and 1 rad/s² by 0.1 s: 0.3, 0.1 and 0.1 rad/s are left, then rest."""
    path = stop_ramp(np.zeros(2), np.array([0.05, -0.02]), np.array([2.0, 1.0]), 0.1)
    np.testing.assert_allclose(path, [[0.08, -0.03], [0.09, -0.03], [0.09, -0.03]], atol=1e-12)
    # As many cycles as the slowest joint needs, none for a rest of rounding.
    assert len(stop_ramp(np.zeros(1), np.array([0.04]), np.array([2.0]), 0.1)) == 2
    assert len(stop_ramp(np.zeros(1), np.array([0.04 + 1e-12]), np.array([2.0]), 0.1)) == 2
    assert len(stop_ramp(np.zeros(1), np.array([0.04 + 1e-6]), np.array([2.0]), 0.1)) == 3


def test_an_approach_takes_no_longer_than_a_tenth_of_the_limits_asks() -> None:
    """1 rad: at 2 rad/s 1.875/0.2 = 9.375 s; at 1 rad/s² √(5.7735/0.1) = 7.598 s; the longer counts."""
    one, far = np.zeros(1), np.ones(1)
    assert len(approach(one, far, np.array([2.0]), np.array([1.0]), 0.01)) == 938
    assert len(approach(one, far, np.array([9.0]), np.array([1.0]), 0.01)) == 760
    assert len(approach(one, -far, np.array([9.0]), np.array([1.0]), 0.01)) == 760
    both = approach(np.zeros(2), np.array([1.0, 0.1]), np.array([2.0, 9.0]), np.ones(2), 0.01)
    assert len(both) == 938
    assert approach(far, far, np.ones(1), np.ones(1), 0.01).tolist() == [[1.0]]


def test_an_approach_is_a_quintic() -> None:
    path = approach(np.array([2.0]), np.array([3.0]), np.array([2.0]), np.array([1.0]), 0.01)[:, 0]
    s = np.arange(1, len(path) + 1) / len(path)
    np.testing.assert_allclose(path, 2.0 + s**3 * (10.0 + s * (6.0 * s - 15.0)), rtol=1e-12)


@given(arrays(float, 4, elements=st.floats(-0.02, 0.02)), LIMITS, PERIODS)
def test_approach_is_gentle_and_arrives(way: np.ndarray, limit: np.ndarray, period: float) -> None:
    start = np.array([0.1, -0.2, 1.0, 3.0])
    path = approach(start, start + way, limit, limit, period)
    np.testing.assert_allclose(path[-1], start + way, rtol=0, atol=1e-12)
    if len(path) > 1:
        held = np.vstack([start, start, path, path[-1]])
        assert np.all(np.abs(np.diff(held, axis=0)) / period <= 0.1001 * limit + 1e-9)
        assert np.all(np.abs(np.diff(held, 2, axis=0)) / period**2 <= 0.1001 * limit + 1e-6)


def swing(robot: Robot, share: float = 0.8, n: int = 500) -> np.ndarray:
    """A bell out and back on every joint, at a share of the acceleration limits."""
    t = np.arange(n) / (n - 1)
    bell = 64 * (t * (1 - t)) ** 3
    peak = np.abs(np.diff(bell, 2)).max() / robot.bus.cycle_time**2
    return np.array(robot.home) + bell[:, None] * share * robot.acceleration_limits / peak * 0.2


def test_a_feasible_reference_passes(tx40: Robot) -> None:
    check_envelope(tx40, swing(tx40), tx40.bus.cycle_time)
    check_envelope(tx40, np.array([tx40.home]), tx40.bus.cycle_time)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda q: q.__setitem__((250, 2), 99.0), "joint_3 leaves its position limit at cycle 250"),
        (
            lambda q: q.__setitem__((slice(250, None), 0), q[250:, 0] + 0.1),
            "joint_1 leaves its velocity limit",
        ),
        (lambda q: q.__setitem__((300, 4), q[300, 4] + 0.001), "joint_5 leaves its acceleration limit"),
        (lambda q: q.__setitem__((10, 1), np.nan), "joint_2 is not finite at cycle 10"),
        (lambda q: q.__setitem__((0, 3), q[0, 3] + 0.01), "joint_4 does not begin at rest"),
        (lambda q: q.__setitem__((-1, 5), q[-1, 5] + 0.01), "joint_6 does not end at rest"),
    ],
)
def test_each_way_out_of_the_envelope_is_named(tx40: Robot, spoil: object, message: str) -> None:
    reference = swing(tx40)
    spoil(reference)  # type: ignore[operator]
    with pytest.raises(DriveError, match=message):
        check_envelope(tx40, reference, tx40.bus.cycle_time)


def test_a_reference_of_the_wrong_shape_is_refused(tx40: Robot) -> None:
    with pytest.raises(DriveError, match=r"shape \(5, 3\); allowed: N × 6"):
        check_envelope(tx40, np.zeros((5, 3)), 0.004)
