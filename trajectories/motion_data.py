"""A motion as plain numbers and back, exactly, for a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from robots.arrays import FloatArray
from trajectories.errors import TrajectoryError
from trajectories.motions.fourier import FourierMotion
from trajectories.motions.motion import Motion, MotionSequence, StretchedMotion
from trajectories.motions.sampled import SampledMotion
from trajectories.motions.segments import PiecewiseJerk
from trajectories.trajectory import stretched

_PIECES = ("start", "position", "velocity", "acceleration", "jerk")

LARGEST = 1e12
"""No figure of a motion in a file is larger, in any unit."""
LONGEST = 1e6
"""s; and the most periods."""

JUMP = 1e-6
"""Largest jump between two pieces that is rounding, in rad (m) and their derivatives."""


def motion_data(motion: Motion) -> dict[str, Any]:
    """A motion as numbers, lists and texts.

    Raises:
        TrajectoryError: a kind of motion that has no such form.
    """
    if isinstance(motion, SampledMotion):
        return motion_data(motion.spline)
    if isinstance(motion, PiecewiseJerk):
        arrays = {name: getattr(motion, name).tolist() for name in _PIECES}
        return {"kind": "jerk", "duration": motion.duration, **arrays}
    if isinstance(motion, FourierMotion):
        return {
            "kind": "fourier",
            "period": motion.period,
            "periods": motion.periods,
            "begin": motion.begin,
            "offset": motion.offset.tolist(),
            "sine": motion.sine.tolist(),
            "cosine": motion.cosine.tolist(),
        }
    if isinstance(motion, StretchedMotion):
        return {"kind": "stretched", "factor": motion.factor, "motion": motion_data(motion.motion)}
    if isinstance(motion, MotionSequence):
        distinct = motion.distinct
        order = [next(k for k, known in enumerate(distinct) if known is part) for part in motion.parts]
        return {"kind": "sequence", "parts": [motion_data(part) for part in distinct], "order": order}
    raise TrajectoryError(f"a {type(motion).__name__} has no form in a file", constraint="file")


def motion_of(data: Mapping[str, Any], joints: int) -> Motion:
    """The inverse of :func:`motion_data`, checked: shapes, finite numbers, no jumps.

    Raises:
        TrajectoryError: the data are no motion of so many joints; names the joint and time of a jump.
    """
    try:
        motion = _motion_of(data, joints)
    except (KeyError, TypeError, IndexError, ValueError) as error:
        if isinstance(error, TrajectoryError):
            raise
        raise TrajectoryError(f"not a motion: {type(error).__name__} {error}", constraint="file") from error
    _require_continuous(motion)
    return motion


def _motion_of(data: Mapping[str, Any], joints: int) -> Motion:
    kind = data["kind"]
    if kind == "jerk":
        arrays = {name: _array(data[name], name, joints) for name in _PIECES}
        if len({array.shape for array in arrays.values()}) > 1:
            raise TrajectoryError("the phases of a jerk motion differ in number", constraint="file")
        if (np.diff(arrays["start"], axis=1) < 0.0).any():
            raise TrajectoryError("the phases of a jerk motion are not in order", constraint="file")
        return PiecewiseJerk(_positive(data["duration"], "duration"), **arrays)
    if kind == "fourier":
        sine, cosine = (_array(np.transpose(data[name]), name, joints).T for name in ("sine", "cosine"))
        offset = _array([[value] for value in data["offset"]], "offset", joints)[:, 0]
        period, periods = _positive(data["period"], "period"), int(_positive(data["periods"], "periods"))
        return FourierMotion(period, periods, offset, sine, cosine, float(data["begin"]))
    if kind == "stretched":
        return stretched(_motion_of(data["motion"], joints), float(data["factor"]))
    if kind == "sequence":
        parts = [_motion_of(part, joints) for part in data["parts"]]
        return MotionSequence(tuple(parts[k] for k in data["order"]))
    raise TrajectoryError(
        f"motion of kind {kind!r}; allowed: jerk, fourier, stretched, sequence", constraint="file"
    )


def _array(values: Any, name: str, joints: int) -> FloatArray:
    array = np.asarray(values, dtype=np.float64)
    fits = array.ndim == 2 and array.shape[0] == joints and array.shape[1] > 0
    if not fits or not (np.abs(array) <= LARGEST).all():
        raise TrajectoryError(
            f"{name} of a motion has shape {array.shape}; allowed: {joints} joints × numbers, to {LARGEST:g}",
            constraint="file",
        )
    return array


def _positive(value: Any, name: str) -> float:
    number = float(value)
    if not 1e-9 <= number <= LONGEST:
        raise TrajectoryError(
            f"{name} of a motion is {number:g}; allowed: above 0, up to {LONGEST:g}", constraint="file"
        )
    return number


def _require_continuous(motion: Motion) -> None:
    """Raise where position, velocity or acceleration jump between two pieces."""
    breaks = motion.breaks()
    inner = breaks[1:-1]
    if inner.size == 0:
        return
    room = np.minimum(1e-9, np.diff(breaks).min() / 4)
    before, after = motion.at(inner - room), motion.at(inner + room)
    for name, derivative in (
        ("position", "velocity"),
        ("velocity", "acceleration"),
        ("acceleration", "jerk"),
    ):
        slope = np.maximum(np.abs(getattr(before, derivative)), np.abs(getattr(after, derivative)))
        jump = np.abs(getattr(after, name) - getattr(before, name)) - 4.0 * room * slope
        worst = np.unravel_index(int(jump.argmax()), jump.shape)
        if jump[worst] > JUMP * (1.0 + np.abs(getattr(before, name)[worst])):
            raise TrajectoryError(
                f"{name} of joint {worst[1] + 1} jumps by {jump[worst]:.3g}",
                constraint="continuity",
                time=float(inner[worst[0]]),
            )
