"""Shoulder and elbow of the shipped six-axis arm, an arm of two axes for what takes many runs."""

from __future__ import annotations

import tomllib
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import robots
from daq.files.toml_text import toml_text

NAME = "elbow"
JOINTS = ("joint_2", "joint_3")
AXES = (1, 2)
"""Of the six-axis arm, from 0."""
LINKS = ("base_link", "link_2", "link_3")
PER_AXIS = ("position_gain", "velocity_gain", "integral_gain", "velocity_feed_forward", "saturation")


def shoulder_and_elbow(folder: Path) -> Path:
    """Write robot.toml and URDF of the two axes; what hangs on the elbow is its own link alone.

    Returns:
        the robot.toml.
    """
    whole = robots.load("tx40")
    given: dict[str, Any] = tomllib.loads(whole.source_text)
    for number, axis in enumerate(AXES, start=1):
        given["drive"][axis]["node_id"] = number
    own = {
        **given,
        "name": NAME,
        "description": "Shoulder and elbow of the shipped six-axis arm",
        "urdf": f"{NAME}.urdf",
        "home": [given["home"][axis] for axis in AXES],
        "transmission": [[1.0, 0.0], [0.0, 1.0]],
        "joint": [given["joint"][axis] for axis in AXES],
        "drive": [given["drive"][axis] for axis in AXES],
        "controller": {
            key: [value[axis] for axis in AXES] if key in PER_AXIS else value
            for key, value in given["controller"].items()
        },
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / own["urdf"]).write_text(_urdf(whole.urdf_path), encoding="utf-8")
    file = folder / "robot.toml"
    file.write_text(toml_text(own), encoding="utf-8")
    return file


def _urdf(source: Path) -> str:
    """The URDF of the shipped arm with the two joints and their links; the shoulder stands on the base."""
    tree = ET.fromstring(source.read_text(encoding="utf-8"))
    for element in [*tree.findall("joint"), *tree.findall("link")]:
        if element.get("name") not in (*JOINTS, *LINKS):
            tree.remove(element)
    tree.set("name", NAME)
    (shoulder,) = (joint for joint in tree.findall("joint") if joint.get("name") == JOINTS[0])
    for tag, key, value in (("parent", "link", "base_link"), ("origin", "xyz", "0 0 0.32")):
        found = shoulder.find(tag)
        assert found is not None
        found.set(key, value)
    return ET.tostring(tree, encoding="unicode")
