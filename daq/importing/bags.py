"""Which files and folders are bags of messages; what reads them is in ``joint_states``, slower to load."""

from __future__ import annotations

from pathlib import Path

MCAP_SUFFIX, SQLITE_SUFFIX, ROS1_SUFFIX = ".mcap", ".db3", ".bag"
ROS2_SUFFIXES = (MCAP_SUFFIX, SQLITE_SUFFIX)
BAG_SUFFIXES = (*ROS2_SUFFIXES, ROS1_SUFFIX)


def is_bag_folder(path: Path) -> bool:
    """Whether a folder is a ROS 2 bag: it says of itself what is in it."""
    return (path / "metadata.yaml").is_file()
