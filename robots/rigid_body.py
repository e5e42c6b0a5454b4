"""From a robot to its Pinocchio model."""

from __future__ import annotations

import numpy as np
import pinocchio

from robots.description import Robot
from robots.errors import RobotFileError


def rigid_body_model(robot: Robot) -> pinocchio.Model:
    """The rigid-body model of the URDF: gravity of robot.toml, joints in the order of ``robot.joint``.

    Drive inertia and friction are not in it; they belong to the drives.

    Raises:
        RobotFileError: Pinocchio cannot read the URDF, or finds other joints than robot.toml names.
    """
    try:
        model = pinocchio.buildModelFromUrdf(str(robot.urdf_path))
    except (ValueError, RuntimeError) as error:
        raise RobotFileError(robot.urdf_path, f"not a URDF that Pinocchio reads: {error}") from None
    names = [joint.name for joint in robot.joint]
    found = list(model.names)[1:]
    if found != names or model.nv != robot.n or model.nq != robot.n:
        raise RobotFileError(
            robot.urdf_path, f"has the moving joints {', '.join(found) or 'none'}", allowed=", ".join(names)
        )
    model.gravity.linear = np.array(robot.gravity)
    return model
