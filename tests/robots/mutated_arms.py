"""One mutated description, judged: refused in one line with its place, or the arm that the file says."""

from __future__ import annotations

from pathlib import Path

import coal
import numpy as np
import pinocchio

import robots
from robots import Robot, RobotFileError
from robots.rigid_body import collision_bodies
from robots.windows import following_error_window
from tests.robots.mutations import Mutation
from tests.robots.toml_mutations import CAPS, windows_said
from tests.robots.urdf_said import Said, said


def judged_urdf(file: Path, original: str, mutation: Mutation) -> str | None:
    """Load the arm of ``file`` (its robot.toml) with a mutated URDF; the refusal, or None where accepted.

    Raises:
        AssertionError: it was accepted and is another arm, or the refusal is none for a user.
    """
    urdf = file.parent / "tx40.urdf"
    urdf.write_text(mutation.text, encoding="utf-8")
    try:
        robot = robots.load(file)
        built = built_of(robot)
    except RobotFileError as error:
        require_one_line(str(error), file.parent, mutation.what)
        return str(error)
    assert_same(built, said(mutation.text), mutation.what)
    if mutation.kind == "slip":
        assert_same(built, said(original), mutation.what)
    return None


def judged_toml(file: Path, original: str, mutation: Mutation) -> str | None:
    """Load the arm of a mutated robot.toml; the refusal, or None where accepted.

    Raises:
        AssertionError: it was accepted with windows that the file does not ask for, or that no arm has.
    """
    file.write_text(mutation.text, encoding="utf-8")
    try:
        robot = robots.load(file)
        built = built_of(robot)
    except RobotFileError as error:
        require_one_line(str(error), file.parent, mutation.what)
        return str(error)
    assert_same(built, said((file.parent / "tx40.urdf").read_text("utf-8")), mutation.what)
    windows = windows_of(robot)
    for name, wanted in windows_said(mutation.text if mutation.kind == "edit" else original).items():
        np.testing.assert_allclose(windows[name], wanted, rtol=1e-12, err_msg=f"{name}: {mutation.what}")
        if name in CAPS:
            assert np.abs(windows[name]).max() <= CAPS[name], (name, mutation.what)
    return None


def require_one_line(message: str, folder: Path, what: str) -> None:
    """A refusal is one line that begins with the file."""
    assert "\n" not in message, what
    assert message.startswith(str(folder)), (what, message)
    assert len(message) < 1000, (what, message)


def assert_same(built: Said, wanted: Said, what: str) -> None:
    """The model has the bodies and masses that are said, each once."""
    assert len(built.bodies) == len(wanted.bodies), what
    for one, other in zip(sorted(built.bodies), sorted(wanted.bodies), strict=True):
        assert one[0] == other[0], what
        np.testing.assert_allclose(one[1], other[1], rtol=1e-9, atol=1e-12, err_msg=what)
        np.testing.assert_allclose(one[2], other[2], rtol=1e-9, atol=1e-9, err_msg=what)
    assert set(built.masses) <= set(wanted.masses), what
    for link, mass in built.masses.items():
        np.testing.assert_allclose(mass, wanted.masses[link], rtol=1e-9, err_msg=what)
        np.testing.assert_allclose(built.inertias[link], wanted.inertias[link], rtol=1e-9, atol=1e-12)


def built_of(robot: Robot) -> Said:
    """What Pinocchio and coal have of an arm whose links are each moved by a joint of their own."""
    model = robots.rigid_body_model(robot)
    geometry = collision_bodies(robot, model)
    data, geometry_data = model.createData(), geometry.createData()
    pinocchio.updateGeometryPlacements(model, data, geometry, geometry_data, np.zeros(model.nq))
    bodies = []
    for body, place in zip(geometry.geometryObjects, geometry_data.oMg, strict=True):
        shape, size = _shape(body.geometry)
        bodies.append((shape, size, tuple(place.translation.tolist())))
    names = {frame.parentJoint: frame.name for frame in model.frames if "BODY" in str(frame.type)}
    inertias = {names[k]: model.inertias[k] for k in range(1, model.njoints)}
    return Said(
        tuple(bodies),
        {name: float(body.mass) for name, body in inertias.items()},
        {name: float(np.trace(body.inertia)) for name, body in inertias.items()},
    )


def _shape(geometry: coal.CollisionGeometry) -> tuple[str, tuple[float, ...]]:
    if isinstance(geometry, coal.Box):
        return "box", tuple((2 * geometry.halfSide).tolist())
    if isinstance(geometry, coal.Sphere):
        return "sphere", (geometry.radius,)
    assert isinstance(geometry, coal.Cylinder)
    return "cylinder", (geometry.radius, 2 * geometry.halfLength)


def windows_of(robot: Robot) -> dict[str, list[float]]:
    """Every window of safety that is computed from a robot.toml."""
    per_count = robot.gains * np.array([drive.control_signal.per_count for drive in robot.drive])
    return {
        "following error": following_error_window(robot, robot.bus.cycle_time).tolist(),
        "torque": robot.torque_limits.tolist(),
        "torque per count": (robot.transmission_matrix.T * per_count).ravel().tolist(),
        "position": [*robot.lower.tolist(), *robot.upper.tolist()],
        "velocity": robot.velocity_limits.tolist(),
        "acceleration": robot.acceleration_limits.tolist(),
        "counts": np.abs(robot.counts_per_output_unit).tolist(),
    }
