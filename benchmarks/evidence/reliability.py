"""The reliability diagram: how often a name was right, against the probability that it said."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.evidence.scores import calibration_error, findings_of
from benchmarks.trust_pictures import Axis, drawing, frame, mark, straight, wilson, written
from robots.arrays import FloatArray

PLANTS = {"own": "own bench", "foreign": "foreign plant"}


def picture(lines: Sequence[dict[str, Any]]) -> str:
    """One point per tenth of what is said, with its 95 % interval (Wilson), for each plant.

    Args:
        lines: answers, as :mod:`benchmarks.evidence` writes them.
    """
    ticks = tuple((k / 5, f"{k / 5:g}") for k in range(6))
    across, up = Axis(0.0, 1.0, 70, 390, ticks), Axis(0.0, 1.0, 400, 80, ticks)
    body = [
        written(70, 24, "Right names against the probability said", "head"),
        written(70, 44, "tenths of what is said; 95 % intervals; numbers of names", "small"),
        *frame(across, up, "probability that the name says"),
        straight("line thin dash c3", across(0.0), up(0.0), across(1.0), up(1.0)),
    ]
    for place, (kind, title) in enumerate(PLANTS.items()):
        said, right = said_and_right([one for one in lines if one["kind"] == kind])
        y, error = 90 + 60 * place, f"{calibration_error(said, right):.2f}" if said.size else "–"
        body += [
            mark(420, y, f"c{place}", place),
            written(432, y + 4, title),
            written(432, y + 22, f"{said.size} names, error {error}", "small"),
        ]
        for bin_said, hits, count in tenths(said, right):
            x = across(bin_said) + 4 * (2 * place - 1)
            low, high = wilson(hits, count)
            body += [
                straight(f"line thin c{place}", x, up(low), x, up(high)),
                mark(x, up(hits / count), f"c{place}", place),
                written(x + 6, up(hits / count) + (14 if place else -6), str(count), "small"),
            ]
    return drawing(580, 452, "How often a name was right, by the probability that it said", body)


def said_and_right(lines: Sequence[dict[str, Any]]) -> tuple[FloatArray, FloatArray]:
    """(N,) probabilities of names that were shown, and 1 where the name was hidden."""
    found = [one for line in lines for one in findings_of(line)]
    return (
        np.array([one.probability for one in found], dtype=np.float64),
        np.array([one.right for one in found], dtype=np.float64),
    )


def tenths(said: FloatArray, right: FloatArray) -> list[tuple[float, int, int]]:
    """Per tenth with any name: the mean of what is said, right names, names."""
    bins = np.minimum((10 * said).astype(int), 9)
    return [
        (float(said[bins == one].mean()), int(right[bins == one].sum()), int((bins == one).sum()))
        for one in np.unique(bins)
    ]
