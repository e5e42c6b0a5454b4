"""What learners' probabilities come to: one answer of several windows, and its calibration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.learning.labels import CLEAN, ranked
from robots.arrays import FloatArray, IntArray

NAMED = 0.9
"""Probability from which a name is one, as the search has it."""


def softmax(scores: FloatArray) -> FloatArray:
    """Probabilities of scores over the last axis."""
    grown = np.exp(scores - scores.max(axis=-1, keepdims=True))
    return np.asarray(grown / grown.sum(axis=-1, keepdims=True))


def together(scores: FloatArray, sharpness: float) -> FloatArray:
    """Probabilities of a log, (answers,), from logarithms of its windows', windows × answers.

    The mean of the logarithms, ``sharpness`` times: 1 would make no more of many windows than of one.
    """
    return softmax(sharpness * scores.mean(axis=0))


def sharpest(windows: Sequence[FloatArray], true: Sequence[int]) -> float:
    """The sharpness that makes the truth of some logs likeliest."""
    grid = np.geomspace(0.2, 12.0, 60)
    lost = [-sum(np.log(together(w, k)[t] + 1e-12) for w, t in zip(windows, true, strict=True)) for k in grid]
    return float(grid[int(np.argmin(lost))])


def answer_of(probability: FloatArray, drives: int) -> dict[str, Any]:
    """As :mod:`benchmarks.evidence.asked` writes it: the likeliest name, unless nothing is likelier."""
    first = ranked(probability, drives, 12)
    clean = dict(first).get(CLEAN, 0.0)
    names = [one for one in first if one[0] != CLEAN]
    held, total = [], 0.0
    for hidden, p in first:
        if total >= 0.95:
            break
        held.append([hidden.effect, list(hidden.axes), p])
        total += p
    hidden, p = names[0]
    found = {
        "name": hidden.effect,
        "joints": list(hidden.axes),
        "probability": p,
        "named": p >= NAMED,
        "set": held,
    }
    silent = first[0][0] == CLEAN
    verdict = "clean" if silent else "named" if p >= NAMED else "ambiguous"
    ranking = [[one.effect, list(one.axes), q] for one, q in first[:5]]
    return {
        "verdict": verdict,
        "names": [] if silent else [found],
        "probability_clean": clean,
        "ranking": ranking,
        "processor_seconds": 0.0,
    }


def calibration_error(probability: FloatArray, right: FloatArray, bins: int = 10) -> float:
    """Expected calibration error of probabilities (N,) of answers, with whether they are right."""
    place: IntArray = np.minimum((bins * np.asarray(probability)).astype(np.int64), bins - 1)
    gaps = [abs(float(np.sum((probability - right)[place == b]))) for b in range(bins)]
    return sum(gaps) / max(len(probability), 1)
