"""A capture as a folder that ``ros2 bag`` plays and Foxglove shows: joint states, the arm, and its links.

Only message types that every ROS 2 has. ``/robot_description`` and ``/tf_static`` come once and are latched,
``/tf`` at 50 Hz; joint states are all there.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.writer import Writer

from daq.recording.capture import Capture
from daq.recording.cdr import CdrEncoder
from daq.recording.link_messages import transform_rows
from daq.recording.messages import joint_state_layout
from daq.recording.topics import (
    DESCRIPTION_TOPIC,
    JOINT_STATE,
    JOINT_STATE_DEFINITION,
    MEASURED_TOPIC,
    REFERENCE_TOPIC,
    STATIC_TOPIC,
    STRING,
    STRING_DEFINITION,
    TF,
    TF_DEFINITION,
    TF_TOPIC,
)
from robots import Robot
from robots.arrays import IntArray
from robots.urdf import FIXED, read_urdf

TF_RATE = 50.0
"""Hz; what a picture needs."""
_LATCHED = (
    "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n  deadline:\n    sec: 9223372036\n"
    "    nsec: 854775807\n  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n  liveliness: 1\n"
    "  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  avoid_ros_namespace_conventions: false"
)


@dataclass(frozen=True)
class _Topic:
    kind: str
    definition: str
    stamps: IntArray
    messages: list[bytes]
    qos: str = ""


def write_rosbag2(folder: Path, capture: Capture, robot: Robot) -> int:
    """Write the folder.

    Args:
        folder: new; made here.
        capture: with its samples.
        robot: of its description.

    Returns:
        How many samples.

    Raises:
        OSError: it cannot be written.
    """
    folder.mkdir()
    topics = _topics(capture, robot)
    name = f"{folder.name}_0.mcap"
    with (folder / name).open("xb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="armhil")
        channels = {}
        for topic, one in topics.items():
            schema = writer.register_schema(one.kind, "ros2msg", one.definition.encode())
            channels[topic] = writer.register_channel(
                topic, "cdr", schema, metadata={"offered_qos_profiles": one.qos}
            )
        for stamp, topic, message in _in_order(topics):
            writer.add_message(channels[topic], stamp, message, stamp)
        writer.finish()
    (folder / "metadata.yaml").write_text(_metadata(name, topics), encoding="utf-8")
    return len(capture.samples)


def _topics(capture: Capture, robot: Robot) -> dict[str, _Topic]:
    samples = capture.samples
    stamps = _begin(capture) + np.rint(np.asarray(samples.time) * 1e9).astype(np.int64)
    names = [joint.name for joint in robot.joint]
    measured = {"position": samples.position, "effort": robot.joint_torque(samples.control_signal)}
    states = {MEASURED_TOPIC: (joint_state_layout(names, effort=True), measured)}
    if capture.has_reference:
        states[REFERENCE_TOPIC] = (joint_state_layout(names), {"position": samples.reference})
    found = {
        topic: _Topic(
            JOINT_STATE,
            JOINT_STATE_DEFINITION,
            stamps,
            [row.tobytes() for row in layout.rows(stamps, columns)],
        )
        for topic, (layout, columns) in states.items()
    }
    first = stamps[:1]
    text = CdrEncoder()
    text.string(capture.urdf_text)
    found[DESCRIPTION_TOPIC] = _Topic(STRING, STRING_DEFINITION, first, [text.finish()], _LATCHED)
    joints = read_urdf(robot.urdf_path).joints
    fixed = [joint for joint in joints if joint.kind == FIXED]
    if fixed:
        still = [row.tobytes() for row in transform_rows(fixed, first, {})]
        found[STATIC_TOPIC] = _Topic(TF, TF_DEFINITION, first, still, _LATCHED)
    moving = [joint for joint in joints if joint.kind != FIXED]
    every = max(1, round(1.0 / (TF_RATE * capture.period)))
    positions = {name: np.asarray(samples.position)[::every, axis] for axis, name in enumerate(names)}
    turned = [row.tobytes() for row in transform_rows(moving, stamps[::every], positions)]
    found[TF_TOPIC] = _Topic(TF, TF_DEFINITION, stamps[::every], turned)
    return found


def _begin(capture: Capture) -> int:
    """Time of the first message, ns since the epoch; 0 where the recording was never closed."""
    with capture.path.open("rb") as file:
        try:
            summary = make_reader(file).get_summary()
        except (McapError, EOFError):
            return 0
    statistics = None if summary is None else summary.statistics
    return 0 if statistics is None else statistics.message_start_time


def _in_order(topics: Mapping[str, _Topic]) -> Iterator[tuple[int, str, bytes]]:
    """All messages by time."""
    entries = [
        (int(stamp), topic, message)
        for topic, one in topics.items()
        for stamp, message in zip(one.stamps.tolist(), one.messages, strict=True)
    ]
    yield from sorted(entries, key=lambda entry: entry[0])


def _metadata(name: str, topics: Mapping[str, _Topic]) -> str:
    """metadata.yaml of rosbag2, version 5: what Humble and all after it read."""
    stamps = np.concatenate([one.stamps for one in topics.values()])
    count, begin, length = len(stamps), int(stamps.min()), int(stamps.max() - stamps.min())
    lines = [
        "rosbag2_bagfile_information:",
        "  version: 5",
        "  storage_identifier: mcap",
        f"  duration: {{nanoseconds: {length}}}",
        f"  starting_time: {{nanoseconds_since_epoch: {begin}}}",
        f"  message_count: {count}",
        "  topics_with_message_count:",
    ]
    for topic, one in topics.items():
        lines += [
            "    - topic_metadata:",
            f"        name: {topic}",
            f"        type: {one.kind}",
            "        serialization_format: cdr",
            f"        offered_qos_profiles: {json.dumps(one.qos)}",
            f"      message_count: {len(one.stamps)}",
        ]
    lines += [
        '  compression_format: ""',
        '  compression_mode: ""',
        f"  relative_file_paths: [{json.dumps(name)}]",
        "  files:",
        f"    - path: {json.dumps(name)}",
        f"      starting_time: {{nanoseconds_since_epoch: {begin}}}",
        f"      duration: {{nanoseconds: {length}}}",
        f"      message_count: {count}",
    ]
    return "\n".join(lines) + "\n"
