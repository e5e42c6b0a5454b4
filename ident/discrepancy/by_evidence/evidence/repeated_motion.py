"""Columns of effects where every period of a motion is the same, as those that were asked for are.

An effect answers each of them alike once it has forgotten how the record began. So it is asked about the
first periods alone, and what it answers in the middle of them is put in as often as the motion repeats: that
long a gear remembers how it began, and its filter not nearly as long.
Measured periods differ by their noise, and effects that change with time answer each period otherwise: those
are asked about the whole, as is all that is cheap.
"""

from __future__ import annotations

import numpy as np

from ident.effects import State
from ident.effects.family import PlacedEffect
from ident.effects.gear_state import FORGOTTEN
from ident.effects.placed import Placed
from robots.arrays import FloatArray

_SAME = 1e-6
"""Of a channel's root mean square: more is noise."""


def shorter(state: State, period: int) -> State | None:
    """The beginning of a motion of which the rest is repetition; None where it is not, or is short.

    Args:
        state: at even samples.
        period: samples.
    """
    time = state.time
    if time is None or not _repeats(state, period):
        return None
    least = period + 2 * int(np.ceil(FORGOTTEN / float(time[1] - time[0])))
    left_out = (time.shape[0] - least) // period
    if left_out < 1:
        return None
    return state.part(slice(0, time.shape[0] - left_out * period))


def is_timeless(effect: PlacedEffect) -> bool:
    """Whether an effect says of itself that its torque is that of the motion, whenever it happens."""
    return isinstance(effect, Placed) and effect.timeless


def lengthened(columns: FloatArray, period: int, rows: int) -> FloatArray:
    """Columns (kept rows, …) of :func:`shorter` with those of the periods that were left out.

    Args:
        columns: of the beginning.
        period: rows.
        rows: of the whole motion.
    """
    middle = (columns.shape[0] - period) // 2
    times = (rows - columns.shape[0]) // period
    return np.concatenate([columns[:middle], *[columns[middle : middle + period]] * times, columns[middle:]])


def _repeats(state: State, period: int) -> bool:
    """Whether every period is the same but for rounding."""
    channels = (state.position, state.velocity, state.acceleration, state.torque)
    return all(
        float(np.abs(one[period:] - one[:-period]).max(initial=0.0))
        <= _SAME * float(np.sqrt(np.mean(one**2)))
        for one in channels
        if one is not None
    )
