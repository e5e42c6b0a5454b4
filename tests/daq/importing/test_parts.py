"""A long log in parts: the same rows as in one piece, and none that knows of a seam."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from daq.importing import pieces
from daq.importing.pieces import in_parts
from ident import Recording, RegressorModel, base_parameters, identify
from ident.preparation.observation import observe
from ident.signals import filter_memory, lendable
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
    tones = 0.03 * np.sin(np.outer(t, w) + np.array([0.1, 1.2, 2.0]))
    position, acceleration = tones.sum(axis=1, keepdims=True), (-tones @ w**2)[:, np.newaxis]
    return Recording("long", t, None, position, arm.control_signal(95.0 * acceleration))


@pytest.mark.parametrize(("kind", "beside"), [("fir", 4), ("chebyshev", 30)])
def test_parts_have_the_rows_of_the_whole(
    arm: Robot, monkeypatch: pytest.MonkeyPatch, kind: str, beside: int
) -> None:
    settings = arm.identification.model_copy(update={"decimation_filter": kind})
    arm = arm.model_copy(update={"identification": settings})
    whole = recording(arm)
    monkeypatch.setattr(pieces, "_LONGEST_PART", PART)
    parts = in_parts(whole, settings)
    memory = filter_memory(settings, 1 / RATE)
    lent = lendable(settings, 1 / RATE)
    assert memory > 4 * TRIM and lent >= memory + beside * settings.decimation
    assert [part.lent for part in parts] == [(0, lent), *[(lent, lent)] * (len(parts) - 2), (lent, 0)]

    base = base_parameters(RegressorModel.of(arm))
    one, some = (observe(base, recordings, settings) for recordings in ((whole,), parts))
    np.testing.assert_allclose(some.time, one.time, atol=1e-9)
    assert np.array_equal(some.used, one.used)
    np.testing.assert_allclose(some.torque, one.torque, atol=1e-6 * np.abs(one.torque).max())
    of_columns = np.abs(one.regressor).max(axis=(0, 1))
    np.testing.assert_allclose(some.regressor / of_columns, one.regressor / of_columns, atol=1e-6)


def test_what_is_fitted_to_parts_is_what_is_fitted_to_the_whole(
    arm: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = recording(arm)
    rng = np.random.default_rng(3)
    position = whole.position + 1e-6 * rng.standard_normal(whole.position.shape)
    signal = whole.control_signal + arm.control_signal(0.3 * rng.standard_normal(position.shape))
    noisy = Recording("long", whole.time, None, position, signal)
    monkeypatch.setattr(pieces, "_LONGEST_PART", PART)
    one, some = (
        identify(arm, recordings).result.least_squares
        for recordings in ((noisy,), in_parts(noisy, arm.identification))
    )
    sigma = np.array([parameter.sigma for parameter in one.parameters])
    assert (np.abs(some.values - one.values) < 1e-3 * sigma).all()
    assert [parameter.sigma for parameter in some.parameters] == pytest.approx(sigma, rel=0.1)
    widths = [[parameter.half_width for parameter in fit.parameters] for fit in (some, one)]
    assert widths[0] == pytest.approx(widths[1], rel=0.15)


def test_progress_is_told_part_by_part_and_ends_where_the_work_does(
    arm: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(4)
    whole = recording(arm)
    signal = whole.control_signal + arm.control_signal(0.3 * rng.standard_normal(whole.position.shape))
    noisy = Recording("long", whole.time, None, whole.position, signal)
    monkeypatch.setattr(pieces, "_LONGEST_PART", PART)
    parts = in_parts(noisy, arm.identification)
    told: list[tuple[str, float]] = []
    identify(arm, parts, lambda step, share: told.append((step, share)))
    shares = [share for _, share in told]
    assert shares == sorted(shares) and shares[0] == 0.0 and shares[-1] == 1.0
    rows = [share for step, share in told if step == "observation matrix"]
    steps = np.diff(rows)
    assert len(steps) == len(parts) and steps == pytest.approx(np.full(len(parts), steps[0]))
    assert shares.count(1.0) == 1, "nothing is done after the end"


def test_a_short_log_is_left_as_it_is(arm: Robot) -> None:
    whole = recording(arm)
    assert in_parts(whole, arm.identification) == (whole,)
