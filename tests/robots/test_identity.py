"""A description is known by all that it says: each part by itself, and not by how it is written."""

from __future__ import annotations

import json

import pytest

import robots
from robots.identity import PARTS, description_parts, description_sha256, differing, mesh_checksums
from tests.robots.conftest import RobotFolder
from tests.robots.test_strict_urdf import SPHERE, stl


@pytest.mark.parametrize(
    ("file", "old", "new", "part"),
    [
        ("robot.toml", "jerk = 400.0", "jerk = 401.0", "robot.toml"),
        ("robot.toml", "gain = 9.05", "gain = 9.06", "robot.toml"),
        ("robot.toml", "node_id = 6", "node_id = 7", "robot.toml"),
        ("tx40.urdf", 'xyz="0 0 0.32"', 'xyz="0 0 0.33"', "kinematics"),
        ("tx40.urdf", 'effort="131.84"', 'effort="131.85"', "kinematics"),
        ("tx40.urdf", '<mass value="4.85"/>', '<mass value="4.86"/>', "inertias"),
        ("tx40.urdf", 'iyy="0.0715"', 'iyy="0.0716"', "inertias"),
        ("tx40.urdf", 'radius="0.065"', 'radius="0.066"', "bodies"),
        ("tx40.urdf", 'xyz="0 0 0.09"', 'xyz="0 0 0.08"', "bodies"),
    ],
)
def test_each_figure_counts_and_its_part_is_named(
    folder: RobotFolder, file: str, old: str, new: str, part: str
) -> None:
    before = description_parts(robots.load(folder.path))
    folder.edit(folder.path / file, old, new)
    after = description_parts(robots.load(folder.path))
    assert [name for name in before if before[name] != after[name]] == [part]
    assert description_sha256(before) != description_sha256(after)
    assert differing(before, after) == PARTS[part]
    assert differing(before, before) == ""


def test_how_it_is_written_makes_no_difference(folder: RobotFolder) -> None:
    before = description_parts(robots.load(folder.path))
    text = folder.urdf.read_text("utf-8")
    text = text.replace('radius="0.065"', 'radius="6.5e-2"').replace("<collision>", "<!-- a -->\n<collision>")
    text = text.replace("</link>", '<visual><geometry><mesh filename="v.stl"/></geometry></visual></link>')
    (folder.path / "other.urdf").write_text(text, "utf-8")
    toml = folder.toml.read_text("utf-8").replace('urdf = "tx40.urdf"', 'urdf = "other.urdf"  # moved')
    toml = toml.replace("gear = 48.0", "gear = 48").replace('description = "', 'description = "My ')
    folder.toml.write_text(toml, "utf-8")
    assert description_parts(robots.load(folder.path)) == before


def test_the_content_of_a_mesh_counts_and_its_name_does_not(folder: RobotFolder) -> None:
    stl(folder.path / "a.stl", 0.2)
    stl(folder.path / "b.stl", 0.2)
    folder.edit(folder.urdf, SPHERE, '<mesh filename="a.stl"/>')
    arm = robots.load(folder.path)
    before, checksums = description_parts(arm), mesh_checksums(arm)
    folder.edit(folder.urdf, "a.stl", "b.stl")
    assert description_parts(robots.load(folder.path)) == before
    stl(folder.path / "b.stl", 0.21)
    after = description_parts(robots.load(folder.path))
    assert [name for name in before if before[name] != after[name]] == ["meshes"]
    # Out of a capture, where the meshes are not at hand, their checksums take their place.
    folder.edit(folder.urdf, "b.stl", "a.stl")
    (folder.path / "a.stl").unlink()
    again = robots.load(folder.path, known_meshes=json.loads(json.dumps(checksums)))
    assert description_parts(again) == before
