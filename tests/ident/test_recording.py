"""What a recording refuses, and in which words."""

from __future__ import annotations

import numpy as np
import pytest

from ident import IdentificationError, Recording


def recording(**changes: object) -> Recording:
    samples = 50
    values: dict[str, object] = {
        "name": "run",
        "time": np.arange(samples) * 0.004,
        "reference": np.zeros((samples, 2)),
        "position": np.zeros((samples, 2)),
        "control_signal": np.zeros((samples, 2)),
    }
    return Recording(**(values | changes))  # type: ignore[arg-type]


def test_sample_time_is_the_mean_interval() -> None:
    assert recording().sample_time == pytest.approx(0.004, abs=1e-15)


def test_a_number_that_is_none_is_named_by_joint_and_sample() -> None:
    position = np.zeros((50, 2))
    position[7, 1] = np.nan
    with pytest.raises(
        IdentificationError, match=r"run: position of joint 2 is not a number at sample 7 \(1"
    ):
        recording(position=position)


def test_shapes_must_agree() -> None:
    with pytest.raises(IdentificationError, match="control signal has shape"):
        recording(control_signal=np.zeros((49, 2)))
    with pytest.raises(IdentificationError, match="reference has 3 joints, position 2"):
        recording(reference=np.zeros((50, 3)))


def test_a_gap_in_time_is_not_data() -> None:
    time = np.arange(50) * 0.004
    time[30:] += 0.012
    with pytest.raises(IdentificationError, match=r"not uniform: 0\.016 s at 0\.116 s"):
        recording(time=time)


def test_messages_are_one_line() -> None:
    with pytest.raises(IdentificationError) as caught:
        recording(time=np.arange(50) * 0.0)
    assert "\n" not in str(caught.value)
