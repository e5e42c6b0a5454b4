"""Which joints the position columns of a log belong to, in which unit, and at which side of the gears."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from daq.importing.channels import Channels
from daq.importing.guess_torque import LogHints
from daq.recording.capture import CaptureError
from robots.arrays import FloatArray
from robots.loose_urdf import LooseUrdf

_FAR = 1.5
"""Times a joint's largest limit."""


_DEGREE = np.pi / 180


def joints_of(position: Channels, arm: LooseUrdf) -> tuple[str, ...]:
    """The joint of each column: by name, else in order; the first of the arm's where the log has fewer."""
    names = [joint.name for joint in arm.moving]
    said = [next((n for n in sorted(names, key=len, reverse=True) if n in c), "") for c in position.columns]
    if all(said) and len(set(said)) == len(said):
        return tuple(said)
    # An arm on a track is logged without it; a gripper behind an arm is not logged with it.
    count = len(position.columns)
    fits = [names[k : k + count] for k in range(len(names) - count + 1)]
    kinds = {joint.name: joint.kind for joint in arm.moving}
    return tuple(next((f for f in fits if all(kinds[n] == "revolute" for n in f)), fits[0]))


def in_si(
    path: Path,
    position: Channels,
    arm: LooseUrdf,
    names: tuple[str, ...],
    hints: LogHints,
    words: list[str],
) -> tuple[FloatArray, dict[str, Any]]:
    """Joint positions in rad or m, and what the map says of their unit and side."""
    by_name = {joint.name: joint for joint in arm.moving}
    turning = np.array([by_name[name].kind == "revolute" for name in names])
    ends = [by_name[name].position or (-2 * np.pi, 2 * np.pi) for name in names]
    largest = np.array([max(abs(low), abs(high)) for low, high in ends])
    reach = np.abs(position.values).max(axis=0)
    small, large = ("rad", "deg") if turning.any() else ("m", "mm")
    factor = np.where(turning, _DEGREE if large == "deg" else 1.0, 1.0 if large == "deg" else 1e-3)
    marked = {"deg", "degree", "degrees", "grad", "mm"} & set(position.words)
    table: dict[str, Any] = {"unit": small}
    ratio = np.array(hints.ratio)
    if ratio.size not in (0, len(names)):
        raise CaptureError(
            f"--ratio has {ratio.size} numbers; allowed: {len(names)}, one per joint of {path}"
        )
    if (reach > _FAR * largest).any() and ratio.size and not marked:
        words.append("position: at the motors, by the limits of the URDF and the ratio")
        table, scale = {"unit": small, "side": "motor", "ratio": ratio.tolist()}, 1 / ratio
    elif marked or ((reach > _FAR * largest).any() and (reach * factor <= _FAR * largest).all()):
        words.append(
            f"unit of the position: {large}, by {'its name' if marked else 'the limits of the URDF'}"
        )
        table, scale = {"unit": large}, factor
    elif (reach > 2 * _FAR * largest).any():
        joint = int(np.argmax(reach / largest))
        raise CaptureError(
            f"{path}: {position.columns[joint]!r} reaches {reach[joint]:.4g}, in {small} or {large} beyond"
            f" joint {joint + 1}'s limit {largest[joint]:.3g}; at the motor? give --ratio"
        )
    else:
        scale = np.ones(len(names))
        words.append(f"unit of the position: {small}, within the limits of the URDF")
    return position.values * scale, table
