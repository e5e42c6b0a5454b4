"""The drives' position loop against a plain scalar program of the same law, and its set-points."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drivers.simulated.control_loop import ControlLoop
from drivers.simulated.set_points import AxisMode, Interpolation, SetPoints
from robots import Controller

KINDS = ("cascade_p_pi", "pd", "pid")


def controller(kind: str, **changes: Any) -> Controller:
    values: dict[str, Any] = {
        "type": kind,
        "sample_time": 0.001,
        "position_gain": (40.0,),
        "velocity_gain": (3.0,),
        "integral_gain": (0.0,) if kind == "pd" else (12.0,),
        "velocity_feed_forward": (0.7,),
        "velocity_difference_samples": 3,
        "velocity_cutoff_hz": 120.0,
        "delay_samples": 2,
        "saturation": (1.5,),
    }
    return Controller.model_validate(values | changes)


def law(
    c: Controller,
    set_points: list[float],
    slopes: list[float],
    positions: list[float],
    accelerations: list[float],
) -> list[float]:
    """The law of the module's description, one axis, one sample after the other."""
    t, n = c.sample_time, c.velocity_difference_samples
    kp, kv, ki, ff = c.position_gain[0], c.velocity_gain[0], c.integral_gain[0], c.velocity_feed_forward[0]
    read = [positions[0]] * n
    outputs = [0.0] * c.delay_samples
    speed = integral = 0.0
    (viscous,), (inertia,) = c.friction_feed_forward or (0.0,), c.acceleration_feed_forward or (0.0,)
    for r, slope, q, change in zip(set_points, slopes, positions, accelerations, strict=True):
        raw = (q - read[-n]) / (n * t)
        if c.velocity_cutoff_hz is None:
            speed = raw
        else:
            speed += (1 - math.exp(-2 * math.pi * c.velocity_cutoff_hz * t)) * (raw - speed)
        read.append(q)
        e = r - q
        if c.type == "cascade_p_pi":
            u = kp * e + ff * slope - speed
            new = integral + t * u
            v = kv * (u + ki * integral)
            drive = u
        else:
            new = integral + t * e
            v = kp * e + kv * (ff * slope - speed) + ki * integral
            drive = e
        v += viscous * slope + inertia * change
        limited = max(-c.saturation[0], min(v, c.saturation[0]))
        if (v - limited) * drive <= 0:
            integral = new
        outputs.append(limited)
    return outputs[: len(positions)]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"velocity_cutoff_hz": None, "velocity_difference_samples": 1},
        {"delay_samples": 0},
        {"friction_feed_forward": (0.2,)},
        {"acceleration_feed_forward": (0.01,), "friction_feed_forward": (0.1,)},
    ],
)
def test_the_loop_is_the_law(kind: str, changes: dict[str, Any]) -> None:
    c = controller(kind, **changes)
    rng = np.random.default_rng(1)
    k = np.arange(400)
    set_points = 0.5 + 0.05 * np.sin(k / 20)
    slopes = 2.5 * np.cos(k / 20)
    positions = 0.5 + 0.05 * np.sin((k - 5) / 20) + 1e-5 * rng.standard_normal(400)
    accelerations = -125.0 * np.sin(k / 20)
    loop = ControlLoop(c)
    loop.reset(np.array([True]), positions[:1], np.zeros(1))
    found = [
        float(loop.step(*(np.array([x]) for x in sample))[0])
        for sample in zip(set_points, slopes, positions, accelerations, strict=True)
    ]
    samples = (set_points, slopes, positions, accelerations)
    expected = law(c, *(values.tolist() for values in samples))
    assert found == pytest.approx(expected, abs=1e-9)
    assert max(map(abs, found)) == 1.5


@pytest.mark.parametrize("kind", ["cascade_p_pi", "pid"])
def test_equilibrium_at_the_start_holds_the_load(kind: str) -> None:
    loop = ControlLoop(controller(kind))
    here = np.array([0.3])
    loop.reset(np.array([True]), here, np.array([0.8]))
    for _ in range(5):
        assert loop.step(here, np.zeros(1), here) == pytest.approx([0.8])


def test_a_loop_without_integral_starts_from_zero() -> None:
    loop = ControlLoop(controller("pd"))
    loop.reset(np.array([True]), np.zeros(1), np.array([0.8]))
    assert loop.step(np.zeros(1), np.zeros(1), np.zeros(1)) == 0.0


def test_the_integral_does_not_wind_up() -> None:
    loop = ControlLoop(controller("cascade_p_pi", delay_samples=0, velocity_cutoff_hz=None))
    loop.reset(np.array([True]), np.zeros(1), np.zeros(1))
    for _ in range(2000):
        assert loop.step(np.array([1.0]), np.zeros(1), np.zeros(1)) == 1.5
    assert loop.step(np.array([-0.02]), np.zeros(1), np.zeros(1))[0] < 0


def test_reset_touches_only_its_axes() -> None:
    values = controller("cascade_p_pi").model_dump()
    two = {k: v * 2 if isinstance(v, tuple) else v for k, v in values.items()}
    loop = ControlLoop(Controller.model_validate(two))
    here = np.array([0.1, 0.2])
    loop.reset(np.array([True, True]), here, np.array([0.4, 0.5]))
    loop.reset(np.array([False, True]), here, np.array([0.0, 0.9]))
    assert loop.step(here, np.zeros(2), here) == pytest.approx([0.4, 0.9])


TRACKING = np.array([AxisMode.TRACKING], dtype=np.int64)
STOPPING = np.array([AxisMode.STOPPING], dtype=np.int64)


@pytest.fixture
def tracking() -> Callable[[Interpolation], SetPoints]:
    def make(interpolation: Interpolation) -> SetPoints:
        made = SetPoints(1, interpolation)
        made.set_modes(TRACKING)
        made.start_at(np.array([True]), np.zeros(1))
        return made

    return make


def period(set_points: SetPoints, target: float) -> list[float]:
    set_points.latch(np.array([target]), 0.004, 4)
    found = []
    for sample in range(4):
        set_points.sample(sample)
        found.append(float(set_points.position[0]))
    return found


def test_linear_interpolation_takes_one_period_to_a_target(
    tracking: Callable[[Interpolation], SetPoints],
) -> None:
    made = tracking("linear")
    assert period(made, 1.0) == pytest.approx([0.0, 0.25, 0.5, 0.75])
    assert made.velocity == pytest.approx([250.0])
    assert period(made, 3.0) == pytest.approx([1.0, 1.5, 2.0, 2.5])
    assert period(made, 3.0) == pytest.approx([3.0] * 4)


def test_hold_takes_a_target_at_once(tracking: Callable[[Interpolation], SetPoints]) -> None:
    made = tracking("hold")
    assert period(made, 1.0) == [1.0] * 4
    assert period(made, 3.0) == [3.0] * 4
    assert made.velocity == pytest.approx([500.0])


def test_spline_runs_through_the_middles_without_a_jump_of_speed(
    tracking: Callable[[Interpolation], SetPoints],
) -> None:
    made = tracking("spline")
    targets = [0.0, 0.0, 1.0, 3.0, 2.0, 2.0, 2.0]
    path = [x for target in targets for x in period(made, target)]
    assert path[::4] == pytest.approx([0.0, 0.0, 0.0, 0.5, 2.0, 2.5, 2.0])
    speed = np.diff(path)
    assert np.abs(np.diff(speed)).max() <= 3.0 / 4**2 + 1e-12


@pytest.mark.parametrize("interpolation", ["linear", "spline", "hold"])
def test_a_stop_is_a_ramp_without_a_jump(
    tracking: Callable[[Interpolation], SetPoints], interpolation: Interpolation
) -> None:
    made = tracking(interpolation)
    for k in range(1, 20):
        last = period(made, 0.004 * k)
    assert made.velocity == pytest.approx([1.0])
    made.set_modes(STOPPING)
    made.deceleration[0] = 20.0
    path = list(last)
    for _ in range(20):
        path += period(made, 5.0)
    speed = np.diff(path[4 if interpolation == "hold" else 0 :]) / 0.001
    assert (np.diff(speed) <= 1e-9).all()
    assert (np.diff(speed) >= -20.0 * 0.001 - 1e-9).all()
    assert made.stopped().all()
    assert path[-1] - last[-1] == pytest.approx(1.0 / (2 * 20.0), rel=0.05)
