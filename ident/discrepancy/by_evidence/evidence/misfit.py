"""The misfit Φ w of a joint: what every real arm has and no vocabulary names (Kennedy and O'Hagan 2001).

Φ is a modest smooth basis over speed, position, acceleration, load and direction of motion of the joint, the
motion of the others, and time. Splines overlap: those over speed, position and load each sum up to the
direction of motion, so with one variance per column friction itself would be the likeliest misfit of all, and
nothing could be named on an arm whose rows are few. The columns are therefore turned into orthonormal
directions over the rows, and w ~ N(0, κ²/m) gives each of the m directions the same share: κ is the root mean
square of the misfit in N·m (or N), and none of its courses is likelier than another.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import BSpline

from ident.effects import FrictionSign, State
from ident.statistics.symmetric import eigen_of
from robots.arrays import BoolArray, FloatArray

_DEGREE = 3
_SPLINES = (8, 8, 6, 6, 6, 6, 5, 5, 4)
"""Over speed, position, acceleration, load; direction times three of these; speed times two."""

_INNER = (0.005, 0.995)
"""Quantiles between which the knots lie; rows beyond take the value at the end."""

_WAVES = (1, 2, 3)
"""Half waves over the recordings: what changes in time without a cause that is known."""

_SHARED = 0.1
"""Of a column's mean square: a direction with less is a difference of columns that are nearly the same."""

_NOTHING = 1e-9


def joined(states: Sequence[State]) -> State:
    """Motions one after the other."""
    position, velocity, acceleration, time = (
        np.concatenate([getattr(state, name) for state in states])
        for name in ("position", "velocity", "acceleration", "time")
    )
    return State(position, velocity, acceleration, time)


def misfit_columns(
    joint: int, state: State, load: FloatArray, used: BoolArray, sign: FrictionSign
) -> FloatArray:
    """Φ of a joint, rows × m; orthonormal over the rows used, with a root mean square of one.

    Args:
        joint: from 0.
        state: motion at the rows.
        load: (rows,) torque of the links on the joint, N·m (or N).
        used: (rows,) which rows count.
        sign: the arm's form of a friction's sign.
    """
    position, speed = state.position[:, joint], state.velocity[:, joint]
    direction = sign(speed)
    turned, moved = direction[:, np.newaxis], speed[:, np.newaxis]
    fast, heavy = np.abs(speed), np.abs(load)
    of = (speed, position, state.acceleration[:, joint], load, fast, position, heavy, position, heavy)
    splines = [_splines(values, count, used) for values, count in zip(of, _SPLINES, strict=True)]
    parts = [
        *splines[:4],
        *(turned * one for one in splines[4:7]),
        *(moved * one for one in splines[7:]),
        *_of_others(joint, state, sign),
        _of_time(state),
    ]
    columns = np.concatenate(parts, axis=1)
    if not used.any():
        return np.zeros((columns.shape[0], 0))
    columns = columns - columns[used].mean(axis=0)
    size = np.sqrt(np.mean(columns[used] ** 2, axis=0))
    there = size > _NOTHING
    return _directions(columns[:, there] / size[there], used)


def _directions(columns: FloatArray, used: BoolArray) -> FloatArray:
    """Rows × m: principal directions of unit columns (rows, k), each of unit root mean square."""
    inside = columns[used]
    shares, vectors = eigen_of(inside.T @ inside / inside.shape[0])
    kept = shares > _SHARED
    return np.asarray(columns @ (vectors[:, kept] / np.sqrt(shares[kept])))


def _of_others(joint: int, state: State, sign: FrictionSign) -> list[FloatArray]:
    """Speeds, accelerations and directions of the other joints."""
    others = [k for k in range(state.velocity.shape[1]) if k != joint]
    return [state.velocity[:, others], state.acceleration[:, others], sign(state.velocity[:, others])]


def _of_time(state: State) -> FloatArray:
    assert state.time is not None
    share = (state.time - state.time[0]) / (state.time[-1] - state.time[0])
    waves = [wave(np.pi * k * share) for k in _WAVES for wave in (np.sin, np.cos)]
    return np.stack(waves, axis=1)


def _splines(values: FloatArray, count: int, used: BoolArray) -> FloatArray:
    """Cubic B-splines over the range of values (rows,): rows × count."""
    low, high = np.quantile(values[used] if used.any() else values, _INNER)
    if high - low <= _NOTHING * max(abs(low), abs(high), _NOTHING):
        return np.zeros((values.shape[0], 0))
    share = np.clip((values - low) / (high - low), 0.0, 1.0 - 1e-9)
    inner = np.linspace(0.0, 1.0, count - _DEGREE + 1)
    knots = np.concatenate([np.zeros(_DEGREE), inner, np.ones(_DEGREE)])
    return np.asarray(BSpline.design_matrix(share, knots, _DEGREE).toarray())
