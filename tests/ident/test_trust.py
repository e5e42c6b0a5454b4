"""The closed-loop Monte Carlo of benchmarks/trust.py in its short form."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from benchmarks import trust, trust_pictures
from benchmarks.trust import CASES, SCENARIOS, Scenario
from ident import Recording

ONE = CASES["one_axis"]


@pytest.fixture(scope="module")
def quiet() -> Recording:
    return trust.replicate(ONE, 1.0, 0)


@pytest.fixture(scope="module")
def noisy() -> Recording:
    return trust.replicate(ONE, 100.0, 0)


@pytest.mark.parametrize(
    "name",
    ["right", "position gain − 20 %", "velocity gain + 20 %", "velocity gain − 20 %", "no viscous friction"],
)
def test_gate_one_closes_when_something_is_wrong_and_only_then(name: str, quiet: Recording) -> None:
    gate = trust.first_gate(SCENARIOS[name].model(ONE.prepared(80.0, 5)), quiet)
    assert gate is not None
    assert gate.passed is (name == "right")
    failed = {check.column for check in gate.columns if not check.passed}
    if "gain" in name:
        assert failed == {"following error of drive 1"}
    if "friction" in name:
        assert "torque of joint 1" in failed


def test_a_scenario_changes_what_it_names() -> None:
    robot = ONE.prepared(40.0, 10)
    changed = Scenario(position=1.2, velocity=0.8, delay=1).model(robot).robot.controller
    right = robot.controller
    assert changed.position_gain == pytest.approx([1.2 * k for k in right.position_gain])
    assert changed.velocity_gain == pytest.approx([0.8 * k for k in right.velocity_gain])
    assert changed.delay_samples == right.delay_samples + 1


def test_noise_and_a_high_cutoff_bias_least_squares_and_the_verdict_says_so(noisy: Recording) -> None:
    wide = trust.answer(ONE.prepared(160.0, 2), noisy)
    assert wide.verdict == "endogenous"
    assert wide.ls is not None
    assert wide.iv is not None
    assert np.abs(wide.ls).max() > 20.0
    assert np.abs(wide.iv).max() < 4.0


def test_a_low_cutoff_leaves_nothing_to_correct(quiet: Recording) -> None:
    narrow = trust.answer(ONE.prepared(20.0, 20), quiet)
    assert narrow.verdict == "exogenous"
    assert narrow.ls is not None
    assert narrow.iv is not None
    assert np.abs(narrow.ls - narrow.iv).max() < 0.1


def test_a_replicate_is_its_seed(quiet: Recording) -> None:
    again, other = trust.replicate(ONE, 1.0, 0), trust.replicate(ONE, 1.0, 1)
    assert np.array_equal(again.control_signal, quiet.control_signal)
    assert np.array_equal(again.position, quiet.position)
    assert not np.array_equal(other.position, quiet.position)


def test_the_pictures_are_those_of_the_results(repository: Path) -> None:
    results = json.loads(trust.RESULTS.read_text(encoding="utf-8"))
    drawn = {
        f"trust-power-{arm}.svg": trust_pictures.power_picture(
            arm, [cell for cell in results["power"] if cell["arm"] == arm]
        )
        for arm in {cell["arm"] for cell in results["power"]}
    }
    drawn["trust-gate1.svg"] = trust_pictures.gate1_picture(results["gate1"])
    for name, picture in drawn.items():
        assert (repository / "docs" / "images" / name).read_text(encoding="utf-8") == picture
        assert ET.fromstring(picture).tag.endswith("svg")
