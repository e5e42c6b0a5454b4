"""A load that is followed late, between samples that are as far apart as its memory is long."""

from __future__ import annotations

import numpy as np

from ident.effects.gear_load import followed


def test_a_ramp_is_followed_exactly_however_far_apart_the_samples_are() -> None:
    """T dy/dt = u − y with u = r·t from rest is y = r·(t − T·(1 − exp(−t/T)))."""
    memory, rate = 0.005, 300.0
    for step in (0.0002, 0.004, 0.02):
        time = np.arange(0.0, 0.2, step)
        exact = rate * (time - memory * (1.0 - np.exp(-time / memory)))
        np.testing.assert_allclose(followed(rate * time, time, memory), exact, atol=1e-9)


def test_a_constant_load_is_there_from_the_beginning() -> None:
    time = np.arange(0.0, 0.1, 0.004)
    np.testing.assert_allclose(followed(np.full(time.size, 7.0), time, 0.005), 7.0)
