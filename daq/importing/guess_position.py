"""Which joints the position columns of a log belong to, in which unit, and at which side of the gears."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from daq.importing.channels import Channels
from daq.importing.guess_torque import LogHints
from daq.importing.log_quantities import DEGREE, POSITION_UNITS, unit_of
from daq.recording.errors import CaptureError
from ident.listing import listed, short
from robots.arrays import BoolArray, FloatArray
from robots.loose_urdf import LooseUrdf

_FAR = 1.5
"""Times a joint's largest limit."""


_BY_LIMITS = "the limits of the URDF; if these are angles of the motors, give --ratio, a number each for"
_DEGREES = frozenset({"deg", "degree", "degrees", "grad"})
_MILLIMETRES = frozenset({"mm"})


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


def counts_of_joints(arm: LooseUrdf) -> list[int]:
    """All joints of the arm, or those before a gripper or behind a track."""
    kinds = [joint.kind for joint in arm.moving]
    ends = [0, *(k + 1 for k, (a, b) in enumerate(pairwise(kinds)) if a != b), len(kinds)]
    runs = [end - begin for begin, end in pairwise(ends)]
    return list(dict.fromkeys([len(kinds), *(run for run in sorted(runs, reverse=True) if run > 1)]))


def in_si(
    path: Path,
    position: Channels,
    arm: LooseUrdf,
    names: tuple[str, ...],
    hints: LogHints,
    words: list[str],
) -> tuple[FloatArray, dict[str, Any], FloatArray]:
    """Joint positions in rad or m, what the map says of their unit and side, and (n,) SI per unit.

    Joints that turn are in rad or in deg, those that slide in m or in mm; each by its own limits.
    """
    by_name = {joint.name: joint for joint in arm.moving}
    turning = np.array([by_name[name].kind == "revolute" for name in names])
    ends = [by_name[name].position or (-2 * np.pi, 2 * np.pi) for name in names]
    largest = np.array([max(abs(low), abs(high)) for low, high in ends])
    reach = np.abs(position.values).max(axis=0)
    ratio = np.array(hints.ratio)
    if ratio.size not in (0, len(names)):
        raise CaptureError(
            f"--ratio has {ratio.size} numbers; allowed: {len(names)}, one per joint of {path}"
        )
    kinds = [
        _unit(position, mask, reach / largest, scale, marks)
        for mask, scale, marks in ((turning, DEGREE, _DEGREES), (~turning, 1e-3, _MILLIMETRES))
    ]
    marked = any(kind == "name" for kind in kinds)
    if (reach > _FAR * largest).any() and ratio.size and not marked:
        words.append("position: at the motors, by the limits of the URDF and the ratio")
        table: dict[str, Any] = {"unit": unit_of(turning, False, False)}
        return position.values / ratio, table | {"side": "motor", "ratio": ratio.tolist()}, 1 / ratio
    unit = unit_of(turning, bool(kinds[0]), bool(kinds[1]))
    scale = np.where(turning, *POSITION_UNITS[unit])
    off = reach * scale / largest
    if not marked and (off > 2 * _FAR).any():
        joint = int(np.argmax(off))
        tried = "rad or deg" if turning[joint] else "m or mm"
        raise CaptureError(
            f"{path}: {short(position.columns[joint])!r} reaches {reach[joint]:.4g}, in {tried} beyond"
            f" joint {joint + 1}'s limit {largest[joint]:.3g}; at the motor? give --ratio,"
            f" {len(names)} numbers"
        )
    if any(kinds):
        proof = "its name" if marked else f"{_BY_LIMITS} {listed(names)}"
        words.append(f"unit of the position: {unit}, by {proof}")
    else:
        said = "rad and m" if turning.any() and not turning.all() else unit
        words.append(f"unit of the position: {said}, within the limits of the URDF")
    return position.values * scale, {"unit": unit}, scale


def _unit(position: Channels, mask: BoolArray, off: FloatArray, scale: float, marks: frozenset[str]) -> str:
    """Why some joints are in the small unit (deg, mm); empty where they are not.

    Args:
        position: the channel.
        mask: (n,) the joints.
        off: (n,) how far they reach in the unit of the log, per limit.
        scale: of the small unit.
        marks: names that say it.
    """
    if not mask.any():
        return ""
    if marks & set(position.words):
        return "name"
    far = (off[mask] > _FAR).any() and (off[mask] * scale <= _FAR).all()
    return "limits" if far else ""
