"""A disk that fails while the arm moves: the motion ends in order, and what was recorded is there."""

from __future__ import annotations

import errno
from pathlib import Path

import numpy as np
import pytest

from daq.recording.capture import CaptureError
from daq.recording.listener import FrameListener
from daq.recording.reader import read_capture
from daq.recording.recorder import Recorder
from drivers import ArmSession, Channel, Samples
from drivers.cia402 import objects
from drivers.cia402.states import State, state_of
from drivers.session.jog import jog_path
from drivers.simulated import SimulatedArm
from robots import Robot
from tests.daq.captures import FailingFile, facts


def test_the_arm_comes_to_rest_and_the_line_says_why(
    tx40: Robot, channel: Channel, tmp_path: Path, no_leftovers: None
) -> None:
    path = tmp_path / "run.mcap"
    seen: list[Samples] = []
    with (
        SimulatedArm("tx40", channel, 1),
        ArmSession(tx40, channel) as session,
        FrameListener(channel) as listener,
        Recorder(path, tx40, facts(tx40, tx40.bus.cycle_time), listener=listener) as recorder,
    ):
        way = jog_path(tx40, session.actual_position(), "joint_2", 0.2, 0.1)
        recorder._writer._file = FailingFile(recorder._file, 60_000, errno.ENOSPC)  # type: ignore[assignment]

        def keep(batch: Samples) -> None:
            seen.append(batch)
            recorder.write(batch)

        with pytest.raises(CaptureError) as caught:
            session.stream(way, keep)
        words = [sdo.read_int(objects.STATUSWORD) for sdo in session._connection.drives]
    assert {state_of(word) for word in words} == {State.SWITCH_ON_DISABLED}
    assert "run.mcap: cannot be written any further: No space left on device" in str(caught.value)
    assert "what was recorded before is readable" in str(caught.value)
    capture = read_capture(path, allow_empty=True)
    assert not capture.damage.closed
    recorded = Samples.concatenate(seen)
    kept = len(capture.samples)
    assert np.array_equal(capture.samples.position, recorded.position[:kept])
    # At most what had not been handed to the system: two batches and a chunk.
    assert len(recorded) - kept <= 0.3 / tx40.bus.cycle_time + len(seen[-1])
