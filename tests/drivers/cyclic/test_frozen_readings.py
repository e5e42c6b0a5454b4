"""A reading that stands still while its set-point moves on: a dead encoder, or a gear that sticks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivers.simulated.in_process import stream_in_process
from drivers.simulated.truth import nominal_truth
from robots import Robot

JOINT = 5


@pytest.mark.parametrize(
    ("width", "ends"),
    [
        (2e-6, True),  # rad; less than a count (3e-6)
        (2e-5, False),  # 0.001°, less than any real gear winds up
    ],
)
def test_dry_friction_without_any_wind_up_ends_the_motion_and_with_some_does_not(
    tx40: Robot, width: float, ends: bool
) -> None:
    """No integral gain, a gear that gives no count before it slips, and an encoder without noise.

    Nothing tells such a joint at its reversal from one whose encoder has died. It is stopped, and nothing has
    moved farther than it was told.
    """
    truth = nominal_truth(tx40)
    truth = replace(truth, bristle_width=(width,) * tx40.n, encoder_noise=(0.0,) * tx40.n)
    controller = tx40.controller.model_copy(update={"integral_gain": (0.0,) * tx40.n})
    robot = tx40.model_copy(update={"controller": controller})
    rows = np.arange(round(2.0 / robot.bus.cycle_time)) / round(2.0 / robot.bus.cycle_time)
    path = np.tile(np.array(robot.home), (len(rows), 1))
    path[:, JOINT] += np.radians(0.5) * (1.0 - np.cos(2.0 * np.pi * rows))
    run = stream_in_process(robot, truth, path)
    assert run.result is not None
    assert run.result.outcome == ("aborted" if ends else "completed"), run.result.reason
    assert run.result.reason.startswith("the position of drive of joint joint_6 reads the same") == ends
    assert not run.bus.powered and run.result.rest_unconfirmed == run.result.torque_unconfirmed == ()
    counts = run.rows["position"][:, JOINT].astype(float)
    moved = (counts - counts[0]) / robot.counts_per_output_unit[JOINT]
    assert np.radians(-0.3) < moved.min() and moved.max() < np.radians(1.01)
