"""The folder for ros2 bag, read by a library that is not ours: every message, and the arm where it stood.

A capture shows the arm itself, too: read by the libraries of MCAP and pinocchio.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

import robots
from daq.api import simulated_recording
from daq.exporting.export import export_capture
from daq.recording.capture import CaptureError
from daq.recording.reader import read_capture
from robots import rigid_body_model
from robots.urdf_export import moving_links


@pytest.fixture(scope="module", params=["tx40", "emps"])
def bag(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A capture and its folder; one arm turns, the other slides."""
    folder = tmp_path_factory.mktemp("bag")
    capture = simulated_recording(folder / "run.mcap", request.param, seed=1, duration=2.0, periods=1)
    return capture, export_capture(capture, "rosbag2").path


def messages(folder: Path, topic: str) -> list[tuple[int, Any]]:
    """Of a folder, or of a capture."""
    if folder.is_file():
        with folder.open("rb") as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            found = list(reader.iter_decoded_messages(topics=[topic]))
        return [(message.log_time, decoded) for _, _, message, decoded in found]
    with AnyReader([folder]) as reader:
        wanted = [one for one in reader.connections if one.topic == topic]
        return [
            (stamp, reader.deserialize(data, connection.msgtype))
            for connection, stamp, data in reader.messages(connections=wanted)
        ]


def test_every_sample_is_there(bag: tuple[Path, Path]) -> None:
    capture = read_capture(bag[0])
    found = messages(bag[1], "/joint_states")
    np.testing.assert_array_equal([list(m.position) for _, m in found], capture.samples.position)
    assert found[0][1].name == list(capture.joints)
    stamps = np.array([stamp for stamp, _ in found])
    np.testing.assert_allclose(np.diff(stamps) * 1e-9, capture.period, rtol=1e-6)
    assert all(m.header.stamp.sec * 10**9 + m.header.stamp.nanosec == stamp for stamp, m in found)
    references = messages(bag[1], "/joint_reference")
    np.testing.assert_array_equal([list(m.position) for _, m in references], capture.samples.reference)


@pytest.mark.parametrize("where", [0, 1], ids=["capture", "folder"])
def test_the_arm_is_described_once(bag: tuple[Path, Path], where: int) -> None:
    ((_, description),) = messages(bag[where], "/robot_description")
    assert description.data == read_capture(bag[0]).urdf_text


@pytest.mark.parametrize(("where", "rate"), [(0, 20), (1, 50)], ids=["capture", "folder"])
def test_the_last_link_stands_where_pinocchio_puts_it(bag: tuple[Path, Path], where: int, rate: int) -> None:
    states = dict(messages(bag[where], "/joint_states"))
    robot = robots.load(read_capture(bag[0]).robot_name)
    model = rigid_body_model(robot)
    data = model.createData()
    poses = messages(bag[where], "/tf")
    assert len(poses) == pytest.approx(rate * 2.0, rel=0.05, abs=1)
    for stamp, message in poses[:: len(poses) // 7]:
        pinocchio.forwardKinematics(model, data, np.array(states[stamp].position))
        reached = pinocchio.SE3.Identity()
        frame = message.transforms[0].header.frame_id
        for step in message.transforms:
            assert step.header.frame_id == frame
            t, r = step.transform.translation, step.transform.rotation
            turn = pinocchio.Quaternion(r.w, r.x, r.y, r.z)
            reached = reached * pinocchio.SE3(turn.matrix(), np.array([t.x, t.y, t.z]))
            frame = step.child_frame_id
        assert frame == moving_links(robot)[-1]
        np.testing.assert_allclose(reached.homogeneous, data.oMi[robot.n].homogeneous, atol=1e-9)


def test_a_folder_that_is_there_is_refused(bag: tuple[Path, Path]) -> None:
    with pytest.raises(CaptureError, match="exists already"):
        export_capture(bag[0], "rosbag2")
    assert (bag[1] / "metadata.yaml").is_file()
