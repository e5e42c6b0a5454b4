"""A payload adds to the torques what pin makes of the same body."""

from __future__ import annotations

import numpy as np
import pinocchio
import pytest

import robots
from robots import Robot, cad_parameters, rigid_body_model
from robots.payload import Payload, PayloadError

TOOL = b"""
  <link name="tool"/>
  <joint name="flange" type="fixed"><parent link="link_6"/><child link="tool"/>
    <origin xyz="0.01 0.02 0.1" rpy="0.3 -0.2 0.5"/></joint>
</robot>"""


@pytest.fixture(scope="module")
def tx40(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """With a tool frame on the flange."""
    robot = robots.load("tx40")
    folder = tmp_path_factory.mktemp("tool")
    text = robot.urdf_path.read_bytes().replace(b"\n</robot>", TOOL)
    (folder / robot.urdf).write_bytes(text)
    return robot.model_copy(update={"folder": folder})


@pytest.mark.parametrize(("frame", "joint"), [("", 6), ("link_6", 6), ("tool", 6), ("link_3", 3)])
def test_it_is_what_pin_adds(tx40: Robot, frame: str, joint: int) -> None:
    payload = Payload(2.5, (0.03, -0.02, 0.1), (0.011, 0.001, 0.012, -0.002, 0.0005, 0.009), frame)
    model = rigid_body_model(tx40)
    before = cad_parameters(model)
    ixx, ixy, iyy, ixz, iyz, izz = payload.inertia
    tensor = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    body = pinocchio.Inertia(2.5, np.array(payload.center), tensor)
    place = pinocchio.SE3.Identity()
    if frame == "tool":
        place = pinocchio.SE3(pinocchio.rpy.rpyToMatrix(0.3, -0.2, 0.5), np.array([0.01, 0.02, 0.1]))
    model.appendBodyToJoint(joint, body, place)
    assert np.allclose(payload.parameters(tx40), cad_parameters(model) - before, rtol=1e-12, atol=1e-14)


def test_an_unknown_frame_is_refused_with_those_there_are(tx40: Robot) -> None:
    with pytest.raises(PayloadError, match=r'"tol" is not a moving link .*allowed: link_1, .*, tool$'):
        Payload(1.0, (0, 0, 0), (1, 0, 1, 0, 0, 1), "tol").parameters(tx40)
    with pytest.raises(PayloadError, match='"base_link" is not a moving link'):
        Payload(1.0, (0, 0, 0), (1, 0, 1, 0, 0, 1), "base_link").parameters(tx40)


@pytest.mark.parametrize(
    ("mass", "inertia"),
    [
        (-1.0, (1, 0, 1, 0, 0, 1)),
        (0.0, (0, 0, 0, 0, 0, 0)),
        (1.0, (1, 0, 1, 0, 0, 3)),
        (1.0, (-1, 0, 1, 0, 0, 1)),
        (1.0, (1, 5, 1, 0, 0, 1)),
    ],
)
def test_what_no_body_has_is_refused(tx40: Robot, mass: float, inertia: tuple[float, ...]) -> None:
    with pytest.raises(PayloadError, match="no body has the mass"):
        Payload(mass, (0, 0, 0), inertia).parameters(tx40)  # type: ignore[arg-type]


def test_a_point_mass_is_a_body(tx40: Robot) -> None:
    assert Payload(1.0, (0, 0, 0.1), (0, 0, 0, 0, 0, 0)).parameters(tx40)[50] == 1.0


def test_an_arm_of_one_axis_can_carry_one() -> None:
    emps = robots.load("emps")
    assert Payload(5.0, (0, 0, 0), (1, 0, 1, 0, 0, 1)).parameters(emps)[0] == pytest.approx(5.0)
