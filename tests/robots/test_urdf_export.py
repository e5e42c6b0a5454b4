"""A URDF with other inertias: pin reads back what was written, and nothing else changes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pinocchio
import pytest

import robots
from robots import Robot, RobotFileError, cad_parameters, rigid_body_model
from robots.pseudo_inertia import link_of_pseudo_inertia, pseudo_inertia
from robots.urdf_export import moving_links, urdf_with_links

INERTIAL = re.compile(rb"\s*<inertial>.*?</inertial>", re.DOTALL)


@pytest.fixture(scope="module")
def tx40() -> Robot:
    return robots.load("tx40")


def other_links(robot: Robot, seed: int) -> np.ndarray:
    """Bodies near those of the URDF, shifted and stretched."""
    generator = np.random.default_rng(seed)
    found = []
    for link in cad_parameters(rigid_body_model(robot)).reshape(-1, 10):
        change = np.eye(4) + 0.2 * np.tril(generator.normal(size=(4, 4)))
        found.append(link_of_pseudo_inertia(change @ pseudo_inertia(link) @ change.T))
    return np.array(found)


def torque(path: Path, seed: int) -> np.ndarray:
    model = pinocchio.buildModelFromUrdf(str(path))
    generator = np.random.default_rng(seed)
    data = model.createData()
    states = generator.uniform(-2.0, 2.0, (50, 3, model.nq))
    return np.array([pinocchio.rnea(model, data, *state) for state in states])


@pytest.mark.parametrize("name", ["tx40", "emps"])
def test_pin_reads_back_what_was_written(name: str, tmp_path: Path) -> None:
    robot = robots.load(name)
    links = other_links(robot, 3)
    path = tmp_path / "arm.urdf"
    path.write_bytes(urdf_with_links(robot, links))
    read = cad_parameters(pinocchio.buildModelFromUrdf(str(path))).reshape(-1, 10)
    assert np.abs(read - links).max() < 1e-14 * np.abs(links).max()


def test_its_torques_are_those_of_the_regressor(tx40: Robot, tmp_path: Path) -> None:
    links = other_links(tx40, 4)
    path = tmp_path / "arm.urdf"
    path.write_bytes(urdf_with_links(tx40, links))
    generator = np.random.default_rng(5)
    model = rigid_body_model(tx40)  # its inertias do not enter the regressor
    data = model.createData()
    states = generator.uniform(-2.0, 2.0, (50, 3, 6))
    expected = np.array(
        [pinocchio.computeJointTorqueRegressor(model, data, *s) @ links.ravel() for s in states]
    )
    assert np.abs(torque(path, 5) - expected).max() < 1e-9 * np.abs(expected).max()


def test_all_else_stays_byte_for_byte(tx40: Robot) -> None:
    before, after = tx40.urdf_path.read_bytes(), urdf_with_links(tx40, other_links(tx40, 6))
    assert INERTIAL.sub(b"", after) == INERTIAL.sub(b"", before)
    assert len(INERTIAL.findall(after)) == 6
    assert after != before


def variant(robot: Robot, folder: Path, old: bytes, new: bytes) -> Robot:
    text = robot.urdf_path.read_bytes()
    assert text.count(old) == 1
    (folder / robot.urdf).write_bytes(text.replace(old, new))
    return robot.model_copy(update={"folder": folder})


def test_links_that_are_fixed_to_a_moving_one_are_counted_once(tx40: Robot, tmp_path: Path) -> None:
    tool = b"""
  <link name="tool"><inertial><mass value="3"/><origin xyz="0 0 0.1" rpy="0.3 0 0"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <visual><geometry/></visual></link>
  <link name="tip"/>
  <joint name="flange" type="fixed"><parent link="link_6"/><child link="tool"/></joint>
  <joint name="end" type="fixed"><parent link="tool"/><child link="tip"/><origin xyz="0 0 0.2"/></joint>
</robot>"""
    robot = variant(tx40, tmp_path, b"\n</robot>", tool)
    assert cad_parameters(rigid_body_model(robot))[50] == pytest.approx(3.2)
    links = other_links(tx40, 7)
    path = tmp_path / "out.urdf"
    path.write_bytes(urdf_with_links(robot, links))
    read = cad_parameters(pinocchio.buildModelFromUrdf(str(path))).reshape(-1, 10)
    assert np.allclose(read, links, rtol=1e-13, atol=1e-15)
    assert b"<visual><geometry/></visual>" in path.read_bytes()


@pytest.mark.parametrize("link", [b'<link name="link_6"/>', b'<link name="link_6">\n  </link>'])
def test_a_link_without_inertia_gets_one(tx40: Robot, tmp_path: Path, link: bytes) -> None:
    text = tx40.urdf_path.read_bytes()
    old = re.search(rb'<link name="link_6">.*?</link>', text, re.DOTALL)
    assert old is not None
    robot = variant(tx40, tmp_path, old.group(), link)
    links = other_links(tx40, 8)
    path = tmp_path / "out.urdf"
    path.write_bytes(urdf_with_links(robot, links))
    read = cad_parameters(pinocchio.buildModelFromUrdf(str(path))).reshape(-1, 10)
    assert np.allclose(read, links, rtol=1e-13, atol=1e-15)


def test_a_note_stands_at_the_top(tx40: Robot, tmp_path: Path) -> None:
    path = tmp_path / "out.urdf"
    path.write_bytes(urdf_with_links(tx40, other_links(tx40, 9), note="from a -- model"))
    assert '<robot name="tx40">\n  <!-- from a ‐‐ model -->' in path.read_text(encoding="utf-8")
    assert pinocchio.buildModelFromUrdf(str(path)).nq == 6


def test_an_impossible_link_is_refused_by_name(tx40: Robot) -> None:
    links = other_links(tx40, 10)
    links[3, 4] *= -1.0
    with pytest.raises(RobotFileError, match="link_4 is none that a body can have; allowed"):
        urdf_with_links(tx40, links)


def test_the_moving_links_are_named_in_the_order_of_the_joints(tx40: Robot) -> None:
    assert moving_links(tx40) == tuple(f"link_{k}" for k in range(1, 7))
