"""The cheap draws on disk, and the sign conventions that a learner must not see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.learning.labels import CLEAN, Hidden, index_of
from benchmarks.learning.rows import CHANNELS
from robots.arrays import FloatArray, IntArray

HELD_OUT = 10
"""One world of so many is not learned from: it stops the learning and sets the sharpness."""
_SIGNED = tuple(number for number, name in enumerate(CHANNELS) if name != "fast residual")


@dataclass(frozen=True)
class Drawn:
    """Draws: windows D × rows × n × channels, contexts D × n × figures, answer's index and world (D,)."""

    window: FloatArray
    context: FloatArray
    answer: IntArray
    world: IntArray

    def part(self, held_out: bool) -> Drawn:
        """Draws of the worlds that are learned from, or of the others."""
        kept = (self.world % HELD_OUT == 0) == held_out
        return Drawn(self.window[kept], self.context[kept], self.answer[kept], self.world[kept])

    def one_in(self, parts: int) -> Drawn:
        """Every held-out draw, and of the worlds that are learned from one in so many."""
        kept = (self.world % HELD_OUT == 0) | (self.world % parts == 1)
        return Drawn(self.window[kept], self.context[kept], self.answer[kept], self.world[kept])


def load(folder: Path) -> Drawn:
    """Every world of a folder.

    Raises:
        FileNotFoundError: there is none.
    """
    files = sorted(path for path in folder.glob("world-*.npz") if ".part" not in path.name)
    if not files:
        raise FileNotFoundError(f"{folder}: no draws; make some with: python -m benchmarks.learners draw")
    window, context, answer, world = [], [], [], []
    for path in files:
        with np.load(path) as file:
            count, drives = len(file["window"]), file["window"].shape[2]
            window.append(file["window"])
            context.append(np.repeat(file["context"][np.newaxis], count, axis=0))
            answer.append(_answers(file["effect"], file["axis"], drives))
            world.append(np.full(count, int(path.stem.split("-")[1])))
    parts = (np.concatenate(one) for one in (window, context, answer, world))
    return Drawn(*parts)


def _answers(effects: Sequence[str], axes: Sequence[int], drives: int) -> IntArray:
    hidden = [
        CLEAN if effect == "clean" else Hidden(str(effect), (int(axis),) if axis else ())
        for effect, axis in zip(effects, axes, strict=True)
    ]
    return np.array([index_of(one, drives) for one in hidden])


def turned(window: FloatArray, rng: np.random.Generator) -> FloatArray:
    """The same with drives that count the other way, each by a coin: what is hidden stays.

    Args:
        window: … × n × channels.
    """
    signs = np.ones((*window.shape[:-3], 1, *window.shape[-2:]), dtype=window.dtype)
    signs[..., _SIGNED] = rng.choice((-1.0, 1.0), size=(*signs.shape[:-1], 1))
    return window * signs
