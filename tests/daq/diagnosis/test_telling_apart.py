"""The motion for an ambiguous finding, and what no motion settles."""

from __future__ import annotations

import shutil
import sys
from dataclasses import replace
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console

import robots
from daq.diagnosis import diagnosis_json, diagnosis_terminal, telling_apart
from daq.diagnosis.apart import PlanSettings, TellingApart
from daq.diagnosis.diagnosis_words import recommendation
from daq.diagnosis.ranking_table import ranking_rows
from daq.diagnosis.settled_by import settled_by
from daq.diagnosis.telling_apart import tell_apart
from ident import RegressorModel, base_parameters
from ident.discrepancy import Candidate, described_prior
from ident.discrepancy.before_after import Stage
from ident.effects.family import PlacedEffect
from ident.effects.vocabulary import VOCABULARY, confused_with, family_named, hidden_from_motion
from ident.parameters.present import Present
from robots import Robot
from trajectories import PlanError


@pytest.fixture(scope="module")
def stage() -> Stage:
    """The one-axis rig's usual model."""
    base = base_parameters(RegressorModel.of(robots.load("emps")))
    return Stage(base, base.regroup(base.model.prior()), None)


def placed(stage: Stage, name: str) -> PlacedEffect:
    robot, family = stage.base.model.robot, family_named(name)
    place = family.places(robot)[0]
    shape = tuple(shape.grid[0] for shape in family.shapes(robot, place))
    return family.effect(robot, place, shape, Present(stage.base.model, stage.base.model.prior()))


def candidate(stage: Stage, name: str) -> Candidate:
    return Candidate(name, (1,), 100.0, 0.2, placed(stage, name))


def apart(
    stage: Stage, monkeypatch: pytest.MonkeyPatch, named: str, *others: str, probability: float = 0.6
) -> tuple[Robot, TellingApart]:
    """What is planned where ``named`` cannot be told from others, of which each has 0.2."""
    monkeypatch.setattr(telling_apart, "stages", lambda diagnosis: [stage])
    finding = SimpleNamespace(
        effect=named,
        joints=(1,),
        probability=probability,
        score=120.0,
        placed=placed(stage, named),
        indistinguishable_from=tuple(candidate(stage, name) for name in others),
    )
    diagnosis: Any = SimpleNamespace(findings=(finding,), examinations=())
    robot = stage.base.model.robot
    found = tell_apart(robot, diagnosis, PlanSettings(duration=4.0, evaluations=60))
    assert len(found) == 1
    return robot, found[0]


def test_a_motion_is_planned_that_keeps_the_limits(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    robot, found = apart(stage, monkeypatch, "asymmetric_friction", "cable_spring")
    assert found.candidates == ("asymmetric_friction (joint 1)", "cable_spring (joint 1)")
    assert found.unsettled == ()
    assert found.duration == pytest.approx(16.0, abs=0.02)
    for trajectory in found.trajectories:
        assert (np.abs(trajectory.velocity) <= robot.velocity_limits + 1e-9).all()
        np.testing.assert_allclose(trajectory.velocity[[0, -1]], 0.0, atol=1e-9)
    assert found.pairs[0][1].correlation < 0.9


def test_the_part_that_judges_is_another_way_and_a_pair_is_told_apart_by_both(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, found = apart(stage, monkeypatch, "asymmetric_friction", "cable_spring")
    fit, judge = (np.asarray(one.position)[:500] for one in found.trajectories)
    assert np.abs(fit - judge).max() > 0.05
    each = [one.separation_after[0].correlation for one in found.parts]
    assert each[0] != each[1] and found.pairs[0][1].correlation == max(each)
    assert found.pairs[0][0] == found.parts[0].separation_before[0]


def test_both_parts_are_told_with_what_each_is_for(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    _, found = apart(stage, monkeypatch, "asymmetric_friction", "cable_spring")
    content, console = diagnosis_json._apart(found), Console(width=300, file=StringIO(), record=True)
    fit, judge = "tell-apart-1.trajectory.json", "tell-apart-1-validate.trajectory.json"
    assert (content["trajectory"], content["validation_trajectory"]) == (fit, judge)
    assert content["duration"] == content["validation_duration"] == pytest.approx(8.0, abs=0.01)
    (pair,) = content["pairs"]
    assert pair["correlation"]["after"] == pytest.approx(found.pairs[0][1].correlation)
    diagnosis_terminal._write_apart(console, found)
    assert f"{fit} to fit with all recordings so far, {judge} alone to --validate" in console.export_text()
    none = diagnosis_json._apart(replace(found, parts=()))
    assert none["trajectory"] is none["validation_trajectory"] is None
    assert none["duration"] is none["validation_duration"] is None
    assert none["pairs"] == []


def test_a_form_and_its_limit_are_told_apart_by_what_the_form_has_more(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The straight part of a cable is that of a spring by definition."""
    _, found = apart(stage, monkeypatch, "gravity_spring", "cable_spring")
    assert found.parts and found.unsettled == ()


def test_a_form_that_was_fitted_as_its_limit_is_planned_for_with_a_shape_of_its_grid(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, family = stage.base.model.robot, family_named("dress_pack_hysteresis")
    place = family.places(robot)[0]
    present = Present(stage.base.model, stage.base.model.prior())
    straight = family.effect(robot, place, (1.45,), present)
    planned: list[float] = []
    original = telling_apart.discriminate

    def noted(robot: Robot, base: Any, candidates: Any, **settings: Any) -> Any:
        planned.append(candidates[1][0].shape[0])
        return original(robot, base, candidates, **settings)

    monkeypatch.setattr(telling_apart, "discriminate", noted)
    for other, shape in (("gravity_spring", 0.3), ("contact", 1.45)):
        planned.clear()
        with_shape = Candidate("dress_pack_hysteresis", (1,), 100.0, 0.5, straight)
        monkeypatch.setattr(sys.modules[__name__], "candidate", lambda *given, one=with_shape: one)
        apart(stage, monkeypatch, other, "dress_pack_hysteresis")
        assert {round(value, 6) for value in planned} == {shape}


def test_two_rivals_that_no_motion_tells_apart_do_not_cost_the_motion(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, found = apart(stage, monkeypatch, "cable_spring", "time_delay", "current_loop_lag")
    assert found.parts
    assert [(pair.first, pair.second) for pair in found.unsettled] == [
        ("time_delay (joint 1)", "current_loop_lag (joint 1)")
    ]


def test_a_motion_that_more_likely_than_not_leaves_the_name_open_is_not_offered(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A delay or a lag is there, more likely than a cable, and nothing is planned before that is settled."""
    planned: list[int] = []
    original = telling_apart.discriminate

    def noted(*arguments: Any, **settings: Any) -> Any:
        planned.append(settings["evaluations"])
        return original(*arguments, **settings)

    monkeypatch.setattr(telling_apart, "discriminate", noted)
    rivals = ("cable_spring", "time_delay", "current_loop_lag")
    _, found = apart(stage, monkeypatch, *rivals, probability=0.39)
    assert not found.parts and set(planned) == {1}
    assert [(pair.first, pair.second) for pair in found.unsettled] == [
        ("time_delay (joint 1)", "current_loop_lag (joint 1)")
    ]
    _, found = apart(stage, monkeypatch, *rivals, probability=0.41)
    assert found.parts


def test_a_form_that_has_the_name_as_its_limit_is_marked(stage: Stage) -> None:
    finding: Any = SimpleNamespace(
        effect="gravity_spring",
        joints=(1,),
        threshold=40.0,
        indistinguishable_from=(),
        ranking=(candidate(stage, "gravity_spring"), candidate(stage, "cable_spring")),
    )
    assert [row.state for row in ranking_rows(finding)] == ["named", "general"]


def test_what_a_refit_swallows_is_settled_without_motion(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, found = apart(stage, monkeypatch, "drifting_friction", "viscous_friction")
    assert not found.parts
    assert [(pair.first, pair.second) for pair in found.unsettled] == [
        ("drifting_friction (joint 1)", "viscous_friction (joint 1)")
    ]
    assert "part of the model already" in found.unsettled[0].why
    assert found.unsettled[0].settled_by.startswith("record the same motion cold and warm")


PAIRS = sorted({tuple(sorted((f.name, other))) for f in VOCABULARY for other in confused_with(f.name)})


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_nothing_is_driven_for_a_pair_that_motion_does_not_tell_apart(
    one: str, other: str, stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every pair that is easily confused: what is declared so, or what a refit swallows, is not planned."""
    robot = stage.base.model.robot
    if not (family_named(one).places(robot) and family_named(other).places(robot)):
        pytest.skip("the one-axis rig has no place for it")
    planned: list[int] = []
    original = telling_apart.discriminate

    def looked(*arguments: Any, **settings: Any) -> Any:
        if settings["evaluations"] > 1:
            planned.append(settings["evaluations"])
            raise PlanError("not in this test", constraint="separation")
        return original(*arguments, **settings)

    monkeypatch.setattr(telling_apart, "discriminate", looked)
    _, found = apart(replace(stage, prior=described_prior(stage.base)), monkeypatch, one, other)
    # Friction is free beside the description: a refit takes it up.
    assert not (planned and (hidden_from_motion(one, other) or {one, other} & FREE))
    assert not found.parts
    if not planned:
        (pair,) = found.unsettled
        assert pair.why and pair.settled_by == settled_by((one, other))


FREE = {"coulomb_friction", "viscous_friction"}


def test_what_no_motion_tells_apart_is_declared_with_what_does() -> None:
    declared = [(family, other) for family in VOCABULARY for other in family.not_by_motion]
    assert len(declared) == 3
    for family, other in declared:
        assert hidden_from_motion(family.name, other) and hidden_from_motion(other, family.name)
        assert other in confused_with(family.name) and family.told_from[other]
    assert not hidden_from_motion("coulomb_friction", "stribeck_friction")


def test_a_motion_that_settles_nothing_is_not_offered(stage: Stage, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same pair and motion as above, where it is not told apart well enough: nothing is to be driven."""
    monkeypatch.setattr(telling_apart, "TOLD_APART", 1e-3)
    _, found = apart(stage, monkeypatch, "asymmetric_friction", "cable_spring")
    assert not found.parts
    (pair,) = found.unsettled
    assert "even on the motion that tells them apart best" in pair.why
    assert pair.settled_by


def test_a_missing_mesh_costs_the_motion_and_nothing_else(
    stage: Stage, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shutil.copytree(robots.load("emps").folder, tmp_path / "emps")
    urdf = tmp_path / "emps" / "emps.urdf"
    mesh = '<collision><geometry><mesh filename="gone.stl"/></geometry></collision>'
    text = urdf.read_text(encoding="utf-8")
    urdf.write_text(text.replace("</inertial>", f"</inertial>{mesh}"), encoding="utf-8")
    stl = tmp_path / "emps" / "gone.stl"
    facets = "".join(
        f"facet normal 0 0 1\nouter loop\n{corners}\nendloop\nendfacet\n"
        for corners in (
            "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0",
            "vertex 0 0 0\nvertex 0 1 0\nvertex 0 0 1",
        )
    )
    stl.write_text(f"solid body\n{facets}endsolid body\n", encoding="ascii")
    base = base_parameters(RegressorModel.of(robots.load(str(tmp_path / "emps"))))
    stl.unlink()
    without = Stage(base, base.regroup(base.model.prior()), None)
    _, found = apart(without, monkeypatch, "asymmetric_friction", "cable_spring")
    assert not found.parts
    assert "gone.stl" in found.not_planned
    assert found.candidates == ("asymmetric_friction (joint 1)", "cable_spring (joint 1)")


def test_the_most_specific_advice_comes_first() -> None:
    assert "tool off" in settled_by(("payload", "drive_gain_error"))
    assert "known payload" in settled_by(("drive_gain_error", "rotor_inertia"))
    assert settled_by(("gear_ripple", "base_tilt")).startswith("put a level on the base")


NOT_BY_MOTION = (
    ("current_offset", "asymmetric_friction", "an offset stays"),
    ("time_delay", "current_loop_lag", "step the control signal"),
    ("time_delay", "rotor_inertia", "a delay shifts the current"),
    ("stribeck_friction", "nonlinear_viscous_friction", "creep"),
    ("gravity_spring", "contact", "clear the surroundings"),
    ("drive_gain_error", "drive_gain_error", "known payload"),
    ("backlash", "joint_elasticity", "play moves without force"),
    ("drive_gain_error", "payload", "take the tool off"),
)
"""What hardly any motion tells apart, one effect at two places among it, and what does."""


@pytest.mark.parametrize(("one", "other", "how"), NOT_BY_MOTION)
def test_what_no_motion_tells_apart_is_said_with_what_does(one: str, other: str, how: str) -> None:
    assert how in settled_by((one, other))
    assert settled_by((one, other)) == settled_by((other, one))


def test_every_effect_and_every_pair_that_is_easily_confused_has_an_answer() -> None:
    for family in VOCABULARY:
        assert settled_by((family.name,))
        for other in confused_with(family.name):
            assert settled_by((family.name, other)) == settled_by((other, family.name))


def test_an_ambiguous_finding_is_told_with_what_settles_it(stage: Stage) -> None:
    finding = SimpleNamespace(
        effect="backlash", indistinguishable_from=(candidate(stage, "joint_elasticity"),)
    )
    diagnosis: Any = SimpleNamespace(verdict="ambiguous", findings=(finding,))
    words = recommendation(diagnosis)
    assert words.startswith("This data cannot tell backlash from joint elasticity (joint 1).")
    assert "play moves without force" in words
