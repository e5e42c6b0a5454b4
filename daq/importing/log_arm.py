"""The description of an arm for one log: from a URDF, and from the log where the URDF is silent."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from daq.files.toml_text import toml_text
from robots import Robot, robot_from_text
from robots.arrays import FloatArray
from robots.loose_urdf import LooseUrdf, strict_text

URDF_NAME = "arm.urdf"
_STILL = 1e-4
"""Share of a joint's range, or of half a turn, that a joint at rest may seem to move by noise."""
_ROOM = 1.25
"""Times what a log shows: a limit that the URDF does not give."""


def still_joints(urdf: LooseUrdf, names: tuple[str, ...], position: FloatArray) -> list[int]:
    """Which columns of samples × names stand still."""
    ranges = {j.name: j.position for j in urdf.moving}
    wide = [np.pi if (r := ranges[name]) is None else r[1] - r[0] for name in names]
    return [int(k) for k in np.flatnonzero(np.ptp(position, axis=0) < _STILL * np.array(wide))]


def write_description(
    folder: Path,
    urdf: LooseUrdf,
    names: tuple[str, ...],
    held: dict[str, float],
    seen: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    settings: dict[str, object],
    transmission: tuple[tuple[float, ...], ...] = (),
) -> Robot:
    """Write robot.toml and URDF into a folder, and load them.

    Args:
        folder: exists.
        urdf: the arm.
        names: joints that the log moves, from base to tip.
        held: joint → position at which it is held, of all other moving ones.
        seen: (n,) each, of the log: lower and upper positions, largest speed, largest torque.
        settings: of ``[identification]``.
        transmission: of drives that move several joints; the identity where empty.

    Raises:
        RobotFileError: the description is wrong all the same.
    """
    by_name = {joint.name: joint for joint in urdf.moving}
    limits, tables = {}, []
    for name, low, high, speed, torque in zip(names, *seen, strict=True):
        joint = by_name[name]
        lower, upper = joint.position or (float(low) - 1.0, float(high) + 1.0)
        velocity = float(np.clip(joint.velocity or _ROOM * speed, 1e-3, 50.0))
        effort = float(np.clip(joint.effort or _ROOM * torque, 1e-3, 1e5))
        limits[name] = (lower, upper, velocity, effort)
        tables.append(
            {
                "name": name,
                "kind": joint.kind,
                "position": [lower, upper],
                "velocity": velocity,
                "acceleration": min(10.0 * velocity, 2000.0),
                "jerk": min(200.0 * velocity, 1e6),
                "torque": effort,
            }
        )
    text = "# Written by armhil from a URDF and a log, for logs alone: see docs/reference/robot-toml.md.\n"
    text += "# Accelerations and jerks stand in no URDF; they are 10 and 200 times the speed limits.\n"
    text += toml_text(
        {
            "format": 1,
            "name": urdf.name,
            "description": f"read from {urdf.file.name}",
            "urdf": URDF_NAME,
            **({"transmission": transmission} if transmission else {}),
            "joint": tables,
            "identification": settings,
        }
    )
    (folder / URDF_NAME).write_text(strict_text(urdf, limits, held), encoding="utf-8")
    (folder / "robot.toml").write_text(text, encoding="utf-8")
    return robot_from_text(text, folder / "robot.toml")
