"""Friction is measured where a drive slips, not while its gear still winds up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import robots
from daq.session.first_friction import Ways, ways_of
from daq.session.first_judgement import judge_move
from daq.session.first_motion import half_degree
from tests.daq.session.wrong_arms import WrongArm
from tests.daq.session.wrong_descriptions import drive, right_arm

TX40 = robots.load("tx40")
WIND_UP = 2e-3
"""rad over which friction builds up at a reversal; half a degree is four times as much."""


def winding(factor: float) -> WrongArm:
    """An arm whose friction is so many times the described one, and winds its gears up."""
    arm = right_arm(TX40, 900)
    parameters = dict(arm.truth.parameters)
    for number, one in enumerate(TX40.drive, start=1):
        parameters[f"Fc{number}"] = factor * one.dynamics.coulomb
        parameters[f"Fv{number}"] = factor * one.dynamics.viscous
    truth = replace(arm.truth, parameters=parameters, bristle_width=(WIND_UP,) * 6)
    return replace(arm, truth=truth)


@pytest.mark.parametrize("joint", [2, 5])
@pytest.mark.parametrize("factor", [0.5, 1.5])
def test_friction_that_winds_gears_up_is_measured_and_not_refused(joint: int, factor: float) -> None:
    arm = winding(factor)
    motion = half_degree(TX40, arm.reading(), [joint])
    samples = arm.stream(motion)
    way = ways_of(TX40, samples, motion.turns[0], joint)
    assert way.slipped
    assert way.measured / way.described == pytest.approx(factor, rel=0.15)
    assert judge_move(TX40, samples, motion) == []


def test_a_gain_that_is_a_quarter_is_still_told_from_little_friction() -> None:
    arm = drive(5, "gain", 0.25)(winding(1.0))
    motion = half_degree(TX40, arm.reading(), [5])
    found = judge_move(arm.wrong, arm.stream(motion), motion)
    assert any("against friction" in finding.text for finding in found)


@pytest.mark.parametrize(
    ("slipped", "measured", "refused"),
    [
        (True, 0.34, True),
        (True, 0.36, False),
        (False, 0.1, False),  # it bears more
        (False, -0.1, True),
        (False, 2.9, True),
        (True, 2.9, True),
    ],
)
def test_of_a_gear_that_never_slips_friction_is_known_from_below(
    slipped: bool, measured: float, refused: bool
) -> None:
    rows = np.ones(1, dtype=np.bool_)
    assert (Ways(rows, rows, slipped, measured, 1.0).words(0, "N·m") is not None) == refused


def test_a_drive_that_does_not_move_is_taken_by_the_rows_in_which_it_was_to() -> None:
    arm = right_arm(TX40, 900)
    motion = half_degree(TX40, arm.reading(), [5])
    samples = arm.stream(motion)
    still = replace(samples, position=np.repeat(samples.position[:1], len(samples.position), axis=0))
    way = ways_of(TX40, still, motion.turns[0], 5)
    assert not way.slipped and way.up.any() and way.down.any() and not (way.up & way.down).any()
