"""Identification with effects that a search has found: the columns, what a refit takes up, what it gains."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import robots
from drivers.simulated import draw_truth
from drivers.simulated.offline import simulate_offline
from drivers.simulated.scenario import Scenario
from ident import Fitted, IdentificationError, Options, Recording, RegressorModel, base_parameters, identify
from ident.discrepancy.prepared_recording import thinned
from ident.effects import State
from ident.effects.entry import EffectEntry
from ident.effects.family import Place, StandardParameter
from ident.effects.found import Found, unused
from ident.effects.placed import Family
from ident.effects.vocabulary import VOCABULARY, family_named
from ident.identification.found_effects import FoundModel, end_to_end, extended_model, found_entries
from ident.identification.taken_up import without_taken_up
from ident.parameters.present import Present
from ident.preparation.observation import observe
from ident.preparation.observed_torque import observed_torque
from ident.signals import motion
from robots import Robot
from robots.arrays import FloatArray
from trajectories import plan

RISE, SPEED = 6.0, 0.05
STRIBECK = EffectEntry("stribeck_friction", (1,), {"stribeck_speed": SPEED, "exponent": 1.0})
USUAL = ("rigid_body", "rotor_inertia", "viscous_friction", "coulomb_friction", "current_offset")


@pytest.fixture(scope="module")
def rig() -> Robot:
    return robots.load("emps")


@cache
def _motion(seed: int) -> FloatArray:
    """Two periods of an exciting motion."""
    arm = robots.load("emps")
    planned = plan(arm, cycle_time=arm.bus.cycle_time, duration=3.0, seed=seed, evaluations=200, periods=2)
    return planned.position


def record(robot: Robot, scenario: dict[str, object], path: int, seed: int) -> Recording:
    """A recording of an arm with something hidden; ``path`` is the seed of its motion."""
    run = simulate_offline(
        robot,
        draw_truth(robot, 3),
        _motion(path),
        scenario=Scenario.from_dict({"format": 1, **scenario}),
        seed=seed,
    )
    return Recording("run", run.time, run.reference, run.position, run.control_signal)


@pytest.fixture(scope="module")
def clean(rig: Robot) -> Recording:
    return record(rig, {}, 0, 1)


@pytest.fixture(scope="module")
def values(rig: Robot, clean: Recording) -> dict[str, float]:
    """The parameters of the arm with nothing hidden."""
    parameters = identify(rig, (clean,)).result.least_squares.parameters
    return {parameter.name: parameter.value for parameter in parameters}


def known(values: dict[str, float], *entries: EffectEntry, **more: float) -> FoundModel:
    return FoundModel("why.model.toml", USUAL, entries, values | more)


@pytest.fixture(scope="module")
def rubbing(rig: Robot) -> tuple[Recording, Recording]:
    """To fit and to predict: friction that rises where the carriage is slow."""
    hidden: dict[str, object] = {"stribeck_friction": [{"drive": 1, "rise": RISE, "speed": SPEED}]}
    return record(rig, hidden, 0, 2), record(rig, hidden, 1, 3)


def _dry_friction() -> float:
    """Fc of the arm that is driven, of which the rise is a multiple."""
    return float(draw_truth(robots.load("emps"), 3).parameters["Fc1"])


@pytest.fixture(scope="module")
def both(rig: Robot, rubbing: tuple[Recording, Recording], values: dict[str, float]) -> tuple[Fitted, Fitted]:
    """Without the effect, and with it."""
    fit, other = rubbing
    plain = identify(rig, (fit,), options=Options(validation=(other,)))
    whole = Options(validation=(other,), found=known(values, STRIBECK, Fs1=100.0))
    return plain, identify(rig, (fit,), options=whole)


def test_the_effect_lowers_the_error_of_what_was_not_fitted(both: tuple[Fitted, Fitted]) -> None:
    plain, whole = (fitted.result for fitted in both)
    before, after = (result.held_out[0].relative_error_percent for result in (plain, whole))
    assert after < 0.75 * before
    rise = next(p for p in whole.least_squares.parameters if p.name == "Fs1")
    assert rise.value == pytest.approx(RISE * _dry_friction(), rel=0.25)
    assert whole.found == (STRIBECK,) and plain.found == ()
    assert whole.least_squares.parameters[-1].name == "Fs1"


def test_the_simulation_behind_the_instruments_has_the_effect(both: tuple[Fitted, Fitted]) -> None:
    """Gate 1 asks whether the simulated arm is the real one."""
    plain, whole = (fitted.result.test for fitted in both)
    assert plain.verdict == "instruments_invalid"
    assert whole.gates[0].passed and whole.verdict in {"endogenous", "exogenous"}


def test_the_same_model_gives_the_same_bits(
    rig: Robot, rubbing: tuple[Recording, Recording], values: dict[str, float], both: tuple[Fitted, Fitted]
) -> None:
    again = identify(rig, rubbing[:1], options=Options(found=known(dict(values), STRIBECK, Fs1=100.0)))
    for one, other in zip(again.result.estimates, both[1].result.estimates, strict=True):
        np.testing.assert_array_equal(one.values, other.values)
        np.testing.assert_array_equal(one.covariance, other.covariance)


@pytest.mark.parametrize(
    "family",
    [family for family in VOCABULARY if family.places(robots.load("emps"))],  # one axis has no wrist, no foot
    ids=lambda family: family.name,
)
def test_rows_have_the_columns_of_the_whole_motion(rig: Robot, family: Family, clean: Recording) -> None:
    """Whatever an effect asks for, time and torque included, it gets for X as it does in the search."""
    model, settings = RegressorModel.of(rig), rig.identification
    place = family.places(rig)[0]
    shape = {one.name: one.grid[len(one.grid) // 2] for one in family.shapes(rig, place)}
    shape |= {
        name: value for name, value in (("contact_angle", 0.0), ("torque_limit", 20.0)) if name in shape
    }
    placed = family.effect(rig, place, tuple(shape.values()), Present(model, model.prior()))
    names = tuple(parameter.name for parameter in unused(placed.parameters, model.names))
    base = base_parameters(model)
    values = dict(zip(base.names, base.regroup(model.prior()), strict=True)) | dict.fromkeys(names, 1.0)
    entry = EffectEntry(family.name, tuple(joint + 1 for joint in place.joints), shape)
    extended = extended_model(rig, known(values, entry))
    assert found_entries(extended) == (entry,) and extended.names[-len(names) :] == names
    rows = observe(base_parameters(extended), (clean,), settings)

    moved = motion(clean.time, clean.position, settings)
    whole = settings.model_copy(update={"decimation": 1})
    torque = observed_torque(rig, clean, whole)
    state = State(moved.position, moved.velocity, moved.acceleration, moved.time, torque)
    expected = thinned(extended.effects[-1].columns(state), settings.decimation, settings.decimation_filter)
    own = rows.regressor[:, :, len(base.names) :]
    np.testing.assert_allclose(own, expected, rtol=1e-9, atol=1e-9)
    # A level axis has no part of a tilt, and of a payload it feels the mass alone.
    assert own.any() or family.name == "base_tilt"
    np.testing.assert_array_equal(
        rows.regressor[:, :, : len(base.names)], observe(base, (clean,), settings).regressor
    )


@pytest.mark.parametrize(
    ("entry", "names", "adds"),
    [
        (EffectEntry("coulomb_friction", (1,), {}), ("Fc1_2",), {"Fc1": 1.0}),
        (EffectEntry("payload", (), {}), ("M_payload",), {"M1R": 1.0}),
        (EffectEntry("current_offset", (1,), {}), ("doff1",), {"off1": 1.0}),
        (EffectEntry("drive_gain_error", (1,), {}), ("gain_error1",), None),
    ],
    ids=lambda value: value.name if isinstance(value, EffectEntry) else None,
)
def test_a_refit_takes_up_what_the_model_has_a_parameter_for(
    rig: Robot,
    clean: Recording,
    values: dict[str, float],
    entry: EffectEntry,
    names: tuple[str, ...],
    adds: dict[str, float] | None,
) -> None:
    found = known(values, entry, **dict.fromkeys(names, 0.1))
    fitted = identify(rig, (clean,), options=Options(found=found))
    plain = identify(rig, (clean,))
    assert fitted.base.names == plain.base.names and fitted.result.found == ()
    np.testing.assert_array_equal(fitted.result.recommended.values, plain.result.recommended.values)
    (said,) = [text for text in fitted.result.warnings if "take it up" in text]
    assert said.startswith(entry.name.replace("_", " "))
    taken = fitted.taken_up
    assert taken.names == names
    # The whole gain lies in every parameter, with the other sign: torque that is there and not told.
    expected = adds or {name: -values[name] for name in plain.base.names}
    for name, factor in zip(fitted.base.names, taken.factors[:, 0], strict=True):
        assert factor == pytest.approx(expected.get(name, 0.0), rel=1e-6, abs=1e-6), name


def test_an_effect_that_does_not_show_is_left_out_with_a_word(
    rig: Robot, clean: Recording, values: dict[str, float]
) -> None:
    beyond = float(np.abs(clean.position).max()) + 0.01
    wall = EffectEntry("contact", (1,), {"contact_angle": beyond, "side": 1.0})
    model = extended_model(rig, known(values, wall, **dict.fromkeys(_names_of(rig, "contact"), 1.0)))
    assert isinstance(model.effects[-1], Found)
    base = base_parameters(model)
    kept, rows, taken = without_taken_up(base, observe(base, (clean,), rig.identification))
    assert kept.names == base_parameters(RegressorModel.of(rig)).names and rows.regressor.shape[2] == 4
    assert "contact (joint 1) does not show in these recordings" in taken.sentences[0]
    assert not taken.factors.any()


def test_parameters_that_the_file_has_not_stay_zero(rig: Robot, values: dict[str, float]) -> None:
    """The search leaves out what its recordings did not show."""
    entry = EffectEntry("asymmetric_friction", (1,), {})
    base = base_parameters(extended_model(rig, known(values, entry, dFv1=-30.0)))
    assert base.names[-1] == "dFv1" and "dFc1" not in base.names and "dFc1" in base.model.names
    standard = base.standard_from(np.array([*values.values(), -30.0]), base.model.prior())
    assert dict(zip(base.model.names, standard, strict=True))["dFc1"] == 0.0


def test_time_runs_on_from_one_recording_to_the_next(
    rig: Robot, clean: Recording, values: dict[str, float]
) -> None:
    """Friction that fades with the time since the arm was started goes on fading in the second recording."""
    later = replace(clean, time=clean.time + 100.0)
    one, two = end_to_end((later, clean))
    assert one.time[0] == 0.0 and two.time[0] == pytest.approx(one.time[-1])
    drift = EffectEntry("drifting_friction", (1,), {"settling_time": 5.0})
    names = _names_of(rig, "drifting_friction")
    base = base_parameters(extended_model(rig, known(values, drift, **dict.fromkeys(names, 1.0))))
    rows = observe(base, (one, two), rig.identification)
    cold = rows.regressor[:, 0, base.names.index("Fv_cold1")].reshape(2, -1)
    faded = np.exp(-float(one.time[-1]) / 5.0)
    np.testing.assert_allclose(cold[1], faded * cold[0], rtol=1e-5, atol=1e-8)


def test_names_are_given_once() -> None:
    dry, break_away = (StandardParameter(symbol, Place("drive", (0,)), "", "N·m") for symbol in ("Fc", "Fs"))
    assert [p.name for p in unused((dry, break_away), ("Fc1", "Fc1_2"))] == ["Fc1_3", "Fs1"]
    assert [p.name for p in unused((dry, dry), ())] == ["Fc1", "Fc1_2"]
    assert unused((dry,), ("Fc1",))[0].is_usual(("Fc",)) is False


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            {"found": (replace(STRIBECK, joints=(3,)),)},
            r"file: stribeck_friction at joints \[3\]; allowed: 1",
        ),
        ({"found": (replace(STRIBECK, name="rust"),)}, "file: effect rust is not in the vocabulary"),
        ({"found": (replace(STRIBECK, shape={}),)}, r"file: stribeck_friction with shape \[\]; allowed: "),
        ({"usual": (*USUAL, "wrist_coupling")}, "file: has wrist_coupling; allowed: a model of emps"),
        ({"values": {"M1R": 95.0, "Fs1": 1.0}}, "file: has no parameter Fv1; allowed"),
        ({"values": {}}, "file: has no parameter M1R; allowed"),
        ({"lost": "Fs1"}, "file: has stribeck_friction without a parameter; allowed: Fs1"),
    ],
)
def test_a_model_that_is_not_of_this_arm_is_refused_in_one_line(
    rig: Robot, values: dict[str, float], change: dict[str, object], said: str
) -> None:
    lost = change.pop("lost", "")
    given = {name: value for name, value in (values | {"Fs1": 100.0}).items() if name != lost}
    model = replace(FoundModel("file", USUAL, (STRIBECK,), given), **change)  # type: ignore[arg-type]
    with pytest.raises(IdentificationError, match=f"^{said}") as error:
        extended_model(rig, model)
    assert "\n" not in str(error.value)


def test_six_axes_keep_their_base_and_get_the_others_behind() -> None:
    arm = robots.load("tx40")
    plain = base_parameters(RegressorModel.of(arm))
    values = dict(zip(plain.names, plain.regroup(plain.model.prior()), strict=True))
    entries = (
        EffectEntry("joint_elasticity", (2,), {"compliance": 1e-5, "damping_ratio": 0.08}),
        EffectEntry("stribeck_friction", (6,), {"stribeck_speed": 0.04, "exponent": 1.0}),
    )
    usual = tuple(effect.name for effect in plain.model.effects)
    model = extended_model(arm, FoundModel("file", usual, entries, values | {"elasticity2": 1.0, "Fs6": 1.0}))
    base = base_parameters(model)
    assert base.names == (*plain.names, "elasticity2", "Fs6")
    assert base.expressions[-2:] == ("elasticity2", "Fs6")
    np.testing.assert_array_equal(base.relation[: len(plain.names), : len(plain.model.names)], plain.relation)


def _names_of(robot: Robot, name: str) -> tuple[str, ...]:
    model, family = RegressorModel.of(robot), family_named(name)
    place = family.places(robot)[0]
    shape = tuple(one.grid[0] for one in family.shapes(robot, place))
    placed = family.effect(robot, place, shape, Present(model, model.prior()))
    return tuple(one.name for one in placed.parameters)
