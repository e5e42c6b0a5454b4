"""Links behind gears that give way, against an adaptive integration of the same equations by scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from ident.effects.elastic_gear import inertia_along
from ident.effects.gear_state import PARTS, Course, Gear, finer
from ident.effects.hysteresis import deflection
from robots.arrays import FloatArray

STEP = 1e-3
TIME = np.arange(0.0, 3.0, STEP)
LOAD = np.clip(TIME / 0.5, 0.0, 1.0) ** 3 * (8.0 * np.sin(6.9 * TIME) + 5.0 * np.sin(17.0 * TIME + 1.0))
INERTIA = 0.5


def reference(stiffness: float, damping: float, gap: float, cubic: float = 0.0) -> FloatArray:
    """Lag, rate and push, 3 × samples."""

    load = CubicSpline(TIME, LOAD)

    def push(time: float, lag: float, rate: float) -> float:
        beyond = lag - np.clip(lag, -0.5 * gap, 0.5 * gap)
        force = stiffness * beyond + cubic * beyond**3 + damping * rate
        touching = gap == 0.0 or force * beyond > 0.0
        return (float(load(time)) - touching * force) / INERTIA

    start = [LOAD[0] / stiffness + 0.5 * gap * np.sign(LOAD[0]), 0.0]
    run = solve_ivp(
        lambda t, s: [s[1], push(t, *s)],
        (0.0, TIME[-1]),
        start,
        t_eval=TIME,
        rtol=1e-8,
        atol=1e-10,
        max_step=1e-3,
    )
    assert run.success
    return np.vstack([run.y, [push(t, *s) for t, s in zip(TIME, run.y.T, strict=True)]])


def found(stiffness: float, damping: float, gap: float, cubic: float = 0.0) -> FloatArray:
    return lag_of_link(np.full_like(LOAD, INERTIA), LOAD, STEP, Gear(stiffness, damping, gap, cubic))


def lag_of_link(inertia: FloatArray, load: FloatArray, step: float, gear: Gear) -> FloatArray:
    return gear.lag(finer(inertia, load[:, np.newaxis]), step)


def gear(frequency: float, ratio: float) -> tuple[float, float]:
    stiffness = INERTIA * (2 * np.pi * frequency) ** 2
    return stiffness, 2 * ratio * float(np.sqrt(stiffness * INERTIA))


@pytest.mark.parametrize(("frequency", "ratio"), [(8.0, 0.0), (12.0, 0.03), (45.0, 0.03), (150.0, 0.05)])
def test_an_elastic_gear(frequency: float, ratio: float) -> None:
    stiffness, damping = gear(frequency, ratio)
    got, wanted = found(stiffness, damping, 0.0), reference(stiffness, damping, 0.0)
    missed = np.linalg.norm(got - wanted, axis=1) / np.linalg.norm(wanted, axis=1)
    assert missed[0] < 1e-3
    assert missed[2] < 0.02


def test_a_load_of_a_sixth_of_the_sampling_rate_is_wholly_felt() -> None:
    """At 250 Hz a load of 40 Hz is six points a wave; in steady state the answer is m ω²/(k − m ω²) of it."""
    stiffness, damping = gear(90.0, 0.05)
    time = np.arange(0.0, 3.0, 0.004)
    load = np.sin(2 * np.pi * 40.0 * time)
    push = lag_of_link(np.full_like(load, INERTIA), load, 0.004, Gear(stiffness, damping))[2][500:]
    speed = 2j * np.pi * 40.0
    answer = speed**2 / (INERTIA * speed**2 + damping * speed + stiffness)
    wave = 2.0 * np.mean(push * np.exp(-speed * time[500:]) * 1j)
    assert abs(wave - answer) < 0.04 * abs(answer)


def test_a_gear_that_is_not_damped_keeps_time() -> None:
    """At 250 Hz, 30 Hz for 3 s: x = F (sin Ωt − Ω/ω sin ωt) / (k − m Ω²)."""
    stiffness, _ = gear(30.0, 0.0)
    time, wave, own = np.arange(0.0, 3.0, 0.004), 2 * np.pi * 3.0, 2 * np.pi * 30.0
    load = 8.0 * np.sin(wave * time)
    lag = lag_of_link(np.full_like(load, INERTIA), load, 0.004, Gear(stiffness, 0.0))[0]
    forced = 8.0 / (stiffness - INERTIA * wave**2)
    free = -forced * wave / own * np.sin(own * time)
    missed = lag - forced * np.sin(wave * time) - free
    assert np.linalg.norm(missed) < 0.01 * np.linalg.norm(free)


@pytest.mark.parametrize("share", [0.3, 3.0])
def test_a_gear_that_stiffens(share: float) -> None:
    """The further stiffness is a share of the first at the largest way of a load that grows slowly."""
    stiffness, damping = gear(12.0, 0.03)
    cubic = share * stiffness / (13.0 / stiffness) ** 2
    got = found(stiffness, damping, 0.0, cubic)
    wanted = reference(stiffness, damping, 0.0, cubic)
    missed = np.linalg.norm(got - wanted, axis=1) / np.linalg.norm(wanted, axis=1)
    assert missed[0] < 2e-3
    assert missed[2] < 0.02
    straight = found(stiffness, damping, 0.0)
    assert np.linalg.norm(got[0] - straight[0]) > 0.05 * np.linalg.norm(straight[0])


@pytest.mark.parametrize("gap", [1e-3, 5e-3])
def test_play(gap: float) -> None:
    """Impacts multiply the smallest difference, so the way is compared and not the acceleration."""
    stiffness, damping = gear(60.0, 0.3)
    got, wanted = found(stiffness, damping, gap), reference(stiffness, damping, gap)
    assert np.abs(wanted[0]).max() > 0.5 * gap
    assert np.linalg.norm(got[0] - wanted[0]) < 0.03 * np.linalg.norm(wanted[0])
    flying = np.abs(got[0]) < 0.499 * gap
    assert 0.01 < flying.mean() < 0.5
    np.testing.assert_allclose((INERTIA * got[2] - LOAD)[flying], 0.0, atol=1e-9)  # no torque in flight


def test_a_very_stiff_gear_bends_as_in_statics() -> None:
    lag = found(1e9, 1e3, 0.0)[0]
    np.testing.assert_allclose(lag, LOAD / 1e9, atol=1e-3 * np.abs(LOAD).max() / 1e9)


def test_a_bristle_follows_dahl_and_does_not_know_the_speed() -> None:
    length = 0.05
    position = 0.2 * np.sin(2 * np.pi * 0.7 * TIME) + 0.05 * np.sin(9.0 * TIME)
    velocity = 0.2 * 2 * np.pi * 0.7 * np.cos(2 * np.pi * 0.7 * TIME) + 0.45 * np.cos(9.0 * TIME)
    run = solve_ivp(
        lambda t, z: (np.interp(t, TIME, velocity) - z * abs(np.interp(t, TIME, velocity))) / length,
        (0.0, TIME[-1]),
        [0.0],
        t_eval=TIME,
        rtol=1e-8,
        atol=1e-10,
        max_step=2e-3,
    )
    np.testing.assert_allclose(deflection(position, length), run.y[0], atol=2e-3)
    # Every second sample between the same turning points: the deflection is a matter of the way alone.
    rising = np.linspace(0.0, 0.3, 301)
    there_and_back = np.concatenate([rising, rising[-2::-1]])
    fine, coarse = deflection(there_and_back, length), deflection(there_and_back[::2], length)
    np.testing.assert_allclose(fine[::2], coarse, atol=1e-12)


def test_a_model_that_is_no_bodys_moves_no_link_from_flank_to_flank() -> None:
    """KR300: fitted parameters whose inertia is negative in most postures; lags were of 10¹⁷² rad."""
    described = 5.0
    mass = np.where(np.arange(LOAD.size) % 50 < 40, -2.0, 5.8)[:, np.newaxis, np.newaxis]
    inertia = inertia_along(mass, np.ones(1), described)
    assert inertia.min() == pytest.approx(0.01 * described)
    fine = finer(inertia, LOAD[:, np.newaxis]).felt[0]
    assert inertia.min() <= fine.min() and fine.max() <= inertia.max()
    stiffness = described * (2 * np.pi * 40.0) ** 2
    for gap in (0.0, 0.002):
        lag = lag_of_link(inertia, LOAD, STEP, Gear(stiffness, 0.02 * stiffness / 250.0, gap))[0]
        assert np.abs(lag).max() < 10.0 * (np.abs(LOAD).max() / stiffness + gap)


def test_a_link_whose_swing_is_no_number_any_more_does_not_give_way() -> None:
    """A spring that stiffens a thousand times within samples of 8 ms swings faster than its steps follow."""
    stiffness, damping = gear(12.0, 0.08)
    stiffens = Gear(stiffness, damping, cubic=1e9 * stiffness)
    load = 4.0 * LOAD[::8]
    assert not lag_of_link(np.full_like(load, INERTIA), load, 8 * STEP, stiffens).any()


def test_links_that_fly_apart_where_nothing_repeats_do_not_ring_either() -> None:
    """Torque that grows by 20 kN·m per radian of lag: a fit to what is no number ended the search."""
    before, recorded = 3000, 10000
    felt = np.zeros((4, PARTS * (before + recorded) + 1))
    felt[0], felt[1], felt[2] = INERTIA, np.sin(0.001 * np.arange(felt.shape[1])), -2e4
    carried = np.sin(0.004 * np.arange(recorded + 1))
    assert not Gear(2000.0, 0.5).lag(Course(felt, before, repeats=False), STEP, lambda: carried).any()
