"""What is hidden and what is answered, in the words of the search: a name with its place, or nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ident.effects.vocabulary import VOCABULARY
from robots.arrays import FloatArray

WHOLE_ARM = ("payload", "base_tilt", "base_compliance", "time_delay")
"""Effects that can be of the arm as a whole; a delay can be of one drive, too."""
OF_A_DRIVE = (*(one.name for one in VOCABULARY if one.name not in WHOLE_ARM), "time_delay")
"""Effects of a joint or drive; a pair of joints counts as the first of it."""
NAMES = ("clean", *WHOLE_ARM, *OF_A_DRIVE)


@dataclass(frozen=True)
class Hidden:
    """An effect and its joints or drives from 1; none for the whole arm. No effect: ``clean``."""

    effect: str
    axes: tuple[int, ...] = ()


CLEAN = Hidden("clean")


def answers(drives: int) -> tuple[Hidden, ...]:
    """Everything that can be answered about an arm: nothing, the arm's effects, each effect of each drive."""
    placed = [Hidden(name, (drive,)) for drive in range(1, drives + 1) for name in OF_A_DRIVE]
    return (CLEAN, *(Hidden(name) for name in WHOLE_ARM), *placed)


def index_of(hidden: Hidden, drives: int) -> int:
    """Which of :func:`answers` it is.

    Raises:
        ValueError: the vocabulary does not have it.
    """
    return answers(drives).index(Hidden(hidden.effect, hidden.axes[:1]))


def ranked(probability: FloatArray, drives: int, most: int = 5) -> list[tuple[Hidden, float]]:
    """The likeliest answers first, of probabilities in the order of :func:`answers`."""
    every: Sequence[Hidden] = answers(drives)
    return [(every[k], float(probability[k])) for k in np.argsort(-probability, kind="stable")[:most]]
