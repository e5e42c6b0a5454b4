"""Scoring of the blind campaign: what was found beside what the plant really has."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

import robots
from benchmarks import naming, naming_report
from benchmarks.naming_parameters import compared, coverage
from benchmarks.naming_scores import all_found, both_in_set
from drivers.simulated import draw_truth
from drivers.simulated.drawing import exercise
from drivers.simulated.scenario import Scenario
from ident.effects.vocabulary import family_named
from robots import Robot


class _Nothing:
    """A present model without torques, of which only names of parameters are asked."""

    def has(self, symbols: object, drive: int) -> bool:
        return True


def arm() -> Robot:
    return robots.load("tx40")


ENTRIES = {
    "viscous_friction": {"drive": 3, "change": 0.2},
    "coulomb_friction": {"drive": 3, "change": 0.2},
    "asymmetric_friction": {"drive": 3, "coulomb": 0.1, "viscous": 0.2},
    "stribeck_friction": {"drive": 3, "rise": 0.5, "speed": 0.1, "exponent": 1.0},
    "nonlinear_viscous_friction": {"drive": 3, "share": 0.5, "exponent": 0.5, "reference": 1.0},
    "load_dependent_friction": {"drive": 3, "coefficient": 0.1},
    "drifting_friction": {"drive": 3, "time_constant": 9.0},
    "position_dependent_friction": {"drive": 3, "wave": 0.3, "order": 2.0},
    "joint_elasticity": {"drive": 3, "stiffness": 2000.0},
    "backlash": {"drive": 3, "width": 0.001},
    "wrist_coupling": {
        "joints": [2, 3],
        "ratios": [0.5, 1.0],
        "inertia": 0.01,
        "viscous": 0.1,
        "coulomb": 0.2,
    },
    "gear_ripple": {"drive": 3, "amplitude": 1e-4, "order": 2.0},
    "drive_gain_error": {"drive": 3, "change": 0.1},
    "current_offset": {"drive": 3, "torque": 0.5},
    "torque_ripple": {"drive": 3, "amplitude": 0.3, "order": 2.0},
    "saturation": {"drive": 3, "limit": 1.5},
    "rotor_inertia": {"drive": 3, "change": 0.01},
    "current_loop_lag": {"drive": 3, "time_constant": 0.003},
    "payload": {"mass": 0.5, "centre": [0.01, 0.02, 0.05]},
    "gravity_spring": {"joint": 3, "torsion": 5.0, "centre": 0.3},
    "base_tilt": {"roll": 0.01, "pitch": 0.02},
    "time_delay": {"drive": 3, "position": 0.002},
    "cable_spring": {"joint": 3, "stiffness": 1.0, "cubic": 2.0, "centre": 0.1},
    "contact": {"joint": 3, "upper": 1.0, "stiffness": 50.0},
}
SHAPES = {"exponent": 1.0, "power": 0.5, "ratio": 0.5, "periods_per_turn": 2.0, "side": 1.0}


@pytest.mark.parametrize("effect", ENTRIES)
def test_every_compared_parameter_is_one_that_the_search_reports(effect: str) -> None:
    robot, entry = arm(), ENTRIES[effect]
    place = next(p for p in family_named(effect).places(robot) if not p.joints or p.joints[-1] == 2)
    shapes = family_named(effect).shapes(robot, place)
    values = tuple(SHAPES.get(shape.name, shape.grid[0]) for shape in shapes)
    placed = family_named(effect).effect(robot, place, values, _Nothing())  # type: ignore[arg-type]
    parameters = {one.name: (1.0, 0.1) for one in placed.parameters}
    parameters |= {shape.name: (value, 0.1) for shape, value in zip(shapes, values, strict=True)}
    joints = [joint + 1 for joint in place.joints]
    scenario = {effect: entry if effect in ("payload", "base_tilt") else [entry]}
    pairs = compared(robot, draw_truth(robot, 7), scenario, effect, joints, parameters)
    assert pairs
    assert all(np.isfinite(triple).all() for triple in pairs.values())


def test_a_found_value_stands_beside_the_arms_own_figure() -> None:
    robot = arm()
    truth = draw_truth(robot, 7)
    scenario = {"viscous_friction": [{"drive": 3, "change": 0.2}]}
    pairs = compared(robot, truth, scenario, "viscous_friction", [3], {"Fv3": (0.5, 0.01)})
    assert pairs == {"Fv": [0.5, 0.01, pytest.approx(0.2 * truth.parameters["Fv3"])]}
    assert compared(robot, truth, scenario, "viscous_friction", [2], {"Fv2": (0.5, 0.01)}) == {}
    assert compared(robot, truth, scenario, "coulomb_friction", [3], {"Fc3": (0.5, 0.01)}) == {}


@pytest.mark.parametrize(
    ("effect", "amplitude", "waves"), [("gear_ripple", "gear_error", 2.0), ("torque_ripple", "ripple", 6.0)]
)
def test_what_a_scenario_leaves_out_has_its_usual_value(effect: str, amplitude: str, waves: float) -> None:
    robot = arm()
    given = {"format": 1, effect: [{"drive": 3, "amplitude": 0.1, "order": waves}]}
    hidden = Scenario.from_dict(given).as_dict()
    assert "order" not in hidden[effect][0]
    found = {f"{amplitude}_cos3": (0.1, 0.01), f"{amplitude}_sin3": (0.0, 0.01)}
    for periods, pairs in ((waves, {amplitude: [0.1, 0.01, 0.1]}), (waves + 1.0, {})):
        parameters = found | {"periods_per_turn": (periods, 0.0), "with_torque": (0.0, 0.0)}
        assert compared(robot, draw_truth(robot, 7), hidden, effect, [3], parameters) == pairs


def test_a_ripple_of_the_torque_is_compared_with_that() -> None:
    robot = arm()
    hidden = {"torque_ripple": [{"drive": 3, "per_current": 0.03, "order": 2.0}]}
    found = {"ripple_share_cos3": (0.03, 0.001), "ripple_share_sin3": (0.0, 0.001), "with_torque": (1.0, 0.0)}
    parameters = found | {"periods_per_turn": (2.0, 0.0)}
    pairs = compared(robot, draw_truth(robot, 7), hidden, "torque_ripple", [3], parameters)
    assert pairs == {"ripple_share": [0.03, 0.001, 0.03]}


def test_a_spring_between_anchors_is_compared_with_that() -> None:
    robot = arm()
    truth = draw_truth(robot, 7)
    hidden = {"gravity_spring": [{"joint": 3, "stiffness": 50.0, "length": 0.1, "angle": 0.4}]}
    found = {"spring3": (0.8, 0.01), "anchor_angle": (0.4, 0.01)}
    pairs = compared(robot, truth, hidden, "gravity_spring", [3], found)
    assert {name: pair[2] for name, pair in pairs.items()} == pytest.approx(
        {"spring": 0.8, "anchor_angle": 0.4}
    )
    both = {"gravity_spring": [{"joint": 3, "stiffness": 50.0, "torsion": 2.0}]}
    assert compared(robot, truth, both, "gravity_spring", [3], found) == {}


def test_a_tight_spot_is_compared_with_that() -> None:
    robot = arm()
    truth = draw_truth(robot, 7)
    hidden = {
        "position_dependent_friction": [{"drive": 3, "spot": 0.5, "spot_centre": 0.2, "spot_width": 0.1}]
    }
    found = {"Fq_spot3": (0.5, 0.01), "spot_centre": (0.2, 0.01), "spot_width": (0.1, 0.01)}
    pairs = compared(robot, truth, hidden, "position_dependent_friction", [3], found)
    assert {name: pair[2] for name, pair in pairs.items()} == {
        "Fq_spot": 0.5 * truth.per_drive("Fc")[2],
        "spot_centre": 0.2,
        "spot_width": 0.1,
    }


def test_another_law_is_not_compared() -> None:
    robot = arm()
    scenario = {"stribeck_friction": [{"drive": 3, "rise": 0.5, "speed": 0.1, "exponent": 2.0}]}
    found = {"Fs3": (0.5, 0.01), "stribeck_speed": (0.1, 0.01), "exponent": (1.0, 0.0)}
    assert compared(robot, draw_truth(robot, 7), scenario, "stribeck_friction", [3], found) == {}


def test_the_share_within_three_deviations() -> None:
    lines = [{"compared": {"payload": {"M_payload": [1.0, 0.1, true]}}} for true in (1.0, 1.29, 1.31, 2.0)]
    assert coverage([*lines, {}]) == {"payload: M_payload": [True, True, False, False]}


def reported(lines: Sequence[Mapping[str, object]], folder: Path) -> str:
    """The report of such results."""
    file = folder / "naming.jsonl"
    file.write_text("".join(json.dumps(one) + "\n" for one in lines), encoding="utf-8")
    return naming_report.report(file)


def test_the_report_tells_the_gap_joint_by_joint_and_of_the_whole_arm(tmp_path: Path) -> None:
    line = {
        "kind": "single",
        "effect": "payload",
        "seed": 1,
        "axes": [],
        "verdict": "named",
        "findings": [{"effect": "payload", "joints": [], "set": [], "named": True}],
        "floor": [1.0, 1.0],
        "level": [[3.0, 1.0], [1.25, 0.75]],
        "explainable": [[8.0**0.5, 0.0], [0.75, 0.0]],
        "compared": {"payload": {"M_payload": [1.0, 0.1, 1.05]}},
    }
    clean = line | {"kind": "clean", "findings": [], "explainable": [[0.3, 0.4], [0.3, 0.4]], "compared": {}}
    lines = [line, clean, clean | {"explainable": [[0.6, 0.0], [0.6, 0.0]]}]
    text = reported(lines, tmp_path)
    assert "named (confirmed, alone) | 100 % [21, 100] of 1 |" in text
    assert "something else named, any kind of run | 0 % [0, 56] of 3 |" in text
    assert "| gap of clean arms in floors, all joints, median | 0.55 |" in text
    assert "where a fifth of it is no less than that | 0 % [0, 79] of 1 |" in text
    assert "where named right | 0 % [0, 79] of 1 |" in text
    assert "joints taken together | 100 % [21, 100] of 1 |" in text
    assert "| payload: M_payload | 100 % [21, 100] of 1 |" in text


def test_a_pair_counts_as_reported_where_both_are_found_or_in_a_set() -> None:
    def line(findings: list[dict[str, object]]) -> dict[str, object]:
        return {"effect": "time_delay+payload", "axes": [[5], []], "findings": findings}

    lag = {"effect": "current_loop_lag", "joints": [5], "set": [[["time_delay"], [[5]]]]}
    other = {"effect": "payload", "joints": [], "set": []}
    elsewhere = {"effect": "time_delay", "joints": [4], "set": []}
    together = {"effect": "rotor_inertia", "joints": [5], "set": [[["time_delay", "payload"], [[5], []]]]}
    assert both_in_set(line([lag, other])) and not all_found(line([lag, other]))
    assert both_in_set(line([together]))
    assert not both_in_set(line([elsewhere, other])) and not both_in_set(line([lag]))


def test_several_hidden_effects_count_where_all_are_found_at_their_places(tmp_path: Path) -> None:
    def line(
        kind: str, effects: str, axes: list[list[int]], found: list[tuple[str, list[int]]]
    ) -> dict[str, object]:
        findings = [
            {"effect": effect, "joints": joints, "set": [], "named": True} for effect, joints in found
        ]
        known = {"kind": kind, "effect": effects, "axes": axes, "seed": 1, "verdict": "named"}
        return known | {"findings": findings}

    three, places = "payload+backlash+torque_ripple", [[], [2], [5]]
    whole = [("payload", []), ("backlash", [2]), ("torque_ripple", [5])]
    lines = [
        line("one joint", "backlash+hysteresis", [[2], [2]], [("backlash", [2]), ("hysteresis", [2])]),
        line("one joint", "backlash+hysteresis", [[2], [2]], [("backlash", [2]), ("hysteresis", [3])]),
        line("triple", three, places, whole),
        line("triple", three, places, whole[:2]),
        line("triple", three, places, []),
    ]
    text = reported(lines, tmp_path)
    assert "| something else named, any kind of run | 20 % [4, 62] of 5 |" in text
    assert "| two hidden at one joint: all named first | 50 % [9, 91] of 2 |" in text
    assert "| two hidden at one joint: a finding that is none of them | 50 % [9, 91] of 2 |" in text
    assert "| three hidden at three joints: all named first | 33 % [6, 79] of 3 |" in text
    assert "| three hidden at three joints: at least one | 67 % [21, 94] of 3 |" in text


def test_effects_of_one_joint_have_one_and_those_of_three_have_no_joint_in_common() -> None:
    given = Namespace(
        single=0, pairs=0, clean=0, outside=0, one_joint=2, triples=2, effects=["backlash", "payload",
        "current_offset", "wrist_coupling", "torque_ripple"], seed=3,
    )  # fmt: skip
    tasks = naming.tasks_of(given)
    of_a_joint = {"backlash", "current_offset", "torque_ripple"}
    assert sorted(kind for kind, *_ in tasks) == ["one joint", "one joint", "triple", "triple"]
    assert all(set(effect.split("+")) <= of_a_joint for kind, effect, _ in tasks if kind == "one joint")
    robot = robots.load(naming.ARM)
    path = exercise(robot, 3.0)
    truth, effects = draw_truth(robot, 1), "current_offset+torque_ripple+viscous_friction"
    for kind, places in (("one joint", 1), ("triple", 3)):
        _, axes, _ = naming.hidden(robot, truth, (kind, effects, 1), 2.0, path)
        assert len({tuple(one) for one in axes}) == places
