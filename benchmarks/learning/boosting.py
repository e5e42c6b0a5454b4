"""Gradient boosting on features, drive by drive, and one probability for the whole arm of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from benchmarks.learning.drawn import Drawn, turned
from benchmarks.learning.features import features
from benchmarks.learning.labels import OF_A_DRIVE, WHOLE_ARM
from benchmarks.learning.scoring import softmax
from robots.arrays import FloatArray, IntArray

SETTINGS = {"learning_rate": 0.1, "max_iter": 80, "max_leaf_nodes": 15, "l2_regularization": 1.0}
"""Usual figures; none was searched for."""


@dataclass(frozen=True)
class Boosting:
    """A classifier of drives and four figures that join them: see :func:`joined`."""

    classifier: Any
    figures: FloatArray

    def scores(self, windows: FloatArray, context: FloatArray) -> FloatArray:
        """Logarithms of probabilities, windows × answers, of windows × rows × n × channels."""
        logs = np.stack([self._drives(features(one, context)) for one in windows])
        return np.log(softmax(joined(logs, self.figures)) + 1e-12)

    def _drives(self, rows: FloatArray) -> FloatArray:
        return log_of(self.classifier, rows)


def log_of(classifier: Any, rows: FloatArray) -> FloatArray:
    """log p of every class, of classes that no draw had too: n × classes."""
    found = np.full((len(rows), classes()), -12.0)
    found[:, classifier.classes_] = np.log(classifier.predict_proba(rows) + 1e-6)
    return found


def classes() -> int:
    """Nothing here, the arm's effects, a drive's effects."""
    return 1 + len(WHOLE_ARM) + len(OF_A_DRIVE)


def joined(logs: FloatArray, figures: FloatArray) -> FloatArray:
    """Scores of all answers of logs p of drives, … × n × classes.

    With at most one effect hidden the odds of it are those of its drive; those of an effect of the whole arm
    are the drives' mean. The figures: score of clean, weight of odds of a drive, weight and score of the
    whole arm's.
    """
    odds = logs[..., 1:] - logs[..., :1]
    whole = figures[2] * odds[..., : len(WHOLE_ARM)].mean(axis=-2) + figures[3]
    placed = figures[1] * odds[..., len(WHOLE_ARM) :]
    clean = np.full((*logs.shape[:-2], 1), figures[0])
    return np.concatenate([clean, whole, placed.reshape(*logs.shape[:-2], -1)], axis=-1)


def labels_of_drives(answer: IntArray, drives: int) -> IntArray:
    """Class of each drive, D × n, of the index of an arm's answer (D,)."""
    found = np.zeros((len(answer), drives), dtype=np.int64)
    arm = (answer >= 1) & (answer <= len(WHOLE_ARM))
    found[arm] = answer[arm, np.newaxis]
    one = np.flatnonzero(answer > len(WHOLE_ARM))
    place, effect = np.divmod(answer[one] - 1 - len(WHOLE_ARM), len(OF_A_DRIVE))
    found[one, place] = 1 + len(WHOLE_ARM) + effect
    return found


def learn(drawn: Drawn, seed: int = 0) -> Boosting:
    """Learn from the draws; the held-out worlds say how drives are joined."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    rng = np.random.default_rng(seed)
    fit, held = drawn.part(False), drawn.part(True)
    x, held_x = table_of(fit, rng), table_of(held, rng)
    drives = x.shape[1]
    y = labels_of_drives(fit.answer, drives)
    classifier = HistGradientBoostingClassifier(random_state=seed, **SETTINGS)
    classifier.fit(x.reshape(-1, x.shape[2]), y.ravel())
    logs = log_of(classifier, held_x.reshape(-1, x.shape[2])).reshape(len(held_x), drives, -1)
    return Boosting(classifier, joining(logs, held.answer))


def table_of(drawn: Drawn, rng: np.random.Generator) -> FloatArray:
    """Features of every draw, D × n × features, signs of drives drawn anew."""
    windows = zip(drawn.window, drawn.context, strict=True)
    return np.stack([features(turned(w.astype(np.float32), rng), c) for w, c in windows])


def joining(logs: FloatArray, answer: IntArray) -> FloatArray:
    """The figures that make the held-out draws likeliest."""

    def lost(figures: FloatArray) -> float:
        chosen = softmax(joined(logs, figures))[np.arange(len(answer)), answer]
        return -float(np.mean(np.log(chosen + 1e-12)))

    return np.asarray(minimize(lost, np.array([0.0, 1.0, 2.0, 0.0]), method="Nelder-Mead").x)
