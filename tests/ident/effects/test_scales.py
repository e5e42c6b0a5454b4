"""Every effect says how large it is in nature, in its own units, before any data are seen."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import robots
from ident import RegressorModel
from ident.effects import State, scales
from ident.effects.family import Place
from ident.effects.placed import Family
from ident.effects.vocabulary import VOCABULARY
from ident.parameters.present import Present
from robots.arrays import FloatArray
from robots.description import Robot

FORMS = [form for family in VOCABULARY for form in family.nested]


@cache
def present(name: str) -> Present:
    model = RegressorModel.of(robots.load(name))
    return Present(model, model.prior())


@pytest.mark.parametrize("name", ["tx40", "emps"])
@pytest.mark.parametrize("family", FORMS, ids=lambda family: family.name)
def test_every_parameter_has_a_size_that_can_be(family: Family, name: str) -> None:
    robot = robots.load(name)
    for place in family.places(robot):
        shape = tuple(one.grid[0] for one in family.shapes(robot, place))
        effect = family.effect(robot, place, shape, present(name))
        assert len(effect.scale) == len(effect.centre) == len(effect.bounds) == len(effect.parameters)
        for scale, centre, (low, high) in zip(effect.scale, effect.centre, effect.bounds, strict=True):
            assert 0.0 < scale < np.inf
            assert low <= centre <= high or effect.name == "time_delay"


def test_sizes_follow_the_description_and_not_the_model_under_examination() -> None:
    robot = robots.load("tx40")
    model = RegressorModel.of(robot)
    family, place = VOCABULARY[1], VOCABULARY[1].places(robot)[2]
    quiet, loud = (Present(model, factor * model.prior()) for factor in (0.1, 10.0))
    assert family.effect(robot, place, (), quiet).scale == family.effect(robot, place, (), loud).scale


@pytest.mark.parametrize(("effect", "share"), [("coulomb_friction", 0.3), ("rotor_inertia", 0.5)])
def test_a_term_that_the_model_lacks_is_as_large_as_the_whole_of_it(effect: str, share: float) -> None:
    """A change of dry friction by all of it is far off; in a model without any it is nothing unusual."""
    robot = robots.load("emps")
    whole = RegressorModel.of(robot)
    lacking = RegressorModel(robot, tuple(one for one in whole.effects if one.name != effect))
    family = next(one for one in VOCABULARY if one.name == effect)
    (place,) = family.places(robot)
    changed, all_of_it = (
        family.effect(robot, place, (), Present(model, model.prior())).scale[0] for model in (whole, lacking)
    )
    assert changed == pytest.approx(share * all_of_it)


def doubled(robot: Robot, drive: int) -> Robot:
    changed = list(robot.drive)
    dynamics = changed[drive].dynamics
    twice = {name: 2.0 * getattr(dynamics, name) for name in ("inertia", "viscous", "coulomb")}
    changed[drive] = changed[drive].model_copy(update={"dynamics": dynamics.model_copy(update=twice)})
    return robot.model_copy(update={"drive": tuple(changed)})


def test_friction_and_rotors_are_those_of_the_drive() -> None:
    robot, place = robots.load("tx40"), Place("drive", (0,))
    larger = doubled(robot, 0)
    for size in (scales.dry_friction, scales.viscous_friction, scales.rotor_inertia):
        assert size(larger, place) == pytest.approx(2.0 * size(robot, place))
    assert scales.friction_power(larger, place) == pytest.approx(2.0 * scales.friction_power(robot, place))


def test_a_drive_without_figures_has_friction_all_the_same() -> None:
    robot, place = robots.load("tx40"), Place("drive", (0,))
    drives = list(robot.drive)
    none = drives[0].dynamics.model_copy(update={"inertia": 0.0, "viscous": 0.0, "coulomb": 0.0})
    drives[0] = drives[0].model_copy(update={"dynamics": none})
    bare = robot.model_copy(update={"drive": tuple(drives)})
    torque = robot.joint[0].torque
    assert scales.dry_friction(bare, place) == pytest.approx(0.02 * torque)
    assert scales.viscous_friction(bare, place) == pytest.approx(0.02 * torque / robot.joint[0].velocity)
    assert scales.rotor_inertia(bare, place) == pytest.approx(0.02 * torque / robot.joint[0].acceleration)


def test_a_payload_is_a_tenth_of_the_arm() -> None:
    mass, lever = scales.payload(robots.load("tx40"))
    assert 1.0 < mass < 4.0
    assert lever == pytest.approx(0.1 * (10.0 * mass / 25.0) ** (1.0 / 3.0))


def longer(robot: Robot, joint: int, limits: tuple[float, float]) -> Robot:
    """The arm with other limits of a joint."""
    changed = list(robot.joint)
    changed[joint] = changed[joint].model_copy(update={"position": limits})
    return robot.model_copy(update={"joint": tuple(changed)})


def pull(robot: Robot, name: str, shape: tuple[float, ...], position: float) -> FloatArray:
    """(p,) shares of the rated torque that one deviation of each parameter pulls joint 1 with."""
    model = RegressorModel.of(robot)
    family = next(one for one in VOCABULARY if one.name == name)
    effect = family.effect(robot, Place("joint", (0,)), shape, Present(model, model.prior()))
    at = np.zeros((1, robot.n))
    at[0, 0] = position
    columns = effect.columns(State(at, np.zeros_like(at), np.zeros_like(at)))[0, 0]
    return np.asarray(columns * np.array(effect.scale) / robot.joint[0].torque)


@pytest.mark.parametrize(
    ("name", "shape", "shares"),
    [
        ("gravity_spring", (), (0.1, 0.1)),
        ("cable_spring", (0.0,), (0.03, 0.1)),
        ("contact", (0.0, 1.0), (0.3,)),
        ("dress_pack_hysteresis", (0.1,), (0.0, 0.03, 0.03)),
    ],
)
def test_a_spring_pulls_as_hard_at_the_end_of_a_short_axis_as_of_a_long_one(
    name: str, shape: tuple[float, ...], shares: tuple[float, ...]
) -> None:
    """A stiffness per metre says nothing of 0.3 m: to a third power a thirtieth of what it should."""
    for half in (0.03, 0.3, 3.0):
        robot = longer(robots.load("emps"), 0, (-half, half))
        np.testing.assert_allclose(pull(robot, name, shape, half), shares)


def test_what_turns_is_bent_over_a_radian_at_most() -> None:
    """A cable that was hard where a wrist of a whole turn moves was a spring between anchors (97926)."""
    for half, way in ((0.5, 0.5), (2.0, 1.0), (4.0, 1.0)):
        robot = longer(robots.load("tx40"), 0, (-half, half))
        assert scales.way(robot, Place("joint", (0,))) == way
        np.testing.assert_allclose(pull(robot, "gravity_spring", (), way), (0.1, 0.1))
        np.testing.assert_allclose(pull(robot, "cable_spring", (0.0,), way), (0.03, 0.1))


def test_a_pack_on_a_short_axis_bends_over_a_part_of_its_way() -> None:
    pack = next(one for one in VOCABULARY if one.name == "dress_pack_hysteresis")
    (bend,) = pack.shapes(robots.load("emps"), Place("joint", (0,)))
    assert bend.grid == pytest.approx((0.03, 0.09, 0.3)) and (bend.lower, bend.upper) == pytest.approx(
        (0.006, 1.5)
    )


def test_a_cable_pulls_back_and_its_rest_is_looked_for_every_twentieth_of_the_travel() -> None:
    """One that pushes away near its rest is none; beside a wrong rest it pulls where it should hang free."""
    robot, place = robots.load("emps"), Place("joint", (0,))
    cable = next(one for one in VOCABULARY if one.name == "cable_spring")
    (rest,) = cable.shapes(robot, place)
    assert np.diff(rest.grid) == pytest.approx(np.full(16, 0.05 * 0.6))
    assert [low for low, _ in cable.effect(robot, place, (0.0,), present("emps")).bounds] == [0.0, 0.0]
