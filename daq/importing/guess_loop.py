"""Whether a controller alone made a log's torque, or something was added that the log does not name.

A controller of position and speed makes its output of the following error, its integral and derivative, and
of the measured speed: a linear law, which leaves rounding and delays. What it leaves beyond that was added:
a feed-forward. Of logs of controllers without one it leaves 0.2 to 2.7 % (EMPS, twelve logs of a simulated
arm), of a KUKA KR300 with one 18 to 51 %.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from daq.importing.channels import Channels
from daq.importing.guess_which import Sampled
from daq.importing.proof import derivative_of, smooth
from robots.arrays import FloatArray

_ADDED = 0.1
"""Share of the torque's deviation that a linear law leaves, from which on something was added."""
_TAKES = 0.5
"""Times what the law leaves: so little is left where a channel is what was added."""
_ROWS_PER_PERIOD = 4.0
"""Rows per period of the cut-off: closer ones say the same again."""


def loop_words(
    log: Sampled, reference: FloatArray, torque: Channels, others: Sequence[Channels]
) -> list[str]:
    """A sentence where following error and speed do not make the torque; none where they do.

    Args:
        log: positions of the drives.
        reference: samples × n, in the units of the positions.
        torque: what was measured.
        others: channels that are not used; of these a computed torque may be what was added.
    """
    target, logged = log.even(reference), log.even(torque.values[:, log.moving])
    left = _left(log, target, logged)
    if not float(np.median(left)) > _ADDED:
        return []
    words = f"controller: following error and speed leave {_range(left)} of the torque"
    computed = [c for c in others if c.kind == "torque" and "computed" in c.marks]
    computed = [c for c in computed if len(c.columns) == len(torque.columns)]
    tried = [(_left(log, target, logged, log.even(c.values[:, log.moving])), c.label) for c in computed]
    if not tried:
        return [f"{words}: a feed-forward is added that the log does not name?"]
    rest, label = min(tried, key=lambda pair: float(np.median(pair[0])))
    if float(np.median(rest)) < _TAKES * float(np.median(left)):
        return [
            f"{words}, with {label} {_range(rest)}: a feed-forward; name it under [added] of a column map"
        ]
    return [f"{words}: an unknown feed-forward is added; with {label} {_range(rest)} are left"]


def _left(
    log: Sampled, target: FloatArray, logged: FloatArray, added: FloatArray | None = None
) -> FloatArray:
    """(n,) share of the torque's deviation that the law leaves."""
    q, error, torque = (
        smooth(values, log.period, log.cutoff) for values in (log.position, target - log.position, logged)
    )
    more = [] if added is None else [smooth(added, log.period, log.cutoff)]
    parts = [
        error,
        derivative_of(error, log.period),
        np.cumsum(error, axis=0),
        derivative_of(q, log.period),
        np.ones_like(q),
        *more,
    ]
    edge = len(q) // 20
    rows = slice(edge, len(q) - edge, max(1, int(1 / (_ROWS_PER_PERIOD * log.cutoff * log.period))))
    found = []
    for joint in range(q.shape[1]):
        x, y = np.column_stack([part[rows, joint] for part in parts]), torque[rows, joint]
        scale = np.linalg.norm(x, axis=0)
        x = x[:, scale > 0] / scale[scale > 0]
        rest = y - x @ np.linalg.lstsq(x, y, rcond=1e-10)[0]
        found.append(float(np.linalg.norm(rest)) / max(float(np.linalg.norm(y - y.mean())), 1e-300))
    return np.array(found)


def _range(left: FloatArray) -> str:
    low, high = f"{100 * left.min():.2g}", f"{100 * left.max():.2g}"
    return f"{low} %" if low == high else f"{low} to {high} %"
