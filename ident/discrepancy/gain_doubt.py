"""What the drives' gains, known to a share, leave open of an effect that is told against a prior.

A torque is known through g_τ alone. Where all gains are δ too low, a payload of 5 kg weighs 5(1 − δ) kg, and
no row of the recordings contradicts that: the prior was identified with the same gains, so what they make of
the arm's own torque is in it. So the torque of an effect E θ at a drive is off by that drive's share, θ̂ by
the least squares of it, and its variance is the sum over the drives, whose gains are independent.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ident.effects.family import PlacedEffect
from robots.arrays import FloatArray
from robots.description import Robot


def scales_with_gains(effect: PlacedEffect) -> bool:
    """Whether its parameters are torques, or what makes them: not shares, times or angles."""
    return any(unit.startswith(("N", "kg")) for unit in effect.units)


def by_each_drive(robot: Robot, torque: FloatArray) -> Iterator[FloatArray]:
    """Joint torques (rows × joints) of one deviation of each drive's gain in turn.

    Args:
        robot: transmission, and how well the gains are known.
        torque: of an effect, rows × joints.
    """
    turn = robot.transmission_matrix
    drives = torque @ np.linalg.inv(turn)
    for k, drive in enumerate(robot.drive):
        if drive.gain_relative_uncertainty > 0.0:
            yield drive.gain_relative_uncertainty * np.outer(drives[:, k], turn[k])
