"""The two arms that ship are the arms that their sources publish."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pinocchio
import pytest

import robots
from robots.arrays import FloatArray

# The published tables, written down here once more: nothing below reads them from the shipped files.
DENAVIT_HARTENBERG = [
    # a[j-1], alpha[j-1], d[j], offset
    (0.0, 0.0, 0.0, 0.0),
    (0.0, -np.pi / 2, 0.0, -np.pi / 2),
    (0.225, 0.0, 0.035, np.pi / 2),
    (0.0, np.pi / 2, 0.225, 0.0),
    (0.0, -np.pi / 2, 0.0, 0.0),
    (0.0, np.pi / 2, 0.0, np.pi),
]
BASE_HEIGHT = 0.32
MASSES = [8.61, 4.85, 4.07, 3.62, 1.02, 0.2]
FIRST_MOMENTS = {
    2: (0.392, -0.0072, 0.162),
    3: (0.0326, 0.0244, 0.265),
    4: (0.0145, -0.00724, -0.586),
    5: (0.0, -0.00306, -0.00102),
    6: (0.0, 0.0, 0.0084),
}
SPEEDS_DEGREES = [287, 287, 430, 410, 320, 700]
LIMITS_DEGREES = [(-180, 180), (-125, 125), (-138, 138), (-270, 270), (-120, 133.5), (-270, 270)]
RESOLUTION_MILLIDEGREES = [0.057, 0.057, 0.122, 0.114, 0.122, 0.172]


@pytest.fixture(scope="module")
def tx40() -> robots.Robot:
    return robots.load("tx40")


@pytest.fixture(scope="module")
def tx40_model(tx40: robots.Robot) -> pinocchio.Model:
    return robots.rigid_body_model(tx40)


def denavit_hartenberg_frames(q: FloatArray) -> list[FloatArray]:
    """Link frames in the base, 4 × 4 each: Rx(alpha) · Tx(a) · Rz(theta) · Tz(d), modified convention."""
    frame = np.eye(4)
    frame[2, 3] = BASE_HEIGHT
    frames = []
    for (a, alpha, d, offset), angle in zip(DENAVIT_HARTENBERG, q, strict=True):
        ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(angle + offset), np.sin(angle + offset)
        step = [
            [ct, -st, 0, a],
            [st * ca, ct * ca, -sa, -d * sa],
            [st * sa, ct * sa, ca, d * ca],
            [0, 0, 0, 1],
        ]
        frame = frame @ np.array(step)
        frames.append(frame)
    return frames


def test_shipped_names() -> None:
    assert robots.shipped() == ("emps", "tx40")


@pytest.mark.parametrize("name", robots.shipped())
def test_loads_by_name_file_and_folder(name: str) -> None:
    by_name = robots.load(name)
    folder = Path(robots.__file__).parent / name
    assert by_name.name == name
    assert by_name == robots.load(folder) == robots.load(str(folder / "robot.toml"))
    assert by_name.source_text == (folder / "robot.toml").read_text("utf-8")
    assert by_name.urdf_path.is_file()


def test_whole_numbers_are_numbers(tmp_path: Path) -> None:
    folder = Path(robots.__file__).parent / "tx40"
    text = (
        (folder / "robot.toml")
        .read_text("utf-8")
        .replace("jerk = 400.0", "jerk = 400")
        .replace("[1.0,", "[1,")
    )
    robot = robots.robot_from_text(text, folder / "robot.toml")
    assert isinstance(robot.joint[0].jerk, float)
    assert robot == robots.load("tx40").model_copy(update={"source_text": text})


def test_forward_kinematics_are_the_published_table(tx40_model: pinocchio.Model) -> None:
    data = tx40_model.createData()
    generator = np.random.default_rng(3)
    for q in [np.zeros(6), *generator.uniform(-3, 3, (50, 6))]:
        pinocchio.forwardKinematics(tx40_model, data, q)
        for j, frame in enumerate(denavit_hartenberg_frames(q), start=1):
            np.testing.assert_allclose(data.oMi[j].homogeneous, frame, atol=1e-12)


def test_masses_and_first_moments_are_the_published_ones(tx40_model: pinocchio.Model) -> None:
    parameters = robots.cad_parameters(tx40_model).reshape(6, 10)
    np.testing.assert_allclose(parameters[:, 0], MASSES, rtol=1e-14)
    for j, moment in FIRST_MOMENTS.items():
        np.testing.assert_allclose(parameters[j - 1, 1:4], moment, atol=1e-14)


@pytest.mark.parametrize("name", robots.shipped())
def test_pseudo_inertias_are_positive_definite(name: str) -> None:
    model = robots.rigid_body_model(robots.load(name))
    for inertia in list(model.inertias)[1:]:
        about_frame = inertia.inertia - inertia.mass * pinocchio.skew(inertia.lever) @ pinocchio.skew(
            inertia.lever
        )
        pseudo = np.zeros((4, 4))
        pseudo[:3, :3] = 0.5 * np.trace(about_frame) * np.eye(3) - about_frame
        pseudo[:3, 3] = pseudo[3, :3] = inertia.mass * inertia.lever
        pseudo[3, 3] = inertia.mass
        assert np.linalg.eigvalsh(pseudo).min() > 1e-6


def test_limits_are_the_published_ones(tx40: robots.Robot) -> None:
    limits = np.deg2rad(LIMITS_DEGREES)
    assert np.all(tx40.lower >= limits[:, 0]) and np.all(tx40.upper <= limits[:, 1])
    np.testing.assert_allclose(np.column_stack([tx40.lower, tx40.upper]), limits, atol=2e-4)
    np.testing.assert_allclose(tx40.velocity_limits, np.deg2rad(SPEEDS_DEGREES), atol=1e-3)
    np.testing.assert_array_equal(tx40.torque_limits, [131.84, 131.84, 103.49, 46.08, 43.19, 30.72])


def test_one_count_is_the_published_resolution(tx40: robots.Robot) -> None:
    millidegrees = np.rad2deg(1 / np.abs(tx40.counts_per_output_unit)) * 1e3
    np.testing.assert_allclose(millidegrees, RESOLUTION_MILLIDEGREES, atol=5e-4)
    np.testing.assert_array_equal(np.sign(tx40.counts_per_output_unit), [1, 1, 1, -1, 1, 1])


def test_control_signal_is_fine_enough(tx40: robots.Robot) -> None:
    for drive, saturation, torque in zip(
        tx40.drive, tx40.controller.saturation, tx40.torque_limits, strict=True
    ):
        assert drive.control_signal.per_count <= 0.001 * saturation
        assert torque * 0.999 <= saturation * drive.gain <= torque


def test_emps_is_the_published_rig() -> None:
    emps = robots.load("emps")
    assert emps.joint[0].kind == "prismatic"
    assert emps.drive[0].gain == pytest.approx(35.15065188, abs=1e-8)
    np.testing.assert_allclose(emps.counts_per_output_unit, [1 / 50e-9])
    model = robots.rigid_body_model(emps)
    assert robots.cad_parameters(model)[0] == 95.1
    # Horizontal: gravity does not act along the axis.
    assert abs(pinocchio.computeGeneralizedGravity(model, model.createData(), np.zeros(1))[0]) < 1e-12


def test_home_is_far_from_the_wrist_singularity(tx40: robots.Robot, tx40_model: pinocchio.Model) -> None:
    data = tx40_model.createData()
    pinocchio.forwardKinematics(tx40_model, data, np.array(tx40.home))
    axes = [data.oMi[j].rotation[:, 2] for j in range(1, 7)]
    parallel = [abs(axes[3] @ axes[5])]
    assert max(parallel) < 0.95


@pytest.mark.parametrize("elbow", [0.0, 1.5707, 2.4085])
def test_collision_bodies_are_apart(tx40: robots.Robot, tx40_model: pinocchio.Model, elbow: float) -> None:
    """At home, stretched, and folded to the limit: the arm's own limits must not be a collision."""
    geometry = pinocchio.buildGeomFromUrdf(tx40_model, str(tx40.urdf_path), pinocchio.GeometryType.COLLISION)
    parents = [body.parentJoint for body in geometry.geometryObjects]
    assert set(parents) == set(range(7))
    for i, j in itertools.combinations(range(len(parents)), 2):
        # Neighbours share a joint; the wrist's three bodies meet in one point.
        if abs(parents[i] - parents[j]) > 1 and (parents[i], parents[j]) != (4, 6):
            geometry.addCollisionPair(pinocchio.CollisionPair(i, j))
    data = geometry.createData()
    posture = np.array([0.0, 0.0, elbow, 0.0, 0.5, 0.0])
    pinocchio.computeCollisions(tx40_model, tx40_model.createData(), geometry, data, posture, False)
    assert not any(result.isCollision() for result in data.collisionResults)
