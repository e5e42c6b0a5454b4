"""A URDF that is broken, or that is not the arm of robot.toml, gives one line with file and line."""

from __future__ import annotations

import re

import pytest

import robots
from robots import RobotFileError
from tests.robots.conftest import RobotFolder


def error_of(folder: RobotFolder) -> str:
    with pytest.raises(RobotFileError) as caught:
        robots.load(folder.path)
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


def without(text: str, tag: str, name: str) -> str:
    return re.sub(rf'  <{tag} name="{name}".*?</{tag}>\n', "", text, flags=re.DOTALL)


def test_missing_joint_is_named_with_the_urdf(folder: RobotFolder) -> None:
    text = without(folder.urdf.read_text("utf-8"), "joint", "joint_6")
    folder.urdf.write_text(without(text, "link", "link_6"), "utf-8")
    toml = folder.toml.read_text("utf-8")
    line = toml.count("\n", 0, toml.index('name = "joint_6"')) + 1
    assert error_of(folder) == (
        f'{folder.toml}:{line}: joint[6].name: "joint_6" is not a moving joint of {folder.urdf}; '
        "allowed: joint_1, joint_2, joint_3, joint_4, joint_5"
    )


def test_joint_that_only_the_urdf_has(folder: RobotFolder) -> None:
    line = folder.edit(
        folder.urdf,
        "</robot>",
        '<link name="tip"/><joint name="gripper" type="revolute"><parent link="link_6"/><child link="tip"/>'
        '<axis xyz="0 0 1"/><limit lower="0" upper="1" velocity="1" effort="1"/></joint></robot>',
    )
    message = error_of(folder)
    assert message.startswith(
        f'{folder.urdf}:{line}: joint "gripper": moves, but {folder.toml} has no [[joint]]'
    )
    assert 'allowed: joint_1, joint_2, joint_3, joint_4, joint_5, joint_6, or type="fixed"' in message


def test_fixed_joints_are_fine(folder: RobotFolder) -> None:
    joint = '<joint name="flange" type="fixed"><parent link="link_6"/><child link="tip"/></joint>'
    folder.edit(folder.urdf, "</robot>", f'<link name="tip"/>{joint}</robot>')
    assert robots.rigid_body_model(robots.load(folder.path)).nv == 6


def test_urdf_that_is_not_there(folder: RobotFolder) -> None:
    line = folder.edit(folder.toml, "tx40.urdf", "tx60.urdf")
    message = error_of(folder)
    assert message.startswith(
        f'{folder.toml}:{line}: urdf: "tx60.urdf" is not a file in {folder.path}; allowed: '
    )


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("</joint>", "</joinx>", "not XML: mismatched tag at column "),
        ('xyz="0 0 0.32"', 'xyz="0 0"', '<origin xyz>: "0 0" is not 3 numbers; allowed: 3 numbers'),
        ('xyz="0 0 0.32"', 'xyz="0 0 a"', '<origin xyz>: "0 0 a" is not 3 numbers'),
        ('<mass value="4.85"/>', '<mass value="nan"/>', '<mass value>: "nan" is not a number'),
        ('<child link="link_3"/>', '<child link="link_33"/>', 'joint "joint_3": "link_33" is not a link of'),
        ('name="joint_3" type="revolute"', 'name="joint_3"', 'joint "joint_3": <joint> has no type="…"'),
        ('"joint_3" type="revolute"', '"joint_3" type="ball"', 'joint "joint_3": "ball" is not a type'),
        (
            '"joint_3" type="revolute"',
            '"joint_3" type="continuous"',
            'joint "joint_3": "continuous" is not a type',
        ),
    ],
)
def test_broken_urdf_text(folder: RobotFolder, old: str, new: str, problem: str) -> None:
    line = folder.edit(folder.urdf, old, new)
    found = re.fullmatch(rf"{re.escape(str(folder.urdf))}:(\d+): (.*)", error_of(folder))
    assert found is not None
    assert found[2].startswith(problem)
    # A link of a joint is reported at the joint's limit, a few lines below.
    assert line <= int(found[1]) <= line + 4


def test_urdf_that_is_another_xml(folder: RobotFolder) -> None:
    folder.urdf.write_text("<?xml version='1.0'?>\n<sdf/>", "utf-8")
    assert error_of(folder) == f"{folder.urdf}:2: <sdf> is not a URDF; allowed: <robot> at the top"


def test_empty_urdf(folder: RobotFolder) -> None:
    folder.urdf.write_text("", "utf-8")
    assert error_of(folder).startswith(f"{folder.urdf}:1: not XML: no element found")


def test_joints_in_another_order(folder: RobotFolder) -> None:
    folder.edit(folder.toml, 'name = "joint_4"', 'name = "joint_x"')
    line = folder.edit(folder.toml, 'name = "joint_3"', 'name = "joint_4"')
    folder.edit(folder.toml, 'name = "joint_x"', 'name = "joint_3"')
    message = error_of(folder)
    assert message.startswith(
        f'{folder.toml}:{line}: joint[3].name: "joint_4" is out of place: the URDF has '
    )


def test_kind_differs(folder: RobotFolder) -> None:
    line = folder.edit(folder.toml, 'name = "joint_4"', 'kind = "prismatic"\nname = "joint_4"')
    message = error_of(folder)
    assert message.startswith(f'{folder.toml}:{line}: joint[4].kind: "prismatic" is "revolute" in tx40.urdf:')
    assert message.endswith('; allowed: "revolute"')


@pytest.mark.parametrize(
    ("old", "new", "key", "allowed"),
    [
        ("velocity = 7.155", "velocity = 8", "joint[4].velocity", "at most 7.155849933176752"),
        ("torque = 46.08", "torque = 46.09", "joint[4].torque", "at most 46.08"),
        ("[-2.0943, 2.33]", "[-2.0943, 2.34]", "joint[5].position[2]", "at most 2.330014551412429"),
        ("[-2.0943, 2.33]", "[-2.1, 2.33]", "joint[5].position[1]", "at least -2.0943951023931953"),
    ],
)
def test_limits_beyond_the_urdf(folder: RobotFolder, old: str, new: str, key: str, allowed: str) -> None:
    line = folder.edit(folder.toml, old, new)
    message = error_of(folder)
    assert message.startswith(f"{folder.toml}:{line}: {key}: ")
    assert message.endswith(f"; allowed: {allowed}")


def test_links_that_hang_in_a_loop(folder: RobotFolder) -> None:
    folder.edit(folder.urdf, '<parent link="base_link"/>', '<parent link="link_6"/>')
    assert error_of(folder).startswith(f"{folder.urdf}:43: not one tree: link_1, link_2, link_3, link_4, ")


def test_link_that_hangs_on_two_joints(folder: RobotFolder) -> None:
    folder.edit(folder.urdf, '<child link="link_3"/>', '<child link="link_2"/>')
    assert ': joint "joint_3": "link_2" hangs on two joints' in error_of(folder)


def test_loose_link(folder: RobotFolder) -> None:
    line = folder.edit(folder.urdf, "</robot>", '<link name="tool"/></robot>')
    assert error_of(folder).startswith(f"{folder.urdf}:{line}: not one tree: tool apart from it")
