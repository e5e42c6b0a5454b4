"""Poses and bodies of a URDF: numbers to text and rotations to angles."""

from __future__ import annotations

import re

import numpy as np

from robots.arrays import FloatArray

_DECIMALS = re.compile(r"[+-]?\d+\.(\d{2,})")
_GYRATION = 0.05
"""m; radius of gyration of a body whose own tensor cannot be."""


def body_text(
    mass: float, center: FloatArray, rpy: FloatArray | None = None, tensor: list[float] | None = None
) -> str:
    ball = mass * _GYRATION**2
    values = tensor or [ball, 0.0, 0.0, ball, 0.0, ball]
    entries = " ".join(
        f'{key}="{value!r}"'
        for key, value in zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), values, strict=True)
    )
    angles = np.zeros(3) if rpy is None else rpy
    origin = f"<origin {origin_text(center, angles)}/>"
    return f'<inertial>{origin}<mass value="{mass!r}"/><inertia {entries}/></inertial>'


def origin_text(xyz: FloatArray, rpy: FloatArray) -> str:
    return 'xyz="{!r} {!r} {!r}" rpy="{!r} {!r} {!r}"'.format(*(float(x) for x in (*xyz, *rpy)))


def rotation_of(rpy: FloatArray) -> FloatArray:
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def angles_of(rotation: FloatArray) -> FloatArray:
    """Roll, pitch and yaw of a rotation matrix."""
    pitch = np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0]))
    if np.hypot(rotation[0, 0], rotation[1, 0]) < 1e-9:
        return np.array([0.0, pitch, np.arctan2(-rotation[0, 1], rotation[1, 1])])
    roll = np.arctan2(rotation[2, 1], rotation[2, 2])
    return np.array([roll, pitch, np.arctan2(rotation[1, 0], rotation[0, 0])])


def exact_angle(text: str) -> float:
    """An angle, rad; a quarter turn that was written with few digits (1.57, 1.5708) is that quarter turn.

    Axes that miss a right angle by such a rounding alone have inertias that only the rounding tells apart.

    Raises:
        ValueError: it is no number.
    """
    value = float(text)
    quarters = round(value / (np.pi / 2)) if np.isfinite(value) else 0
    if quarters and (written := _DECIMALS.fullmatch(text)):
        exact, unit = abs(quarters) * np.pi / 2, 10.0 ** -len(written[1])
        if -unit < abs(value) - exact <= unit / 2:  # cut off, or rounded
            return float(np.copysign(exact, value))
    return value
