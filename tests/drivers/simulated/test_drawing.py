"""Drawn scenarios: the same from the same seed, of the size asked for, where the arm has room for them."""

from __future__ import annotations

import numpy as np
import pytest

from drivers import DriveError
from drivers.simulated import draw_scenario, draw_truth
from drivers.simulated.drawing import EFFECTS, exercise
from drivers.simulated.drawing.gap import Ruler, silent
from drivers.simulated.drawing.places import Place
from drivers.simulated.drawing.shapes import wave
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import EMPTY, OUTSIDE_VOCABULARY, Scenario
from robots import Robot

NOT_DRAWN = {"format", "noise", "transmission", "tool_contact"}
"""What a scenario can have that is no effect with a size of its own."""


def test_every_effect_can_be_drawn() -> None:
    assert set(EFFECTS) == {"none", *Scenario.model_fields} - NOT_DRAWN
    assert set(OUTSIDE_VOCABULARY) < set(EFFECTS)


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["backlash", "wrist_coupling", "drive_gain_error", "vibration"])
@pytest.mark.parametrize("size", [2.0, 6.0])
def test_the_gap_is_as_large_as_asked_for(tx40: Robot, effect: str, size: float) -> None:
    drawn = draw_scenario(tx40, effect, 4, size)
    again = draw_scenario(tx40, effect, 4, size)
    assert again == drawn
    assert size <= drawn.ratio <= 1.5 * size
    ((name, axes),) = drawn.scenario.effects()
    assert (name, axes) == (effect, drawn.axes)
    ruler = Ruler.of(tx40, draw_truth(tx40, 4), exercise(tx40))
    gap = ruler.gap(drawn.scenario)
    assert gap == pytest.approx(drawn.gap)
    assert (gap / ruler.floor).max() == pytest.approx(drawn.ratio)


@pytest.mark.slow
def test_seeds_draw_different_places(tx40: Robot) -> None:
    drawn = [draw_scenario(tx40, "current_offset", seed, 3.0).axes for seed in range(6)]
    assert len(set(drawn)) >= 3


def test_an_effect_sits_where_it_is_allowed_or_nowhere(tx40: Robot) -> None:
    path = exercise(tx40, 3.0)
    drawn = [
        draw_scenario(tx40, "current_offset", seed, 3.0, reference=path, allowed=lambda axes: axes == (2,))
        for seed in (0, 1)
    ]
    assert [one.axes for one in drawn] == [(2,), (2,)]
    with pytest.raises(DriveError, match="tx40 has no place for it"):
        draw_scenario(tx40, "current_offset", 0, reference=path, allowed=lambda axes: False)


def test_nothing_hidden_is_nothing(tx40: Robot) -> None:
    ruler = Ruler.of(tx40, draw_truth(tx40, 1), exercise(tx40, 3.0))
    assert not ruler.gap(EMPTY).any()
    assert (ruler.floor > 0.003).all()
    assert (ruler.floor < 1.0).all()


def test_what_the_arm_has_no_place_for_is_said(emps: Robot) -> None:
    with pytest.raises(DriveError, match="wrist_coupling: emps has no place for it"):
        draw_scenario(emps, "wrist_coupling", 0)
    with pytest.raises(DriveError, match="no sensible magnitude makes a gap of 1e\\+06 noise floors"):
        draw_scenario(emps, "current_offset", 0, 1e6)
    with pytest.raises(DriveError, match="effect warp: does not exist; allowed: none, viscous_friction"):
        draw_scenario(emps, "warp", 0)


def test_waves_of_friction_go_up_and_down_over_the_travel_of_what_slides(emps: Robot) -> None:
    """One to three of them; per metre as per radian a wave would be a level."""
    truth, reference = draw_truth(emps, 1), exercise(emps, 3.0)
    place = Place((1,), emps, Ruler.of(emps, truth, reference))
    low, high = place.travel()
    drawn = [wave(np.random.default_rng(seed), place) for seed in range(40)]
    counts = {round(one["order"] * (high - low) / (2.0 * np.pi), 6) for one in drawn if "order" in one}
    assert counts == {1.0, 2.0, 3.0}


def test_the_exercise_keeps_the_limits_and_ends_at_home(tx40: Robot, emps: Robot) -> None:
    for robot in (tx40, emps):
        motion, cycle = exercise(robot), robot.bus.cycle_time
        speed = np.gradient(motion, cycle, axis=0)
        assert motion[0] == pytest.approx(robot.home, abs=1e-12)
        assert motion[-1] == pytest.approx(robot.home, abs=1e-3)
        assert (motion >= robot.lower).all()
        assert (motion <= robot.upper).all()
        assert (np.abs(speed) <= 0.51 * robot.velocity_limits).all()
        assert (np.abs(np.gradient(speed, cycle, axis=0)) <= 0.51 * robot.acceleration_limits).all()
        used = np.abs(speed).max(axis=0) / robot.velocity_limits
        assert (used > 0.05).all()


def test_a_silent_arm_has_no_noise(tx40: Robot) -> None:
    quiet = silent(draw_truth(tx40, 1))
    assert not any(quiet.torque_noise + quiet.encoder_noise)
    assert quiet.parameters == draw_truth(tx40, 1).parameters


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["joint_elasticity", "stiffening_elasticity"])
@pytest.mark.parametrize("drive", [1, 2])
def test_a_gear_that_hardly_gives_way_leaves_its_drive_still(tx40: Robot, effect: str, drive: int) -> None:
    """From 140 Hz on the loops of these drives swing with the gear, and what is hidden is a vibration."""
    path, truth = exercise(tx40, 3.0), silent(draw_truth(tx40, 1410080))
    ruler = Ruler.of(tx40, truth, path)
    shape = EFFECTS[effect].shape(np.random.default_rng(0), Place((drive,), tx40, ruler))
    soft = Scenario.from_dict({"format": 1, **EFFECTS[effect].entries(1e-4, (drive,), shape)})
    with_it, without = (simulate_offline(tx40, truth, path, scenario=one) for one in (soft, EMPTY))
    steps = [np.diff(run.control_signal, axis=0).std(axis=0) for run in (with_it, without)]
    assert (steps[0] / steps[1]).max() < 1.5
