"""What is advised was tried, and fits into a line."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ident import Options, Recording, base_parameters, identify
from ident.identification.tried_cutoff import tried_cutoff
from ident.listing import listed, seconds
from ident.parameters.regressor import RegressorModel
from robots import Robot
from tests.ident.pinocchio_arm import STEP, record, tx40

RINGING = 90.0
"""Hz: of a loop that rings, far above the motion and far above the noise of the positions."""


def at(cutoff_hz: float) -> Robot:
    settings = tx40().identification.model_copy(update={"cutoff_hz": cutoff_hz, "decimation": 2})
    return tx40().model_copy(update={"identification": settings})


@cache
def ringing() -> Recording:
    """Positions without noise, so that their spectrum sees motion at any frequency; the torque rings."""
    plain = record(5, encoder=1e-9, noise=0.1, seconds=8.0)
    wave = np.sin(2 * np.pi * RINGING * STEP * np.arange(plain.time.size))[:, np.newaxis]
    # The arm answers a little: a position that rings is a motion to the spectrum.
    torque = 0.3 * tx40().torque_limits * wave
    return replace(
        plain,
        position=plain.position + 1e-6 * wave,
        control_signal=plain.control_signal + tx40().control_signal(torque),
    )


def test_a_cut_off_that_leaves_more_is_not_proposed() -> None:
    base = base_parameters(RegressorModel.of(at(20.0)))
    tried = tried_cutoff(base, (ringing(),), 150.0)
    assert tried.hz < RINGING
    assert tried.left <= tried.left_before


def test_a_better_cut_off_is_proposed_with_what_it_leaves() -> None:
    given = at(2.0)
    warnings = identify(given, (record(5, seconds=8.0),), options=Options(method="ls")).result.warnings
    said = [words for words in warnings if words.startswith("cut-off 2 Hz leaves")]
    assert len(said) == 1
    before, after = (float(part.split("%")[0].split()[-1]) for part in said[0].split("leaves")[1:])
    assert after < before


def test_a_cut_off_beyond_half_the_rate_is_left_out() -> None:
    tried = tried_cutoff(base_parameters(RegressorModel.of(at(20.0))), (record(5, seconds=8.0),), 260.0)
    assert tried.hz < 250.0


@pytest.mark.parametrize(
    ("count", "text"),
    [(0, ""), (2, "p0, p1"), (6, "p0, p1, p2, p3, p4, p5"), (70, "p0, p1, p2 and 67 more")],
)
def test_many_names_are_a_count(count: int, text: str) -> None:
    assert listed([f"p{k}" for k in range(count)]) == text


def test_no_warning_of_a_poor_motion_is_longer_than_a_line() -> None:
    poor = record(5, noise=20.0, seconds=8.0)
    warnings = identify(tx40(), (poor,), options=Options(method="ls")).result.warnings
    assert any("seen with more than 30 % σ" in words for words in warnings)
    assert max(map(len, warnings)) < 250


def test_an_instant_tells_samples_apart_whatever_the_clock_counts_from() -> None:
    assert (seconds(12.345678), seconds(0.0)) == ("12.3457", "0")
    assert seconds(1460034857.0149) == "1460034857.015"
