"""A long log in parts: the same rows as in one piece, and none that knows of a seam."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from daq.importing import pieces
from daq.importing.pieces import in_parts
from ident import Recording, RegressorModel, base_parameters
from ident.preparation.observation import observe
from ident.signals import filter_memory
from robots import Robot

SAMPLES, RATE, TRIM, PART = 20_003, 1000.0, 50, 6_000


@pytest.fixture
def arm() -> Robot:
    """An axis with rows of a low-pass that remembers for longer than the ends that are given up."""
    emps = robots.load("emps")
    settings = emps.identification.model_copy(
        update={
            "cutoff_hz": 20.0,
            "decimation": 20,
            "decimation_filter": "fir",
            "trim_samples": (TRIM, TRIM),
            "minimum_speed": 0.0,
            "control_signal_lag": 0.0,
        }
    )
    return emps.model_copy(update={"identification": settings})


def recording(arm: Robot) -> Recording:
    """Slow motion without noise or friction: its torque is exactly that of a mass."""
    t = np.arange(SAMPLES) / RATE
    w = 2 * np.pi * np.array([0.31, 0.83, 1.37])
    position = 0.03 * np.sin(np.outer(t, w) + [0.1, 1.2, 2.0]).sum(axis=1, keepdims=True)
    acceleration = -0.03 * (np.sin(np.outer(t, w) + [0.1, 1.2, 2.0]) @ w**2)[:, np.newaxis]
    return Recording("long", t, None, position, arm.control_signal(95.0 * acceleration))


def test_parts_have_the_rows_of_the_whole_and_the_seams_are_not_seen(
    arm: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, settings = recording(arm), arm.identification
    monkeypatch.setattr(pieces, "_LONGEST_PART", PART)
    parts = in_parts(whole, settings)
    memory = filter_memory(settings, 1 / RATE)
    assert memory > 4 * TRIM
    assert [part.lent for part in parts] == [(0, memory), (memory, memory), (memory, memory), (memory, 0)]

    base = base_parameters(RegressorModel.of(arm))
    one, some = (observe(base, recordings, settings) for recordings in ((whole,), parts))
    np.testing.assert_allclose(some.time, one.time, atol=1e-9)
    mass = one.regressor[:, 0, base.names.index("M1R")]
    values = np.zeros(len(base.names))
    values[base.names.index("M1R")] = one.torque[:, 0] @ mass / (mass @ mass)
    inner = slice(30, -30)  # at the outer ends the trim decides
    off = np.abs(some.torque - some.predicted(values))[inner, 0]
    assert off.max() < 1e-3 * np.abs(one.torque).max()
    assert off.max() < 1.5 * np.abs(one.torque - one.predicted(values))[inner, 0].max()


def test_a_short_log_is_left_as_it_is(arm: Robot) -> None:
    whole = recording(arm)
    assert in_parts(whole, arm.identification) == (whole,)
