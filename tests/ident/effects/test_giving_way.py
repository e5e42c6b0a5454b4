"""Links that give way at several places at once: each is moved by what the others make of the arm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from ident.effects import State, giving_way
from ident.effects.elastic_gear import link_inertia
from ident.effects.foot import AXES, inertia_on_foot
from ident.effects.giving_way import torque_of_giving_way, torque_through_gears
from ident.effects.placed import Placed
from ident.effects.vocabulary import family_named
from ident.effects.ways import Pliant
from ident.parameters.present import Present
from ident.parameters.regressor import RegressorModel
from robots.arrays import FloatArray
from tests.ident.effects.test_before_the_record import PERIOD, STEP, motion, motion_of
from tests.ident.effects.test_vocabulary import TX40, placed, present

KNOWN = present("tx40")


def shaken() -> State:
    """The slow waves of a motion with one of 6 to 8 Hz more on each joint."""
    slow = motion(2 * PERIOD)
    rate = 2.0 * np.pi * np.arange(24, 24 + 2 * TX40.n, 2) / (STEP * PERIOD)
    phase = np.outer(slow.time, rate)
    more = (0.004 * np.cos(phase), -0.004 * rate * np.sin(phase), -0.004 * rate**2 * np.cos(phase))
    return State(*(a + b for a, b in zip(motion_of(slow), more, strict=True)), slow.time, period=PERIOD)


STATE = shaken()
LATE = slice(PERIOD, 2 * PERIOD, 10)
"""What they began with is forgotten."""


def gear(
    drive: int, frequency: float, name: str = "joint_elasticity", *more: float, damping: float = 0.08
) -> Placed:
    compliance = 1.0 / (link_inertia(TX40, drive) * (2.0 * np.pi * frequency) ** 2)
    return placed(name, drive, compliance, *more, damping)


def foot(frequency: float) -> Placed:
    inertia = float(inertia_on_foot(TX40).mean())
    return placed("base_compliance", 0, 1.0 / (inertia * (2.0 * np.pi * frequency) ** 2), 2.0, 0.3, 0.08)


SIDE_BY_SIDE = gear(1, 8.0), gear(2, 10.0)
SETS = {
    "two gears": SIDE_BY_SIDE,
    "a gear that stiffens beside one": (gear(1, 9.0, "stiffening_elasticity", 0.5), gear(2, 11.0)),
    "a foot and a gear": (foot(7.0), gear(2, 10.0)),
    "a foot and two gears": (foot(7.0), *SIDE_BY_SIDE),
}


def places_of(effects: tuple[Placed, ...]) -> tuple[Pliant, ...]:
    return tuple(place for effect in effects for place in effect.gives_way)


def with_effects(effects: tuple[Placed, ...]) -> Present:
    """The model with these, each made of it alone."""
    model = RegressorModel(KNOWN.model.robot, (*KNOWN.model.effects, *effects))
    return Present(model, np.concatenate([KNOWN.standard, np.ones(len(effects))]))


@pytest.mark.parametrize("effects", SETS.values(), ids=SETS.keys())
def test_they_swing_as_one(effects: tuple[Placed, ...]) -> None:
    """Against pin's equations of the arm, with a joint more at each place, integrated by scipy."""
    places = places_of(effects)
    along, course = (
        np.stack([one.along for one in places]),
        CubicSpline(STATE.time, np.stack(motion_of(STATE), 1)),
    )
    own = np.array([one.own for one in places])
    offset = np.concatenate([np.zeros(AXES), KNOWN.offset_torque()])

    def torque(arm: FloatArray, ways: FloatArray) -> FloatArray:
        """Of the foot and on the joints, where links are farther by ways and their rates, 3 × places."""
        more = ways @ along
        moved = State(*(one[np.newaxis] for one in arm + more[:, AXES:]))
        return KNOWN.foot_torque(moved, more[np.newaxis, :, :AXES])[0]

    def held(way: FloatArray, rate: FloatArray) -> FloatArray:
        return np.array(
            [
                one.gear.stiffness * x + one.gear.cubic * x**3 + one.gear.damping * v
                for one, x, v in zip(places, way, rate, strict=True)
            ]
        )

    def pushes(time: float, way: FloatArray, rate: FloatArray) -> FloatArray:
        """3 × places: the ways, and how they go on."""
        arm, ways = course(time), np.zeros((3, len(places)))
        ways[0], ways[1] = way, rate
        still = torque(arm, ways)
        turned = np.empty((len(places), len(places)))
        for k, one in enumerate(np.eye(len(places))):
            turned[:, k] = along @ (torque(arm, ways + np.outer([0, 0, 1], one)) - still)
        load = -(along @ still) - np.array([one.offset * offset @ one.along for one in places])
        ways[2] = np.linalg.solve(turned + np.diag(own), load - held(way, rate))
        return ways

    k = len(places)
    run = solve_ivp(
        lambda t, s: pushes(t, s[:k], s[k:])[1:].ravel(),
        (0.0, STATE.time[-1]),
        np.zeros(2 * k),
        t_eval=STATE.time[LATE],
        max_step=0.004,
        method="RK23",
    )
    wanted = []
    for time, ways in zip(run.t, run.y.T, strict=True):
        arm = course(time)
        whole = torque(arm, pushes(time, ways[:k], ways[k:])) - torque(arm, np.zeros((3, k)))
        wanted.append(whole[AXES:])
    got = torque_of_giving_way(places, KNOWN, STATE)[LATE]
    alone = sum(effect.columns(STATE)[LATE][:, :, 0] for effect in effects)
    assert np.linalg.norm(got - wanted) < 0.01 * np.linalg.norm(wanted)
    assert np.linalg.norm(alone - wanted) > 0.2 * np.linalg.norm(wanted)


@pytest.mark.parametrize("effects", SETS.values(), ids=SETS.keys())
def test_effects_beside_each_other_make_what_all_make_at_once(effects: tuple[Placed, ...]) -> None:
    whole = with_effects(effects)
    again = [
        family_named(one.name).effect(TX40, one.place, one.shape, whole.without(one.name, one.place))
        for one in effects
    ]
    together = torque_of_giving_way(places_of(effects), KNOWN, STATE)
    made = sum(one.columns(STATE)[:, :, 0] for one in again)
    np.testing.assert_allclose(made, together, atol=1e-5 * np.abs(together).max())


@pytest.mark.parametrize("effects", SETS.values(), ids=SETS.keys())
def test_one_more_beside_them_makes_what_is_missing(effects: tuple[Placed, ...]) -> None:
    """Of a model that has one, made of it alone, the others bring it to what all make at once."""
    first, *others = effects
    known, total = with_effects((first,)), first.columns(STATE)[:, :, 0]
    for number, one in enumerate(others):
        added = family_named(one.name).effect(TX40, one.place, one.shape, known)
        total = total + added.columns(STATE)[:, :, 0]
        known = with_effects((first, *others[: number + 1]))
    together = torque_of_giving_way(places_of(effects), KNOWN, STATE)
    np.testing.assert_allclose(total, together, atol=1e-5 * np.abs(together).max())


def test_how_links_rang_before_the_record_is_what_springs_carry() -> None:
    """Of a log that is cut out of a motion, with noise; else both begin without ringing."""
    effects = gear(1, 8.0, damping=0.004), gear(2, 11.0, damping=0.006)
    places, cut = places_of(effects), PERIOD // 2
    right = torque_of_giving_way(places, KNOWN, STATE)
    noise = 0.02 * np.random.default_rng(3).normal(size=right.shape)
    record = State(*(one[cut:] for one in motion_of(STATE)), STATE.time[cut:])
    seen = replace(record, torque=(KNOWN.torque(STATE) + right + noise)[cut:])
    missed, unseen = (torque_of_giving_way(places, KNOWN, one) - right[cut:] for one in (seen, record))
    assert np.linalg.norm(missed) < 0.03 * np.linalg.norm(right[cut:])
    assert np.linalg.norm(unseen) > 0.3 * np.linalg.norm(right[cut:])
    whole = with_effects(effects)
    again = [
        family_named(one.name).effect(TX40, one.place, one.shape, whole.without(one.name, one.place))
        for one in effects
    ]
    made = sum(one.columns(seen)[:, :, 0] for one in again)
    assert np.linalg.norm(made - right[cut:]) < 0.03 * np.linalg.norm(right[cut:])


def test_friction_follows_the_load_of_links_that_give_way() -> None:
    effects = SIDE_BY_SIDE
    known = with_effects(effects)
    through = KNOWN.link_torque(STATE) + torque_of_giving_way(places_of(effects), KNOWN, STATE)
    np.testing.assert_allclose(torque_through_gears(known, STATE), through)
    np.testing.assert_allclose(torque_through_gears(KNOWN, STATE), KNOWN.link_torque(STATE))


def test_play_beside_a_soft_gear_moves_its_links() -> None:
    """A link between flanks is free: what the other gear feels of it is not what a rigid one gives."""
    soft = gear(1, 8.0)
    play = placed("backlash", 2, 0.004, 1.0, 1.0 / gear(2, 40.0).shape[0], 0.3)
    beside = torque_of_giving_way(places_of((soft, play)), KNOWN, STATE)
    apart = torque_of_giving_way(soft.gives_way, KNOWN, STATE) + torque_of_giving_way(
        play.gives_way, KNOWN, STATE
    )
    assert np.isfinite(beside).all()
    assert np.linalg.norm(beside - apart) > 0.05 * np.linalg.norm(apart)
    rigid = placed("backlash", 2, 1e-7, 1.0, 1.0 / gear(2, 40.0).shape[0], 1.0)
    stiff = torque_of_giving_way(places_of((soft, gear(2, 40.0))), KNOWN, STATE)
    held = torque_of_giving_way(places_of((soft, rigid)), KNOWN, STATE)
    assert np.linalg.norm((held - stiff)[LATE]) < 0.15 * np.linalg.norm(stiff[LATE])


def test_links_that_are_no_bodies_push_no_others() -> None:
    """Parameters that were fitted need be none: by a mass matrix that is no body's links swing ever wider."""
    odd = replace(
        KNOWN, standard=KNOWN.standard * np.where(np.arange(KNOWN.standard.size) % 10 == 9, -3.0, 1.0)
    )
    change = torque_of_giving_way(places_of(SETS["a foot and two gears"]), odd, STATE)
    assert np.isfinite(change).all()
    assert np.abs(change).max() < 100.0 * np.abs(KNOWN.link_torque(STATE)).max()


def test_a_foot_that_cannot_hold_the_arm_is_no_foot() -> None:
    """Softer than what the arm weighs on it, it would have fallen over: 10⁵⁴ N·m are nobody's."""
    fallen = placed("base_compliance", 0, 0.02, 2.0, 0.3, 0.08)
    assert not torque_of_giving_way(places_of((fallen,)), KNOWN, STATE).any()


def test_a_motion_keeps_few_courses_whatever_is_asked_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """10 MB each of a minute: with those of every model and every pair a play took 2.2 GB."""
    made: list[int] = []
    real = giving_way.felt
    monkeypatch.setattr(giving_way, "felt", lambda *given: made.append(1) or real(*given))
    state = shaken()
    models = [with_effects((gear(drive, 9.0),)) for drive in (0, 3)]
    for drive in range(1, 5):
        for model in models:
            places = places_of((gear(drive, 8.0),))
            ways = [giving_way.ways_of(places, model, state)[0].way for _ in range(2)]
            assert np.array_equal(*ways)
    assert len(made) == 8  # of each model, once
    courses = state.once(None, "felt", pytest.fail)
    assert len(courses._answers) == giving_way._KEPT < 8
