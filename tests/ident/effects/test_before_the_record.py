"""What has a state of its own, in a record that begins in the middle of a motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from ident.effects import State
from ident.effects.elastic_gear import link_inertia
from ident.effects.foot import AXES, inertia_on_foot, on_a_foot
from ident.effects.placed import Placed
from robots import rigid_body_model
from robots.arrays import FloatArray
from tests.ident.effects.test_vocabulary import TX40, placed, present

STEP, PERIOD = 0.004, 1000
"""s; samples of 4 s."""


def motion(samples: int) -> State:
    """Whole waves in each period, all of them at full speed at its beginning."""
    time, waves = STEP * np.arange(samples), np.arange(2, TX40.n + 2)
    rate = 2.0 * np.pi * waves / (STEP * PERIOD)
    phase = np.outer(time, rate)
    course = (0.4 * np.sin(phase), 0.4 * rate * np.cos(phase), -0.4 * rate**2 * np.sin(phase))
    return State(*course, time, period=PERIOD)


def foot(ratio: float = 0.05, about: float = 0.0) -> Placed:
    """Of a resonance of about 8 Hz about x, y (1) or both (2)."""
    inertia = float(inertia_on_foot(TX40)[0])
    compliance = 1.0 / (1.2 * inertia * (2.0 * np.pi * 8.0) ** 2)
    return placed("base_compliance", 0, compliance, about, 0.2 * inertia, ratio)


def gear(name: str, *shape: float) -> Placed:
    return placed(name, 2, 1.0 / (0.4 * (2.0 * np.pi * 12.0) ** 2), *shape)


RINGS = gear("joint_elasticity", 0.004)
"""For 1/0.3 s, longer than a period of 4 s lets it forget."""
SOFT = [foot(), gear("joint_elasticity", 0.03), gear("stiffening_elasticity", 0.2, 0.08)]


@pytest.mark.parametrize("effect", [*SOFT, RINGS], ids=lambda effect: effect.name)
def test_a_motion_that_repeats_is_answered_alike_from_its_first_period_on(effect: Placed) -> None:
    columns = effect.columns(motion(3 * PERIOD))[:, :, 0]
    first, last = columns[:PERIOD], columns[2 * PERIOD :]
    assert np.abs(first - last).max() < 0.02 * np.abs(last).max()


def test_how_a_gear_rang_before_the_record_is_what_its_spring_carries() -> None:
    """Of a log that is cut out of a motion, with noise as large; else it begins without ringing."""
    whole, cut = motion(3 * PERIOD), 3 * PERIOD // 2
    right = RINGS.columns(whole)[:, :, 0]
    others = present("tx40").torque(whole)
    record = State(*(one[cut:] for one in motion_of(whole)), whole.time[cut:])
    noise = 0.02 * np.random.default_rng(3).normal(size=right.shape)
    seen = replace(record, torque=(others + right + noise)[cut:])
    missed, unseen = (RINGS.columns(one)[:, :, 0] - right[cut:] for one in (seen, record))
    assert np.linalg.norm(missed) < 0.1 * np.linalg.norm(right[cut:]) < 0.1 * np.linalg.norm(noise[cut:])
    assert np.linalg.norm(unseen) > 0.3 * np.linalg.norm(right[cut:])


def test_a_gear_that_rings_is_asked_of_the_measured_motion() -> None:
    """It multiplies what a simulated motion misses; what rings for long alone does."""
    measured = motion(2 * PERIOD)
    simulated = replace(measured, position=measured.position + 1e-4, measured=measured)
    for effect, same in ((RINGS, True), (SOFT[1], False)):
        wanted, got = effect.columns(measured), effect.columns(simulated)
        assert np.array_equal(wanted, got) is same
    part = simulated.part(slice(0, None, 2))
    assert part.measured is not None
    np.testing.assert_array_equal(part.measured.position, measured.position[::2])


@pytest.mark.parametrize("ratio", [0.03, 0.2])
def test_a_link_takes_what_it_takes_where_it_is(ratio: float) -> None:
    """Against pin's equations of the arm whose link moves otherwise than its drive, integrated by scipy."""
    state, drive = motion(2 * PERIOD), 2
    effect = placed("joint_elasticity", drive, 1.0 / (0.4 * (2.0 * np.pi * 6.0) ** 2), ratio)
    known = present("tx40")
    compliance, _ = effect.shape
    damping = 2.0 * ratio * np.sqrt(link_inertia(TX40, drive) / compliance)
    course = CubicSpline(state.time, np.stack(motion_of(state), axis=1))
    along = np.linalg.inv(TX40.transmission_matrix)[:, drive]

    def links(arm: FloatArray, lag: float, rate: float, push: float) -> FloatArray:
        moved = arm - np.outer([lag, rate, push], along)
        return known.link_torque(State(*(one[np.newaxis] for one in moved)))[0]

    offset = known.offset_torque()

    def pushed(time: float, lag: float, rate: float) -> float:
        arm = course(time)
        still, turned = ((links(arm, lag, rate, one) + offset) @ along for one in (0.0, 1.0))
        return float((still - damping * rate - lag / compliance) / (still - turned))

    run = solve_ivp(
        lambda t, s: [s[1], pushed(t, *s)],
        (0.0, state.time[-1]),
        [0.0, 0.0],
        t_eval=state.time,
        max_step=STEP,
    )
    late = range(PERIOD, 2 * PERIOD, 10)
    wanted = []
    for k in late:
        arm, (lag, rate) = course(state.time[k]), run.y[:, k]
        wanted.append(links(arm, lag, rate, pushed(state.time[k], lag, rate)) - links(arm, 0.0, 0.0, 0.0))
    missed = effect.columns(state)[late][:, :, 0] - np.array(wanted)
    assert np.linalg.norm(missed) < 0.005 * np.linalg.norm(wanted)


@pytest.mark.parametrize("effect", SOFT, ids=lambda effect: effect.name)
def test_what_was_before_a_record_is_taken_to_go_on_as_it_began(effect: Placed) -> None:
    """A link that began at rest, wherever a log is cut, swung more than the motion makes it swing."""
    whole = motion(3 * PERIOD)
    right = effect.columns(whole)[:, :, 0]
    missed, size = [], []
    for cut in range(PERIOD, 2 * PERIOD, 125):
        record = State(*(one[cut:] for one in motion_of(whole)), whole.time[cut:])
        missed.append(np.linalg.norm(effect.columns(record)[:250, :, 0] - right[cut : cut + 250]))
        size.append(np.linalg.norm(right[cut : cut + 250]))
    assert np.linalg.norm(missed) < 0.85 * np.linalg.norm(size)


@pytest.mark.parametrize("effect", SOFT, ids=lambda effect: effect.name)
def test_an_arm_that_stands_still_has_stood_still(effect: Placed) -> None:
    """Begun with half a second at rest, or less: the same torque from then on."""
    course = motion_of(motion(PERIOD))
    rise = np.clip(STEP * np.arange(PERIOD) / 1.0, 0.0, 1.0)[:, np.newaxis] ** 3
    moved = [rise * one for one in course]
    rested = [np.concatenate([np.repeat(one[:1], 125, axis=0), one]) for one in moved]
    short, long = (
        effect.columns(State(*one, STEP * np.arange(one[0].shape[0]), period=None))[:, :, 0]
        for one in (moved, rested)
    )
    assert np.abs(long[125:] - short).max() < 1e-3 * np.abs(short).max()


@pytest.mark.parametrize(("about", "bent", "most"), [(0, 0.0, 0.001), (1, 0.0, 0.001), (2, 1.0, 0.003)])
def test_a_foot_is_turned_by_an_arm_that_rocks_with_it(about: int, bent: float, most: float) -> None:
    """Against pin's equations of the whole arm on its foot, about x, y or both, integrated by scipy."""
    there = bent * np.array([0.8, 0.9, 0.3, 0.0, 0.5, 0.0])  # where each axis feels the other
    state = replace(motion(2 * PERIOD), position=motion(2 * PERIOD).position + there)
    effect = foot(0.1, float(about))
    compliance, _, own, ratio = effect.shape
    axes = ([0], [1], [0, 1])[about]
    damping = 2.0 * ratio * np.sqrt((inertia_on_foot(TX40) + own) / compliance)
    model = on_a_foot(rigid_body_model(TX40))
    data, course = model.createData(), CubicSpline(state.time, np.stack(motion_of(state), axis=1))

    def torque(rocking: FloatArray, arm: FloatArray) -> FloatArray:
        return np.asarray(pinocchio.rnea(model, data, *np.hstack([rocking, arm])).copy())

    def rocks(time: float, lean: FloatArray, rate: FloatArray) -> FloatArray:
        """3 × axes of the foot: how it leans, and how that goes on."""
        arm, rocking = course(time), np.zeros((3, AXES))
        rocking[0], rocking[1] = lean, rate
        still = torque(rocking, arm)[:AXES]
        turned = np.array(
            [torque(rocking + np.array([[0, 0], [0, 0], one]), arm)[:AXES] - still for one in np.eye(AXES)]
        )
        felt = -(still + damping * rate + lean / compliance)
        rocking[2, axes] = np.linalg.solve((turned.T + own * np.eye(AXES))[np.ix_(axes, axes)], felt[axes])
        return rocking

    def change(time: float, leaning: FloatArray) -> FloatArray:
        return rocks(time, leaning[:AXES], leaning[AXES:])[1:].ravel()

    run = solve_ivp(
        change, (0.0, state.time[-1]), np.zeros(2 * AXES), t_eval=state.time, max_step=STEP, method="RK23"
    )
    got = effect.columns(state)[:, :, 0]
    late = range(PERIOD, 2 * PERIOD, 10)  # what the foot began with is forgotten
    wanted = []
    for k in late:
        arm = course(state.time[k])
        rocking = rocks(state.time[k], run.y[:AXES, k], run.y[AXES:, k])
        wanted.append((torque(rocking, arm) - torque(np.zeros((3, AXES)), arm))[AXES:])
    missed = np.linalg.norm(got[late] - np.array(wanted)) / np.linalg.norm(wanted)
    assert missed < most


def motion_of(state: State) -> tuple[FloatArray, FloatArray, FloatArray]:
    return state.position, state.velocity, state.acceleration
