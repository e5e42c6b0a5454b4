"""``sensor_msgs/JointState`` out of ROS 1 bags, by the library rosbags."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from daq.recording.errors import CaptureError
from daq.recording.messages import JointState
from robots.extras import install_command

_TYPE = "sensor_msgs/msg/JointState"


def in_rosbag1(path: Path) -> Iterator[tuple[str, int, JointState]]:
    """Topic, time of recording in ns, and message, in the order of the bag.

    Raises:
        CaptureError: not a ROS 1 bag, or rosbags is not installed.
        OSError: it cannot be opened.
    """
    try:
        from rosbags.rosbag1 import Reader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        command = install_command("ros1")
        raise CaptureError(f"{path}: a ROS 1 bag needs rosbags; install it with: {command}") from None
    store = get_typestore(Stores.ROS1_NOETIC)
    with path.open("rb"):
        pass
    try:
        with Reader(path) as reader:
            chosen = [c for c in reader.connections if c.msgtype == _TYPE]
            for connection, time, data in reader.messages(connections=chosen) if chosen else ():
                message: Any = store.deserialize_ros1(data, _TYPE)
                header = message.header.stamp
                stamp = header.sec * 1_000_000_000 + header.nanosec
                fields = (tuple(map(float, getattr(message, f))) for f in ("position", "velocity", "effort"))
                yield connection.topic, time, JointState(stamp, tuple(message.name), *fields)
    except CaptureError:
        raise
    except Exception as error:  # a damaged bag raises whatever its parser meets
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise CaptureError(f"{path}: is not a ROS 1 bag that can be read to its end: {reason}") from error
