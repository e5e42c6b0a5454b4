"""The noise of a record in which nothing repeats, where a joint stands still."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from ident.discrepancy.unrepeating_noise import noise_beyond_vocabulary
from ident.statistics.whitening import Whitening


def test_joints_that_stand_still_and_an_empty_vocabulary_leave_the_residual_as_noise() -> None:
    generator = np.random.default_rng(3)
    residual = 2.0 * generator.normal(size=400)
    used = np.zeros((400, 2), dtype=np.bool_)
    used[:, 0] = True
    whitening = Whitening("block", (np.empty(0), np.empty(0)), np.array([0.5, 0.7]))
    examination: Any = SimpleNamespace(residual=residual, used=used, whitening=whitening)
    library: Any = SimpleNamespace(
        trials=(), score=np.empty(0), gram=np.empty((0, 0)), columns=np.empty((400, 0))
    )
    found = noise_beyond_vocabulary(examination, library)
    assert 0.9 < found.sigma[0] < 1.2  # 0.5 times a deviation of 2
    assert found.sigma[1] == 0.7
