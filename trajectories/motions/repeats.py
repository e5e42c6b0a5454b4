"""What a motion repeats: looked at once where that says all, and counted where it does not."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

from trajectories.motions.fourier import FourierMotion
from trajectories.motions.motion import Motion, MotionSequence, StretchedMotion


def pieces(motion: Motion) -> tuple[tuple[float, Motion], ...]:
    """The distinct pieces of a motion, each with when it first begins, s.

    Whatever a motion does at an instant one of them does; a motion of a hundred periods has one.
    """
    if isinstance(motion, StretchedMotion):
        inner = pieces(motion.motion)
        return tuple((s / motion.factor, StretchedMotion(part, motion.factor)) for s, part in inner)
    if isinstance(motion, FourierMotion):
        return ((0.0, replace(motion, periods=1)),)
    if isinstance(motion, MotionSequence):
        starts = motion.starts
        first = {id(part): float(starts[k]) for k, part in reversed(list(enumerate(motion.parts)))}
        return tuple(
            (first[id(part)] + start, piece) for part in motion.distinct for start, piece in pieces(part)
        )
    return ((0.0, motion),)


def at_most(motion: Motion, periods: int) -> Motion:
    """The motion with no more than so many periods of what it repeats one after the other."""
    if isinstance(motion, StretchedMotion):
        return StretchedMotion(at_most(motion.motion, periods), motion.factor)
    if isinstance(motion, FourierMotion):
        return replace(motion, periods=min(motion.periods, periods))
    if isinstance(motion, MotionSequence):
        runs = [list(run) for _, run in groupby(motion.parts, key=id)]
        return MotionSequence(tuple(at_most(part, periods) for run in runs for part in run[:periods]))
    return motion
