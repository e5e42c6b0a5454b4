"""Columns of the vocabulary against formulas and references that share no code with them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio
import pytest
from scipy.integrate import solve_ivp

import robots
from ident import RegressorModel, effects
from ident.effects import State
from ident.effects.drifting_friction import DRIFTING_FRICTION
from ident.effects.entry import EffectEntry
from ident.effects.family import Place
from ident.effects.placed import Family, Placed
from ident.effects.state import Asked
from ident.effects.temperature_viscous_friction import TEMPERATURE_VISCOUS_FRICTION
from ident.effects.usual import friction_sign
from ident.effects.vocabulary import VOCABULARY, effect_from, entry_of, family_named
from ident.errors import IdentificationError
from ident.parameters.present import Present
from ident.signals import low_pass
from robots import rigid_body_model
from robots.arrays import FloatArray
from robots.description import Robot

TX40, EMPS = robots.load("tx40"), robots.load("emps")
SIGN = friction_sign(TX40)
BACK = np.linalg.inv(TX40.transmission_matrix)
STEP = 0.002
NAMES = [family.name for family in VOCABULARY]


@cache
def present(name: str) -> Present:
    model = RegressorModel.of(robots.load(name))
    return Present(model, model.prior())


def at(robot: Robot, time: FloatArray) -> State:
    """A smooth motion of all joints with its exact derivatives."""
    k = np.arange(robot.n)
    w = 2 * np.pi * (0.6 + 0.17 * k)
    size = 0.08 * (robot.upper - robot.lower)
    phase = time[:, np.newaxis] * w + 0.7 * k
    return State(
        np.array(robot.home) + size * np.sin(phase),
        size * w * np.cos(phase),
        -size * w**2 * np.sin(phase),
        time,
        10.0 * np.cos(phase),
    )


TIME = np.arange(0.0, 2.0, STEP)
MOTION = at(TX40, TIME)


def placed(name: str, place: int, *shape: float, robot: Robot = TX40) -> Placed:
    family, known = family_named(name), present(robot.name)
    model = Present(replace(known.model, robot=robot), known.standard)
    return family.effect(robot, family.places(robot)[place], shape, model)


def unfiltered(robot: Robot) -> Robot:
    """The arm with a filter of the positions that lets everything pass."""
    settings = robot.identification.model_copy(update={"cutoff_hz": 1e9})
    return robot.model_copy(update={"identification": settings})


def middle(family: Family, robot: Robot, place: Place) -> tuple[float, ...]:
    return tuple(shape.grid[len(shape.grid) // 2] for shape in family.shapes(robot, place))


def on_joints(row: FloatArray, *values: FloatArray) -> FloatArray:
    return np.einsum("ps,j->sjp", np.array(values), row)


# All of them


def test_every_file_of_an_effect_is_found() -> None:
    """One that forgets its row, or takes that of another, is not lost without a word."""
    files = [path.read_text() for path in Path(effects.__path__[0]).glob("*.py")]
    says = (" = Family(\n", " = replace(\n", "late_form(_")
    declared = sum(text.count(word) for text in files for word in says)
    forms = {id(form) for family in VOCABULARY for form in family.nested}
    assert declared == len(forms)
    assert len(NAMES) == len(set(NAMES)) == len({family.row for family in VOCABULARY})
    assert NAMES[0] == "viscous_friction" and NAMES[-1] == "contact"


@pytest.mark.parametrize("robot", [TX40, EMPS], ids=lambda robot: robot.name)
@pytest.mark.parametrize("family", VOCABULARY, ids=NAMES)
def test_a_family_is_whole_at_every_place(family: Family, robot: Robot) -> None:
    state = at(robot, TIME[:200])
    names: list[str] = []
    assert set(family.confused_with) <= set(NAMES) - {family.name}
    assert family.equation, "how its torque is made, for docs/reference/effects.md"
    for place in family.places(robot):
        for shape in family.shapes(robot, place):
            inside = [shape.lower <= value <= shape.upper for value in shape.grid]
            assert all(inside), (place, shape)
            assert not shape.logarithmic or shape.lower > 0
        effect = family.effect(robot, place, middle(family, robot, place), present(robot.name))
        count = len(effect.parameters)
        assert len(effect.units) == len(effect.bounds) == count
        assert all(low < high for low, high in effect.bounds)
        assert all(index < count for index in family.essential)
        names += [one.name for one in effect.parameters]
        columns = effect.columns(state)
        assert columns.shape == (200, robot.n, count)
        assert np.isfinite(columns).all()
        np.testing.assert_array_equal(columns, effect.columns(state))
        assert effect_from(robot, entry_of(robot, effect), present(robot.name)).shape == effect.shape
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("family", VOCABULARY, ids=NAMES)
def test_an_effect_is_something_in_the_simulation(family: Family) -> None:
    place = family.places(TX40)[-1]
    effect = family.effect(TX40, place, middle(family, TX40, place), present("tx40"))
    parts = effect.simulated(np.full(len(effect.parameters), 0.1))
    assert any(value is not None and len(value) for value in vars(parts).values())


@pytest.mark.parametrize("name", [n for n in NAMES if "friction" in n and n != "static_friction"])
def test_friction_of_a_drive_that_stands_still_is_nothing(name: str) -> None:
    still = MOTION.velocity.copy()
    still[:, 2] = 0.0
    effect = placed(name, 2, *middle(family_named(name), TX40, Place("drive", (2,))))
    assert not effect.columns(replace(MOTION, velocity=still)).any()
    assert effect.columns(MOTION)[:, 2].any()
    assert not effect.columns(MOTION)[:, [0, 1, 3, 4, 5]].any()


@pytest.mark.parametrize("name", ["viscous_friction", "coulomb_friction", "rotor_inertia", "torque_ripple"])
def test_a_coupled_drive_loads_both_its_joints(name: str) -> None:
    """Drive 6 turns with q5 + q6."""
    effect = placed(name, 5, *middle(family_named(name), TX40, Place("drive", (5,))))
    columns = effect.columns(MOTION)
    np.testing.assert_array_equal(columns[:, 4], columns[:, 5])
    assert columns[:, 4].any()
    assert not columns[:, :4].any()


# Friction


def bent(position: np.ndarray, length: float) -> np.ndarray:
    """Dahl's bristle, integrated in small steps of the way; it begins as its drive has drawn it."""
    state, steps = np.zeros(position.size), 200
    state[0] = np.sign(position[1] - position[0])
    for k in range(1, position.size):
        way, z = (position[k] - position[k - 1]) / steps, state[k - 1]
        for _ in range(steps):
            middle = z + 0.5 * way / length * (1.0 - z * np.sign(way))
            z += way / length * (1.0 - middle * np.sign(way))
        state[k] = z
    return state


def warmth(joint: int, lag: float, until: FloatArray = TIME) -> FloatArray:
    """W: the power of a joint's described friction behind a lag, by a solver of differential equations."""
    model = present("tx40")
    dry, viscous = (model.standard[model.model.names.index(f"{s}{joint + 1}")] for s in ("Fc", "Fv"))

    def slope(t: float, w: FloatArray) -> FloatArray:
        speed = abs(float(at(TX40, np.array([t])).velocity[0, joint]))
        return np.asarray((dry * speed + viscous * speed**2 - w) / lag)

    run = solve_ivp(slope, (0.0, until[-1]), [0.0], t_eval=until, max_step=0.02, rtol=1e-7, atol=1e-9)
    return np.asarray(run.y[0])


def test_friction_over_speed() -> None:
    v = MOTION.velocity[:, 2]
    row = np.eye(6)[2]
    limit = TX40.velocity_limits[2]
    fade = np.exp(-TIME / 8.0)
    sign = SIGN(v)
    warm = warmth(2, 8.0)
    cases = [
        (placed("viscous_friction", 2), [v]),
        (placed("coulomb_friction", 2), [sign]),
        (placed("asymmetric_friction", 2), [np.abs(sign), np.abs(v)]),
        (placed("stribeck_friction", 2, 0.3, 2.0), [sign * np.exp(-((v / 0.3) ** 2))]),
        (placed("stribeck_friction", 2, 0.3, 1.0), [sign * np.exp(-np.abs(v) / 0.3)]),
        (
            placed("static_friction", 2, 0.01, 4e-4),
            [sign * np.exp(-((v / 0.01) ** 2)), bent(MOTION.position[:, 2], 4e-4) - sign],
        ),
        (placed("nonlinear_viscous_friction", 2, 0.5), [sign * np.sqrt(np.abs(v) / limit), v]),
        (placed("nonlinear_viscous_friction", 2, 3.0), [sign * np.abs(v / limit) ** 3, v]),
        (placed("drifting_friction", 2, 8.0), [fade * sign, fade * v, warm * sign, warm * v]),
        (placed("temperature_viscous_friction", 2, 8.0), [fade * v, warm * v]),
        (placed("rotor_inertia", 2), [MOTION.acceleration[:, 2]]),
        (placed("current_offset", 2), [np.ones_like(v)]),
    ]
    for effect, values in cases:
        loose = {"static_friction": 1e-3, "drifting_friction": 0.01, "temperature_viscous_friction": 0.01}
        np.testing.assert_allclose(
            effect.columns(MOTION), on_joints(row, *values), atol=loose.get(effect.name, 1e-12)
        )


def test_a_gear_is_heated_by_its_own_friction() -> None:
    """Each gear by that of its drive, and as if it had moved like that before a later recording began."""
    time = np.arange(0.0, 20.0, 0.01)
    whole = at(TX40, time)
    effect = placed("drifting_friction", 2, 3.0)
    heated = effect.columns(whole)[:, 2, 3] / whole.velocity[:, 2]
    wanted = warmth(2, 3.0, time)
    np.testing.assert_allclose(heated, wanted, atol=0.01 * wanted.max())
    assert wanted.max() > 5.0
    late = time >= 4.0
    later = State(*(x[late] for x in (whole.position, whole.velocity, whole.acceleration, time)))
    again = effect.columns(later)[:, 2, 3] / later.velocity[:, 2]
    assert again[0] == pytest.approx(wanted[late][0], rel=0.1)
    np.testing.assert_allclose(again, wanted[late], atol=0.1 * wanted.max())
    still = replace(whole, velocity=np.where(np.arange(6) == 2, 0.0, whole.velocity))
    assert not effect.columns(still).any()


def test_where_no_time_is_known_a_gear_is_as_cold_as_at_the_start() -> None:
    columns = placed("drifting_friction", 2, 8.0).columns(replace(MOTION, time=None))
    v = MOTION.velocity[:, 2]
    nothing = np.zeros_like(v)
    np.testing.assert_allclose(columns, on_joints(np.eye(6)[2], SIGN(v), v, nothing, nothing), atol=1e-12)


def test_waves_of_what_slides_are_counted_over_its_travel() -> None:
    """Per metre as per radian a wave over 0.6 m was Coulomb friction, and could not be told from it."""
    (shape,) = family_named("position_dependent_friction").shapes(EMPS, Place("drive", (0,)))
    assert shape.unit == "1/m"
    q = np.linspace(EMPS.lower[0], EMPS.upper[0], 200)
    turn = 2.0 * np.pi / 0.6
    assert (shape.lower, shape.upper) == pytest.approx((0.5 * turn, 8.0 * turn), rel=1e-3)
    for waves in shape.grid:
        columns = np.column_stack([np.cos(waves * q), np.sin(waves * q)])
        left = np.ones_like(q) - columns @ np.linalg.lstsq(columns, np.ones_like(q))[0]
        assert np.std(left) > 0.2 or np.mean(left) > 0.2
    (turning,) = family_named("position_dependent_friction").shapes(TX40, Place("drive", (0,)))
    assert turning.unit == "1/rad" and (turning.lower, turning.upper) == (0.5, 8.0)


def test_friction_over_position_and_load() -> None:
    q, v = MOTION.position[:, 1], MOTION.velocity[:, 1]
    row = np.eye(6)[1]
    wave = placed("position_dependent_friction", 1, 3.0).columns(MOTION)
    expected = on_joints(row, SIGN(v) * np.cos(3 * q), SIGN(v) * np.sin(3 * q))
    np.testing.assert_allclose(wave, expected, atol=1e-12)
    model, data = rigid_body_model(TX40), rigid_body_model(TX40).createData()
    load = [
        pinocchio.rnea(model, data, *motion)[1]
        for motion in zip(MOTION.position, MOTION.velocity, MOTION.acceleration, strict=True)
    ]
    got = placed("load_dependent_friction", 1, 0.0).columns(MOTION)
    np.testing.assert_allclose(got, on_joints(row, np.abs(load) * SIGN(v)), atol=1e-9)
    # Of an efficiency each way: 0.3 of the load while the gear lifts it, 0.1 while it lets it down.
    taken = placed("directional_efficiency", 1, 0.0).columns(MOTION)[:, 1] @ np.array([0.2, 0.1])
    sliding = np.abs(v) > 0.1
    share = np.where(np.array(load) * v > 0, 0.3, 0.1)
    np.testing.assert_allclose(taken[sliding], (share * np.abs(load) * np.sign(v))[sliding], atol=1e-9)


# Motors and drives


def test_ripple_turns_with_the_motor() -> None:
    q = MOTION.position[:, 2]
    got = placed("torque_ripple", 2, 2.0, 0.0, robot=unfiltered(TX40)).columns(MOTION)
    waves = np.array([np.cos(2 * 45 * q), np.sin(2 * 45 * q)])
    np.testing.assert_allclose(got, on_joints(np.eye(6)[2], *waves), atol=1e-12)
    torque = present("tx40").torque(MOTION)[:, 2]  # of a drive of its own joint
    share = placed("torque_ripple", 2, 2.0, 1.0, robot=unfiltered(TX40)).columns(MOTION)
    np.testing.assert_allclose(share, on_joints(np.eye(6)[2], *(-torque * waves)), atol=1e-9)


@pytest.mark.parametrize("name", ["torque_ripple", "gear_ripple"])
def test_a_motor_of_a_slide_turns_so_often_per_metre(name: str) -> None:
    """EMPS: 400 turns per metre, so once per turn comes again after 2.5 mm."""
    robot, time = unfiltered(EMPS), np.arange(0.0, 0.5, 1e-3)
    q = 0.02 * time[:, np.newaxis]
    state = State(q, np.full_like(q, 0.02), np.zeros_like(q), time)
    got = placed(name, 0, 1.0, 0.0 if name == "torque_ripple" else 1000.0, robot=robot).columns(state)
    per_turn = round(1.0 / 400.0 / 0.02 / 1e-3)
    np.testing.assert_allclose(got[per_turn:], got[:-per_turn], atol=1e-3 * np.abs(got).max())
    assert not np.allclose(got[per_turn // 2 :], got[: -(per_turn // 2)], atol=0.5 * np.abs(got).max())


def test_a_spring_between_anchors_has_the_torque_of_its_energy() -> None:
    """By numbers: dU/dq of U = k (L − L₀)²/2 with the anchors as points in the plane."""
    fixed, moving, free, k, angle = 0.25, 0.1, 0.12, 80.0, 0.3
    shape = {"anchor_angle": angle, "moving_radius": moving / fixed, "free_length": free / fixed}
    spring = effect_from(TX40, EffectEntry("gravity_spring", (2,), shape), present("tx40"))

    def energy(q: FloatArray) -> FloatArray:
        anchor = fixed * np.array([np.cos(angle), np.sin(angle)])
        end = moving * np.stack([np.cos(q), np.sin(q)], axis=-1)
        return np.asarray(0.5 * k * (np.linalg.norm(end - anchor, axis=-1) - free) ** 2)

    q, step = MOTION.position[:, 1], 1e-5
    wanted = (energy(q + step) - energy(q - step)) / (2 * step)
    got = k * fixed * moving * spring.columns(MOTION)[:, 1, 0]
    np.testing.assert_allclose(got, wanted, atol=1e-6 * np.abs(wanted).max())
    assert entry_of(TX40, spring).shape == shape


def test_a_foot_of_a_model_from_before_has_the_damping_that_it_had() -> None:
    shape = {"compliance": 2e-5, "about": 1.0, "foot_inertia": 0.5}
    foot = effect_from(TX40, EffectEntry("base_compliance", (), shape), present("tx40"))
    assert foot.shape == (2e-5, 1.0, 0.5, 0.05)
    damped = effect_from(
        TX40, EffectEntry("base_compliance", (), {**shape, "damping_ratio": 0.02}), present("tx40")
    )
    assert damped.shape[-1] == 0.02
    with pytest.raises(IdentificationError, match="allowed: compliance"):
        effect_from(TX40, EffectEntry("base_compliance", (), {"compliance": 2e-5}), present("tx40"))


def test_a_tight_spot_is_a_bell_over_the_position() -> None:
    q, v = MOTION.position[:, 1], MOTION.velocity[:, 1]
    entry = EffectEntry("position_dependent_friction", (2,), {"spot_centre": 0.2, "spot_width": 0.1})
    spot = effect_from(TX40, entry, present("tx40"))
    bell = np.exp(-0.5 * ((q - 0.2) / 0.1) ** 2)
    np.testing.assert_allclose(spot.columns(MOTION), on_joints(np.eye(6)[1], SIGN(v) * bell), atol=1e-12)
    assert entry_of(TX40, spot) == entry


def test_a_gain_error_lacks_a_share_of_one_drive_s_torque() -> None:
    """All drives' columns together are the whole torque; each falls on the joints of its drive alone."""
    torque = present("tx40").torque(MOTION)
    parts = [placed("drive_gain_error", drive).columns(MOTION)[:, :, 0] for drive in range(6)]
    np.testing.assert_allclose(sum(parts), -torque, atol=1e-9)
    np.testing.assert_allclose(parts[4][:, 5], 0.0, atol=1e-12)
    assert np.abs(parts[5][:, 4]).max() > 0.1


def test_saturation_takes_what_is_asked_beyond_the_limit() -> None:
    assert MOTION.torque is not None
    got = placed("saturation", 0, 6.0).columns(MOTION)[:, :, 0]
    asked = MOTION.torque[:, 0]
    expected = np.where(np.abs(asked) > 6.0, asked - 6.0 * np.sign(asked), 0.0)
    np.testing.assert_allclose(got, on_joints(np.eye(6)[0], expected)[:, :, 0], atol=1e-12)
    assert 0.1 < (expected != 0).mean() < 0.9


@pytest.mark.parametrize(("name", "shape"), [("saturation", (6.0,)), ("command_dead_zone", ())])
def test_what_a_drive_makes_of_its_signal_it_makes_before_any_filter(
    name: str, shape: tuple[float, ...]
) -> None:
    """A corner of the signal is seen through the filter; a filtered signal has other corners."""
    torque = MOTION.torque
    assert torque is not None and MOTION.time is not None
    rough = torque + 4.0 * np.sin(2 * np.pi * 60.0 * MOTION.time)[:, np.newaxis]

    def seen(made: FloatArray) -> FloatArray:
        return low_pass(made, 20.0, float(MOTION.time[1] - MOTION.time[0]), 4)

    state = replace(MOTION, torque=seen(rough), asked=Asked(rough, seen))
    got = placed(name, 0, *shape).columns(state)[:, 0, 0]
    asked = rough[:, :1]
    made = np.sign(asked) if name == "command_dead_zone" else asked - np.clip(asked, -6.0, 6.0)
    np.testing.assert_allclose(got, seen(made)[:, 0], atol=1e-9)
    some = state.part(slice(100, None, 2))
    np.testing.assert_allclose(placed(name, 0, *shape).columns(some)[:, 0, 0], got[100::2], atol=1e-9)
    none = state.with_torque(rough)
    assert none.asked is None and none.torque is rough


def test_a_dead_zone_takes_the_direction_in_which_the_drive_was_asked() -> None:
    """While a drive passes its dead zone no torque acts, and the model's own passes zero at another time."""
    model = present("tx40").torque(MOTION)
    late = np.roll(model, model.shape[0] // 20, axis=0)
    asked, planned = (
        placed("command_dead_zone", 0).columns(replace(MOTION, torque=torque))[:, 0, 0]
        for torque in (late, None)
    )
    assert np.mean(np.sign(asked) == np.sign(late[:, 0])) > 0.99
    assert np.mean(np.sign(planned) == np.sign(model[:, 0])) > 0.99
    assert np.mean(np.sign(asked) == np.sign(planned)) < 0.95


def test_a_lag_leads_by_the_torque_s_rate() -> None:
    """Against differences of the model's torque on the same motion a little earlier and later."""
    model, h = present("tx40"), 1e-4
    rate = (model.torque(at(TX40, TIME + h)) - model.torque(at(TX40, TIME - h))) / (2 * h)
    got = placed("current_loop_lag", 0).columns(MOTION)[:, :, 0]
    away = (np.abs(MOTION.velocity) > 0.3 * np.abs(MOTION.velocity).max(axis=0))[1:-1, 0]
    np.testing.assert_allclose(got[1:-1, 0][away], rate[1:-1, 0][away], atol=0.02 * np.abs(rate).max())
    assert not got[:, 1:].any()


@pytest.mark.parametrize("drive", range(6))
def test_a_late_control_signal_is_that_of_a_motion_before(drive: int) -> None:
    """Of one drive alone: the others tell of the motion as it is."""
    model, delay, inner = present("tx40"), -0.003, slice(10, -10)
    change = (model.torque(at(TX40, TIME + delay)) - model.torque(MOTION))[inner]
    of_drives = change @ BACK
    wanted = np.outer(of_drives[:, drive], TX40.transmission_matrix[drive])
    got = delay * placed("time_delay", 1 + drive, delay, robot=unfiltered(TX40)).columns(MOTION)[inner, :, 0]
    np.testing.assert_allclose(got, wanted, atol=1e-3 * np.abs(wanted).max())


def test_a_late_position_is_a_motion_farther_on() -> None:
    """The torque is that of the same motion a little later, which the trajectory's formula knows."""
    model, delay = present("tx40"), 0.008
    inner = slice(10, -10)
    later = at(TX40, TIME + delay)
    wanted = (model.torque(later) - model.torque(MOTION))[inner]
    got = delay * placed("time_delay", 0, delay, robot=unfiltered(TX40)).columns(MOTION)[inner, :, 0]
    np.testing.assert_allclose(got, wanted, atol=1e-3 * np.abs(wanted).max())
    # One drive alone: joint 6 turns by what drive 6 is late, for drive 5 is not.
    moved = {
        name: getattr(MOTION, name)
        + ((getattr(later, name) - getattr(MOTION, name)) @ TX40.transmission_matrix[5])[:, np.newaxis]
        * BACK[:, 5]
        for name in ("position", "velocity", "acceleration")
    }
    wanted = (model.torque(State(**moved)) - model.torque(MOTION))[inner]
    got = delay * placed("time_delay", 6, delay, robot=unfiltered(TX40)).columns(MOTION)[inner, :, 0]
    np.testing.assert_allclose(got, wanted, atol=1e-3 * np.abs(wanted).max())


@pytest.mark.parametrize(
    ("name", "place", "shape"), [("time_delay", 5, (-0.004,)), ("current_loop_lag", 4, ())]
)
def test_noise_of_positions_hardly_shrinks_a_late_torque(
    name: str, place: int, shape: tuple[float, ...]
) -> None:
    """Fitted to the true torque, the column of a noisy motion gets its factor: 1 where it is as good as true.

    The noise is that of an encoder through the filter of the positions: at joint 5 its accelerations are as
    large as those of the motion.
    """
    noise = np.random.default_rng(0).normal(0.0, 5e-5, (TIME.size, 1)) * np.eye(6)[4]
    settings = TX40.identification
    heard = low_pass(noise, settings.cutoff_hz, STEP, settings.filter_order)
    speed = np.gradient(heard, STEP, axis=0)
    noisy = State(
        MOTION.position + heard,
        MOTION.velocity + speed,
        MOTION.acceleration + np.gradient(speed, STEP, axis=0),
        TIME,
    )
    away = np.abs(MOTION.velocity[:, 4]) > 0.3 * np.abs(MOTION.velocity[:, 4]).max()
    true, seen = (placed(name, place, *shape).columns(state)[away, 4, 0] for state in (MOTION, noisy))
    assert 0.95 < float(true @ seen / (seen @ seen)) < 1.05


def test_a_search_may_pass_through_no_delay() -> None:
    least = placed("time_delay", 0, 1e-4).columns(MOTION)
    np.testing.assert_array_equal(placed("time_delay", 0, 0.0).columns(MOTION), least)
    rate = placed("time_delay", 0, -1e-4).columns(MOTION)
    drives = MOTION.velocity @ TX40.transmission_matrix.T
    away = np.abs(drives).min(axis=1) > 0.2  # of reversals, whose friction is not linear in anything
    away[[0, -1]] = False  # beyond them there is no motion
    np.testing.assert_allclose(rate[away], least[away], atol=0.01 * np.abs(least[away]).max())


# Gears, on one carriage of 95 kg: m(θ̈ − ẍ) passes through the gear


def test_elasticity_is_a_second_mass_behind_a_spring() -> None:
    family = family_named("joint_elasticity")
    robot, time = EMPS, np.arange(0.0, 2.0, 0.001)
    mass, frequency, ratio = 95.1, 12.0, 0.08
    stiffness = mass * (2 * np.pi * frequency) ** 2
    effect = family.effect(robot, family.places(robot)[0], (1 / stiffness, ratio), present("emps"))
    state = at(robot, time)
    w, size = 2 * np.pi * 0.6, 0.08 * 0.6

    def link(t: float, s: FloatArray) -> list[float]:
        ahead, faster = size * np.sin(w * t) - s[0], size * w * np.cos(w * t) - s[1]
        return [s[1], (stiffness * ahead + 2 * ratio * np.sqrt(stiffness * mass) * faster) / mass]

    before = -2.0  # the motion went on before it was recorded
    start = [size * np.sin(w * before), size * w * np.cos(w * before)]
    run = solve_ivp(link, (before, time[-1]), start, t_eval=time, rtol=1e-9, atol=1e-12)
    through = mass * np.array([link(t, s)[1] for t, s in zip(time, run.y.T, strict=True)])
    change = (through - mass * state.acceleration[:, 0])[:, np.newaxis]
    settings = robot.identification
    wanted = low_pass(change, settings.cutoff_hz, 0.001, settings.filter_order)[:, 0]
    got = effect.columns(state)[:, 0, 0]
    assert np.abs(wanted).max() > 0.15
    np.testing.assert_allclose(got, wanted, atol=0.01 * np.abs(wanted).max())


FLANK = 95.1 * (2 * np.pi * EMPS.identification.cutoff_hz) ** 2
"""N/m, on which the carriage swings at the cut-off of the positions."""


def test_play_lets_the_carriage_fly_between_the_flanks() -> None:
    """In flight no torque passes the gear, so the column takes off all that rigid links would take."""
    state = at(EMPS, np.arange(0.0, 2.0, 0.001))
    got = placed("backlash", 0, 0.004, 0.0, FLANK, 0.3, robot=EMPS).columns(state)[:, 0, 0]
    rigid = 95.1 * state.acceleration[:, 0]
    turning = int(np.flatnonzero(np.diff(np.sign(rigid[100:])))[0]) + 100
    flight = turning + np.arange(15, 40)  # 4 mm at this jerk take a tenth of a second
    np.testing.assert_allclose(got[flight], -rigid[flight], atol=0.03 * np.abs(rigid).max())
    pressed = turning - 60 + np.arange(30)
    assert np.abs(got[pressed]).max() < 0.1 * np.abs(rigid).max()


RIGID = 1e6
"""Hz; a gear that does not give way."""


def test_a_kinematic_error_moves_the_load_and_is_a_lever() -> None:
    """q = u + e(u): Lagrange gives the input (1 + e′) m q̈; to first order m ë + e′ m ü."""
    state = at(EMPS, TIME)
    waves, mass = 2 * np.pi * 400.0, 95.1
    q, v, a = (x[:, 0] for x in (state.position, state.velocity, state.acceleration))
    cos, sin = np.cos(waves * q), np.sin(waves * q)
    wanted = [
        2 * mass * waves * slope * a + mass * waves**2 * bend * v**2
        for slope, bend in ((-sin, -cos), (cos, -sin))
    ]
    got = placed("gear_ripple", 0, 1.0, RIGID, robot=unfiltered(EMPS)).columns(state)[:, 0]
    np.testing.assert_allclose(got, np.array(wanted).T, atol=2e-3 * np.abs(wanted).max())


@pytest.mark.parametrize("inertia", [1.0, 2.0])
def test_links_on_a_gear_that_gives_way_move_by_more_than_its_error(inertia: float) -> None:
    """At a constant speed the error has one frequency f; the links swing on the held drive at f₀."""
    time = np.arange(0.0, 4.0, 0.002)
    still = np.zeros((time.size, 1))
    waves, speed, resonance = 2 * np.pi * EMPS.drive[0].gear, 0.25 / (2 * np.pi), 60.0
    state = State(speed * time[:, np.newaxis], still + speed, still, time)
    # The resonance is that of the described carriage; a heavier one swings more slowly.
    model = present("emps")
    links = model.standard.copy()
    links[0] *= inertia
    family, robot = family_named("gear_ripple"), unfiltered(EMPS)
    heavier = Present(model.model, links)
    rigid, given = (
        family.effect(robot, family.places(robot)[0], (1.0, f), heavier).columns(state)[:, 0]
        for f in (RIGID, resonance)
    )
    ratio = waves * speed / (2 * np.pi) / resonance
    np.testing.assert_allclose(given, rigid / (1.0 - inertia * ratio**2), rtol=1e-6, atol=1e-9)


# Loads


def test_a_payload_is_a_body_of_the_last_link() -> None:
    """Against pin, with the body welded to the wrist: mass and first moments about its frame."""
    mass, centre = 0.8, np.array([0.03, -0.02, 0.1])
    effect = placed("payload", 0)
    symbols = [name.removesuffix("_payload") for name in [one.name for one in effect.parameters]]
    inertia = mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    figures = dict(zip(("M", "MX", "MY", "MZ"), (mass, *(mass * centre)), strict=True)) | {
        f"{a}{b}": inertia[i, j] for i, a in enumerate("XYZ") for j, b in enumerate("XYZ")
    }
    values = np.array([figures[symbol] for symbol in symbols])
    model = rigid_body_model(TX40)
    loaded = model.copy()
    ten = np.concatenate([[mass], mass * centre, inertia[np.tril_indices(3)]])
    loaded.inertias[6] = pinocchio.Inertia.FromDynamicParameters(
        model.inertias[6].toDynamicParameters() + ten
    )
    motions = list(zip(MOTION.position, MOTION.velocity, MOTION.acceleration, strict=True))[::20]
    wanted = [
        pinocchio.rnea(loaded, loaded.createData(), *m) - pinocchio.rnea(model, model.createData(), *m)
        for m in motions
    ]
    got = effect.columns(MOTION)[::20] @ values
    np.testing.assert_allclose(got, wanted, atol=1e-9)
    assert np.abs(wanted).max() > 0.5


def test_a_tilted_base_turns_gravity() -> None:
    """Against pin with the base itself turned about its x axis, then about y."""
    model = rigid_body_model(TX40)
    columns = placed("base_tilt", 0).columns(MOTION)
    small = 1e-4
    for k, axis in enumerate(np.eye(3)[:2]):
        turn = pinocchio.AngleAxis(small, axis).toRotationMatrix()
        tilted = model.copy()
        tilted.gravity.linear = turn.T @ np.array(TX40.gravity)  # gravity as the turned base sees it
        for sample in range(0, TIME.size, 100):
            q = MOTION.position[sample]
            wanted = pinocchio.computeGeneralizedGravity(tilted, tilted.createData(), q)
            wanted = wanted - pinocchio.computeGeneralizedGravity(model, model.createData(), q)
            np.testing.assert_allclose(columns[sample, :, k], wanted / small, atol=1e-2)


def test_springs_and_a_contact() -> None:
    q = MOTION.position[:, 1]
    row = np.eye(6)[1]
    cases = [
        (placed("gravity_spring", 1), [q, np.ones_like(q)]),
        (placed("cable_spring", 1, 0.2), [q - 0.2, (q - 0.2) ** 3]),
        (placed("contact", 1, 0.1, 1.0), [np.maximum(q - 0.1, 0.0)]),
        (placed("contact", 1, 0.1, -1.0), [np.minimum(q - 0.1, 0.0)]),
    ]
    for effect, values in cases:
        np.testing.assert_allclose(effect.columns(MOTION), on_joints(row, *values), atol=1e-12)


# Coupled axes


def test_a_shaft_between_joints_that_nothing_describes() -> None:
    """T = ½ J (r q̇1 + q̇2)²: its inertia acts on both joints, diagonal and between."""
    ratio, row = -0.5, np.array([-0.5, 1.0, 0.0, 0.0, 0.0, 0.0])
    got = placed("wrist_coupling", 0, ratio).columns(MOTION)
    a, v = MOTION.acceleration @ row, MOTION.velocity @ row
    np.testing.assert_allclose(got, on_joints(row, a, v, SIGN(v)), atol=1e-12)


def test_a_described_shaft_has_its_own_share_in_the_usual_model_already() -> None:
    """The same columns as the usual model's, which gives Ia and Fv of both joints the diagonal."""
    got = placed("wrist_coupling", 4, 1.0).columns(MOTION)
    usual = next(e for e in RegressorModel.of(TX40).effects if e.name == "wrist_coupling")
    np.testing.assert_allclose(got, usual.columns(MOTION), atol=1e-12)


# As plain values


def test_what_is_not_in_the_vocabulary_is_refused_in_one_line() -> None:
    with pytest.raises(IdentificationError, match="effect sticktion is not in the vocabulary; allowed: vis"):
        family_named("sticktion")
    model = present("tx40")
    with pytest.raises(IdentificationError, match=r"contact at joints \[7\]; allowed: 1; 2; 3; 4; 5; 6"):
        effect_from(TX40, EffectEntry("contact", (7,), {}), model)
    with pytest.raises(IdentificationError, match=r"hysteresis with shape \['gap'\]; allowed: length"):
        effect_from(TX40, EffectEntry("hysteresis", (2,), {"gap": 1.0}), model)


def test_a_placed_effect_comes_back_from_plain_values() -> None:
    effect = placed("contact", 2, 1.5, -1.0)
    entry = entry_of(TX40, effect)
    assert entry == EffectEntry("contact", (3,), {"contact_angle": 1.5, "side": -1.0})
    again = effect_from(TX40, entry, present("tx40"))
    np.testing.assert_array_equal(again.columns(MOTION), effect.columns(MOTION))


@pytest.mark.parametrize(
    "family", [DRIFTING_FRICTION, TEMPERATURE_VISCOUS_FRICTION], ids=lambda one: one.name
)
def test_friction_that_began_to_move_before_the_recording(family: Family) -> None:
    """What is recorded late of a motion has the columns that the whole motion has there."""
    begun, before = family.forms
    place = family.places(TX40)[1]
    late = TIME >= 1.2
    rest = State(
        MOTION.position[late],
        MOTION.velocity[late],
        MOTION.acceleration[late],
        TIME[late] - 1.2,
        MOTION.torque[late],
    )
    whole = begun.effect(TX40, place, (4.0,), present("tx40"))
    part = before.effect(TX40, place, (4.0, float(np.exp(-1.2 / 4.0))), present("tx40"))
    assert np.allclose(part.columns(rest), whole.columns(MOTION)[late], rtol=1e-12, atol=1e-14)
    assert not np.allclose(whole.columns(rest), part.columns(rest))


def test_a_sticking_drive_that_moves_as_the_record_begins_has_not_just_turned() -> None:
    """One row of the unknown way before was a friction of 500 N·m that comes late, with 22 nats."""
    late = placed("static_friction", 2, 0.005, 1e-4).columns(MOTION)[:, 2, 1]
    speed = MOTION.velocity[:, 2]
    first = int(np.flatnonzero(np.diff(np.sign(speed)))[0])
    assert np.abs(speed[: first - 5]).min() > 0.01 and np.abs(late[first + 1]) > 0.1
    assert np.abs(late[: first - 5]).max() < 1e-6


def test_friction_that_comes_late_is_some_of_the_friction_that_there_is() -> None:
    """5.2 ± 2.8 N·m of a drive that has 0.7 had the simulated loop of a right name farther from the arm."""
    model = present("tx40")
    known = Present(replace(model.model, robot=TX40), model.standard).drive_friction(2)[0]
    effect = placed("static_friction", 2, 0.005, 1e-4)
    assert known > 0.0
    assert effect.bounds == ((0.0, np.inf), (0.0, pytest.approx(known)))


def test_every_time_in_which_a_brake_may_rub_again_is_near_one_that_is_tried() -> None:
    """A drag every 2.03 s was Coulomb friction, hysteresis or a spot: no period below 2.5 s was tried."""
    family = family_named("dragging_brake")
    period, share, beginning = family.shapes(TX40, family.places(TX40)[0])
    frequencies = 1.0 / np.array(period.grid)
    assert frequencies.max() == pytest.approx(1.0 / period.lower) and period.upper >= max(period.grid) - 1e-9
    assert np.abs(np.diff(frequencies)) == pytest.approx(0.1 / 20.0)
    assert period.scanned == share.scanned == beginning.scanned == "time"


def test_a_brake_rubs_in_its_part_of_each_period_alone() -> None:
    drag = placed("dragging_brake", 2, 0.5, 0.4, 0.25).columns(MOTION)[:, 2, 0]
    turns = np.mod(np.asarray(MOTION.time) / 0.5 - 0.25, 1.0)
    moving = np.abs(MOTION.velocity[:, 2]) > 0.1
    inside, outside = (turns > 0.1) & (turns < 0.3), (turns > 0.5) & (turns < 0.9)
    assert drag[moving & inside] == pytest.approx(np.sign(MOTION.velocity[moving & inside, 2]), abs=0.02)
    assert np.abs(drag[outside]).max() < 0.02
