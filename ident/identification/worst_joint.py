"""The joint of which a model leaves most, and what the rest goes with: where a search has to look.

All on the rows of the fit, as the error per joint is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ident.ordered import distinct
from ident.preparation.observation import Rows
from ident.recording import Recording
from ident.results import Estimate, WorstJoint
from ident.statistics.correlation_ratio import correlation_ratio
from robots.arrays import FloatArray

_BINS = 24
_PARTS = 4
"""Of a record, for a drift: in shorter ones all that lasts, such as a slow motion, goes with time."""
_CHANCE = 0.1
"""Share of what is left that goes with a quantity, below which none is named: the best of many."""


def worst_joint_of(estimate: Estimate, rows: Rows, recordings: Sequence[Recording]) -> WorstJoint | None:
    """The joint of the largest relative error; None where no joint has one.

    Args:
        estimate: of the parameters.
        rows: that it was fitted to.
        recordings: which the rows were made of.
    """
    errors = estimate.relative_error_percent_per_joint
    if not np.isfinite(errors).any():
        return None
    joint = int(np.nanargmax(errors))
    used = rows.used[:, joint]
    predicted = rows.predicted(estimate.values)
    left = (rows.torque - predicted)[used, joint]
    position = _at_rows(rows, recordings)
    speed = np.concatenate([np.gradient(position[k], rows.time[k], axis=0) for k in _segments(rows)])
    acceleration = np.concatenate([np.gradient(speed[k], rows.time[k], axis=0) for k in _segments(rows)])
    quantities = {
        "position": position[:, joint],
        "speed": speed[:, joint],
        "acceleration": acceleration[:, joint],
        "torque": predicted[:, joint],
        "time": rows.time,
    }
    others = [k for k in range(rows.joints) if k != joint]
    tried: list[tuple[str, int | None, FloatArray]]
    tried = [(name, None, values) for name, values in quantities.items()]
    tried += [("speed", k, speed[:, k]) for k in others]
    shares = [
        (correlation_ratio(values[used], left, _PARTS if name == "time" else _BINS), name, of)
        for name, of, values in tried
    ]
    share, name, of = max(shares, key=lambda found: found[0])
    percent = float(errors[joint])
    return WorstJoint(joint, percent, name, of, share) if share >= _CHANCE else WorstJoint(joint, percent)


def _segments(rows: Rows) -> list[NDArray[np.intp]]:
    """The rows of each recording."""
    return [np.flatnonzero(rows.segment == k) for k in distinct(rows.segment)]


def _at_rows(rows: Rows, recordings: Sequence[Recording]) -> FloatArray:
    """Positions at the times of the rows, samples × joints."""
    found = np.empty(rows.torque.shape)
    for number in distinct(rows.segment):
        own, recording = rows.segment == number, recordings[number]
        for joint, positions in enumerate(recording.position.T):
            found[own, joint] = np.interp(rows.time[own], recording.time, positions)
    return found
