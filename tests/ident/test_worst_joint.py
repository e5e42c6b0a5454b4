"""The joint of which most is left, with what that goes with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident import Options, identify
from ident.recording import Recording
from ident.results import WorstJoint
from robots import Robot
from robots.arrays import FloatArray
from tests.ident.pinocchio_arm import record, tx40

WHOLE = record(5, encoder=0.0, noise=0.3, seconds=20.0)


def worst_of(added: FloatArray) -> WorstJoint:
    """Of an arm whose control signals have something more, samples × drives."""
    recording = replace(WHOLE, control_signal=WHOLE.control_signal + added)
    result = identify(tx40(), (recording,), options=Options("ls")).result
    assert result.worst is not None
    errors = result.least_squares.relative_error_percent_per_joint
    assert result.worst.joint == int(np.argmax(errors))
    assert result.worst.error_percent == pytest.approx(errors.max())
    return result.worst


def beside(robot: Robot, recording: Recording, joint: int, course: FloatArray) -> FloatArray:
    """A course (samples,) as the control signal of one drive, far above the noise."""
    added = np.zeros_like(recording.control_signal)
    size = np.ptp(recording.control_signal[:, joint])
    added[:, joint] = 0.3 * size * course / np.std(course)
    return added


@pytest.mark.parametrize(
    ("quantity", "of"), [("position", None), ("speed", None), ("time", None), ("speed", 1), ("", None)]
)
def test_what_is_left_is_named_by_what_it_goes_with(quantity: str, of: int | None) -> None:
    joint, robot = 3, tx40()
    q, step = WHOLE.position, WHOLE.sample_time
    v = np.gradient(q, step, axis=0)
    course = {
        "position": np.cos(9.0 * q[:, joint]),
        "time": np.sign(WHOLE.time - WHOLE.time.mean()),
        "": np.random.default_rng(2).standard_normal(len(q)),
        "speed": np.cos(6.0 * v[:, joint if of is None else of] / np.std(v[:, joint if of is None else of])),
    }[quantity]
    found = worst_of(beside(robot, WHOLE, joint, course))
    assert (found.joint, found.quantity, found.of) == (joint, quantity, of)
    assert (found.share > 0.3) == bool(quantity)
