"""Channels that hold a value that they cannot have held: stuck samples are set aside, clipping is said.

A position that stands while its joint moves begins or ends with a step of its speed; no drive makes one
within a sample. A torque is noisy: a value held far longer than any other is no measurement.
"""

from __future__ import annotations

import numpy as np

from ident.listing import seconds
from ident.ordered import median, percentile
from ident.recording import LARGEST
from robots.arrays import BoolArray, FloatArray, IntArray

_SHORTEST = {"position": 5, "control signal": 20}
"""Samples; fewer equal ones cost less than the cut."""
_TIMES_USUAL = 20.0
"""Times what one sample in ten exceeds (of second differences), or the run that one in a hundred exceeds."""
_USUAL_SPEED = 0.5
"""Of the median speed; slower, a joint may be at rest."""
_AT_END = 10
"""Samples at the end of a range, and times those of the values next to it: there it is clipped."""
_STEPS = 20.0
"""Times the smallest step of a joint, by which it moves before and behind a sample that is repeated."""
_FEWEST = 4
"""Samples of which one may be repeated."""
_NEXT = 5
"""Values next to the end of a range."""


def not_held(
    name: str, what: str, time: FloatArray, values: FloatArray, position: FloatArray
) -> tuple[BoolArray, tuple[str, ...]]:
    """Which samples are no stuck ones, and a sentence for each joint that has some.

    Args:
        name: of the recording, for messages.
        what: ``position`` or ``control signal``.
        time: (samples,) s.
        values: samples × joints.
        position: samples × joints; an arm at rest may hold its torque.
    """
    good, words = np.ones(len(values), dtype=np.bool_), list[str]()
    if (np.abs(values) > LARGEST[what]).any():
        return good, ()  # what is beyond any arm is refused by Recording
    for joint, column in enumerate(values.T):
        start, length = _runs(column)
        stuck = (length >= _SHORTEST[what]) & _impossible(what, column, start, length)
        if what != "position":
            stuck &= _moves(position[:, joint], start, length)
        for begin, count in zip(start[stuck], length[stuck], strict=True):
            good[begin + 1 : begin + count] = False
        if stuck.any():
            longest = int(np.argmax(np.where(stuck, length, 0)))
            words.append(
                f"{name}: {what} of joint {joint + 1} is stuck for {length[longest]} samples after"
                f" {seconds(time[start[longest]])} s ({np.count_nonzero(stuck)} times in all), set aside"
            )
    return good, tuple(words)


def repeated(position: FloatArray) -> BoolArray:
    """Which samples are the one before once more, though the arm moves: published again, not measured.

    Every joint stands for one sample, and half of them or more came there and left it by many of the smallest
    steps that they make at all.

    Args:
        position: samples × joints.
    """
    again = np.zeros(len(position), dtype=np.bool_)
    if len(position) < _FEWEST:
        return again
    step = np.abs(np.diff(position, axis=0))
    least = np.array([float(column[column > 0.0].min(initial=np.inf)) for column in step.T])
    moved = step > _STEPS * least
    stands = np.flatnonzero(~step[1:-1].any(axis=1)) + 1
    around = moved[stands - 1] & moved[stands + 1]
    again[stands[np.count_nonzero(around, axis=1) >= position.shape[1] / 2] + 1] = True
    return again


def clipped(name: str, what: str, values: FloatArray) -> tuple[str, ...]:
    """A sentence for each joint whose values end at a limit at which far too many are."""
    words = []
    for joint, column in enumerate(values.T):
        levels, counts = np.unique(column, return_counts=True)
        for end, beside in ((0, counts[1 : 1 + _NEXT]), (-1, counts[-1 - _NEXT : -1])):
            if len(levels) > 2 * _NEXT and counts[end] >= _AT_END * max(1.0, float(np.mean(beside))):
                words.append(
                    f"{name}: {what} of joint {joint + 1} is {levels[end]:.4g} at {counts[end]} samples and"
                    " never beyond: was it clipped?"
                )
    return tuple(words)


def _runs(column: FloatArray) -> tuple[IntArray, IntArray]:
    """Where runs of equal values begin, and how long they are."""
    start = np.concatenate([[0], np.flatnonzero(np.diff(column)) + 1])
    return start, np.diff(np.concatenate([start, [len(column)]]))


def _moves(position: FloatArray, start: IntArray, length: IntArray) -> BoolArray:
    """Whether a joint moves during a run, at half of its usual speed or more."""
    usual = median(np.abs(np.diff(position)))
    travel = np.abs(position[start + length - 1] - position[start])
    return np.asarray(travel > _USUAL_SPEED * usual * length, dtype=np.bool_)


def _impossible(what: str, column: FloatArray, start: IntArray, length: IntArray) -> BoolArray:
    if what != "position":
        inside = (column[start] > column.min()) & (column[start] < column.max())  # at the ends it is clipped
        return np.asarray(inside & (length > _TIMES_USUAL * float(percentile(length, 99.0))), dtype=np.bool_)
    step = np.abs(np.diff(column, prepend=column[0], append=column[-1]))
    usual = float(percentile(np.abs(np.diff(column, 2)), 90.0))
    jump = np.maximum(step[start], step[start + length])  # into the run and out of it
    # Before the first sample and behind the last there is no step to be seen.
    return np.asarray(jump > _TIMES_USUAL * max(usual, np.finfo(float).tiny), dtype=np.bool_)
