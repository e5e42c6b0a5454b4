"""What moved is what was meant: a jog ends where it was sent, or says why not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

import robots
from drivers import ArmSession, Channel, DriveError
from drivers.cia402 import State
from drivers.cyclic.ramp import approach
from drivers.session.following_windows import (
    arrival_windows,
    check_following_windows,
    homing_speed,
    narrowed,
    output_speed,
    standing_error,
)
from drivers.session.jog import jog_path
from drivers.session.stream_job import stream_job as stream_job_of
from drivers.setup.homing import Homing
from drivers.simulated import SimulatedArm
from drivers.simulated.truth import nominal_truth
from robots import Robot
from robots.windows import demanded_following_error
from tests.drivers.cyclic.test_loop import run
from tests.drivers.fake_arm import FakeArm


def test_set_points_that_are_ignored_end_a_jog_within_a_tenth_of_the_way(
    tx40: Robot, new_channel: Callable[[], Channel]
) -> None:
    """1006 is 0, and nobody has said that these drives need it: once "completed" with 0.00 degrees."""
    channel = new_channel()
    with (
        SimulatedArm("tx40", channel, truth=nominal_truth(tx40), profile="needs_sync_period"),
        ArmSession(tx40, channel, allow_jog=True) as session,
    ):
        began = session.actual_position()
        sent: list[np.ndarray] = []
        result = session.jog("joint_1", np.deg2rad(5.0), lambda samples: sent.append(samples.reference[:, 0]))
        assert result.outcome == "aborted" and "drive of joint joint_1" in result.reason
        assert np.abs(session.actual_position() - began).max() < np.deg2rad(0.1)
        reached = np.rad2deg(np.concatenate(sent).max() - began[0])
        assert reached < 2.0, "of 5 degrees"
        session.acknowledge_faults()


def test_an_approach_that_is_not_followed_says_so(tx40: Robot, new_channel: Callable[[], Channel]) -> None:
    """As above, by the way that commissioning takes: a slow move of all joints."""
    channel = new_channel()
    with (
        SimulatedArm("tx40", channel, truth=nominal_truth(tx40), profile="needs_sync_period"),
        ArmSession(tx40, channel) as session,
    ):
        began = session.actual_position()
        goal = began + np.deg2rad([5.0, -4.0, 3.0, -10.0, 6.0, 20.0])
        way = approach(
            began, goal, 0.1 * tx40.velocity_limits, 0.1 * tx40.acceleration_limits, tx40.bus.cycle_time
        )
        sent: list[np.ndarray] = []
        result = session.stream(
            np.vstack([began, way]), lambda samples: sent.append(samples.reference), arrive=True
        )
        assert result.outcome == "aborted" and "may not take set-points (1006" in result.reason
        assert np.abs(session.actual_position() - began).max() < np.deg2rad(0.1)
        gone = np.abs(np.vstack(sent) - began).max(axis=0)
        assert (gone < np.maximum(np.deg2rad(1.0), 0.1 * np.abs(goal - began)) + np.deg2rad(1.5)).all()


def test_a_joint_that_stays_short_of_its_target_has_not_arrived() -> None:
    def short(number: int, arm: FakeArm) -> None:
        """The second drive comes to rest 600 counts short of where it is sent."""
        axis = arm.axes[1]
        if number == 0:
            whole = axis.sync

            def sync() -> None:
                whole()
                if axis.latched is not None and axis.state is State.OPERATION_ENABLED:
                    axis.position = axis.latched - 600

            axis.sync = sync  # type: ignore[method-assign]

    missed = run(short, arrival=np.full(3, 1e-4)).result
    assert missed.outcome == "aborted"
    assert "joint b has not arrived, it stands" in missed.reason
    assert run(arrival=np.full(3, 1e-4)).result.outcome == "completed"


def test_the_window_of_a_jog() -> None:
    path = np.deg2rad([[0.0, 0.0, 0.0, 3.0], [0.1, -5.0, 40.0, 3.0]])
    assert np.rad2deg(arrival_windows(path)) == pytest.approx([0.2, 0.5, 1.0, 0.2])


def test_loops_without_integral_action_stand_off_their_targets(tx40: Robot) -> None:
    emps = robots.load("emps")
    assert standing_error(tx40) == pytest.approx(np.zeros(6))
    drive, controller = emps.drive[0], emps.controller
    stiffness = drive.gain * controller.position_gain[0] * controller.velocity_gain[0]
    assert standing_error(emps) == pytest.approx([emps.joint[0].torque / stiffness])
    soft = controller.model_copy(update={"type": "pd", "velocity_gain": (100.0,)})
    arm = emps.model_copy(update={"controller": soft})
    expected = emps.joint[0].torque / (drive.gain * controller.position_gain[0])
    assert standing_error(arm) == pytest.approx([expected])
    path = np.array([[0.0], [0.1]])
    job = stream_job_of(arm, Channel("virtual", "unused"), (), path, ())
    slow = narrowed(replace(job, following_error=np.array([10**9])), arm, path)
    assert slow.arrival == pytest.approx(arrival_windows(path) + expected)


@dataclass
class Report:
    settings: dict[str, int | None] = field(default_factory=dict)


def test_a_window_that_is_too_tight_is_told_before_the_motion(tx40: Robot) -> None:
    path = jog_path(tx40, np.array(tx40.home), "joint_2", 0.3)
    needed = demanded_following_error(tx40, output_speed(tx40, path))[1] * abs(tx40.counts_per_output_unit[1])
    fits = [Report({"6065": window}) for window in (None, int(needed) + 1, 0xFFFFFFFF, 5, 5, 5)]
    check_following_windows(tx40, output_speed(tx40, path), fits)  # type: ignore[arg-type]
    tight = [Report(), Report({"6065": int(needed) - 1}), *[Report()] * 4]
    with pytest.raises(DriveError, match=r"drive 2 \(joint_2\): 6065 is \d+ counts, this motion demands"):
        check_following_windows(tx40, output_speed(tx40, path), tight)  # type: ignore[arg-type]
    check_following_windows(tx40, output_speed(tx40, path[:1]), tight)  # type: ignore[arg-type]
    search = homing_speed(tx40, Homing("joint_2", 34, 0.0, 0.1))
    assert demanded_following_error(tx40, search)[1] > 0
    tight = [Report(), Report({"6065": 1}), *[Report()] * 4]
    with pytest.raises(DriveError, match=r"drive 2 \(joint_2\): 6065 is 1 counts"):
        check_following_windows(tx40, search, tight)  # type: ignore[arg-type]
