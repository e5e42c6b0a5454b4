"""Does the arm stand where its drives say? Encoders that forget need somebody who looks."""

from __future__ import annotations

import numpy as np

from drivers.errors import DriveError
from robots.arrays import FloatArray
from robots.description import Robot


def refuse_unattested(robot: Robot, attested: bool, doubt: str | None = None) -> None:
    """Refuse to move an arm with drives that lose their position with the supply, or whose zero has moved.

    Args:
        robot: the arm.
        attested: whether somebody has said since the opening where it stands.
        doubt: what speaks against the drives' positions.

    Raises:
        DriveError: names the first such joint.
    """
    if attested:
        return
    if doubt is not None:
        raise DriveError(
            f"{doubt}: its zero has moved, or it was moved while nothing drove it; look where it stands and"
            " attest that (`armhil home`, or --stands-at) before it moves"
        )
    for joint, drive in zip(robot.joint, robot.drive, strict=True):
        if drive.position_reference == "homing":
            raise DriveError(
                f"joint {joint.name}: its drive's position is lost with the supply (position_reference "
                '"homing"); attest where the arm stands before it moves'
            )


def attest(robot: Robot, actual: FloatArray, posture: FloatArray, tolerance: float) -> None:
    """Compare what the drives say with what somebody sees.

    Args:
        robot: names of the joints.
        actual: (n,) rad or m, of the drives.
        posture: (n,) rad or m, as seen.
        tolerance: rad or m.

    Raises:
        DriveError: the first joint that differs, or a posture of the wrong length.
    """
    if posture.shape != (robot.n,) or not np.isfinite(posture).all():
        raise DriveError(f"posture has shape {posture.shape}; allowed: {robot.n} numbers, one per joint")
    distance = np.abs(actual - posture)
    if (distance > tolerance).any():
        axis = int(np.argmax(distance))
        raise DriveError(
            f"joint {robot.joint[axis].name} stands at {posture[axis]:.6g} but its drive says "
            f"{actual[axis]:.6g}; allowed: {tolerance:g} apart; home the drive first"
        )
