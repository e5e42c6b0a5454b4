"""The drives' velocities (606Ch) from the simulated drives to the samples' columns."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from drivers.frames.units import Units
from drivers.simulated import draw_truth
from drivers.simulated.in_process import stream_in_process
from robots import Robot
from robots.description import ControlSignal, VelocityObject


@pytest.fixture(scope="module")
def emps() -> Robot:
    return robots.load("emps")


@pytest.mark.parametrize(
    ("velocity", "signal"),
    [
        (VelocityObject(), None),
        (VelocityObject(index=0x2028, subindex=1, counts_per_second=0.25), None),
        (VelocityObject(), ControlSignal(index=0x30D1, subindex=2, per_count=0.0005)),
    ],
)
def test_what_the_drives_send_is_the_motion(
    emps: Robot, velocity: VelocityObject, signal: ControlSignal | None
) -> None:
    """A velocity is the way of the encoder in the period before, over the period."""
    more = {"velocity": velocity} | ({} if signal is None else {"control_signal": signal})
    robot = emps.model_copy(update={"drive": tuple(d.model_copy(update=more) for d in emps.drive)})
    time = np.arange(1000) * robot.bus.cycle_time
    reference = np.array(robot.home) + 0.01 * (1 - np.cos(2 * np.pi * time / time[-1]))[:, None]
    done = stream_in_process(robot, draw_truth(robot, 3), reference)
    assert done.result is not None and done.result.outcome == "completed"
    units = Units.of(robot)
    found = units.velocity(done.rows["velocity"])
    position = units.position(done.rows["position"])
    moved = np.diff(position, axis=0) / robot.bus.cycle_time
    count = velocity.counts_per_second / abs(robot.counts_per_output_unit)
    assert np.abs(moved).max() > 100 * count.max(), "it has moved"
    np.testing.assert_allclose(found[1:], moved, atol=0.51 * count.max())


def test_who_sends_none_has_none(emps: Robot) -> None:
    done = stream_in_process(emps, draw_truth(emps, 3), np.full((20, 1), emps.home[0]))
    assert not done.rows["velocity"].any() and np.isnan(Units.of(emps).velocity(done.rows["velocity"])).all()
