"""What a learner has right of the worlds that it did not learn from."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.learning.drawn import Drawn
from benchmarks.learning.rows import RESIDUAL
from benchmarks.learning.scoring import calibration_error, softmax
from robots.arrays import BoolArray, FloatArray

LOUD = 3.0
"""Noise floors of the residual of one drive from which an effect is plain."""


def told(learner: Any, held: Drawn) -> str:
    """Shares of held-out draws that are right, and the calibration error of the likeliest answer.

    Args:
        learner: with ``scores`` of windows and a context.
        held: the held-out draws.
    """
    windows: Any = held.window.astype(np.float32)
    scores = [
        learner.scores(w[np.newaxis], context)[0] for w, context in zip(windows, held.context, strict=True)
    ]
    probability = softmax(np.stack(scores))
    right = probability.argmax(axis=1) == held.answer
    changed = held.answer != 0
    parts = {"all": np.ones_like(changed), "changed": changed, "plain": changed & (loudness(windows) >= LOUD)}
    shares = [f"{name} {_share(right[kept])}" for name, kept in parts.items()]
    error = calibration_error(probability.max(axis=1), right.astype(float))
    return f"right of {', of '.join(shares)}; calibration error {error:.3f}"


def loudness(windows: FloatArray) -> FloatArray:
    """Largest rms of the residual where a drive moves, noise floors, (D,), of D × rows × n × channels."""
    return np.asarray(np.sqrt(np.mean(np.square(windows[..., RESIDUAL]), axis=1)).max(axis=1))


def _share(right: BoolArray) -> str:
    return f"{100 * float(np.mean(right)) if len(right) else 0.0:.1f} % of {len(right)}"
