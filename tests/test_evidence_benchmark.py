"""The benchmark of the searches counts what it says, and draws what the foreign plant can hide."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.evidence.case import UNKNOWN
from benchmarks.evidence.drawn import draw_of, hidden, truth_of
from benchmarks.evidence.own import drawn_of
from benchmarks.evidence.own import truth_of as own_truth
from benchmarks.evidence.reliability import picture, said_and_right, tenths
from benchmarks.evidence.scores import (
    all_right,
    calibration,
    calibration_error,
    first_is_right,
    holds_the_truth,
    report,
    shown_wrong,
    wrong,
)
from benchmarks.evidence.whole import effect_of
from benchmarks.foreign_plant import ARMS, NAMES, Settings, record
from benchmarks.naming_report import NAMES as NAMES_OF_OWN
from drivers.simulated.scenario import OUTSIDE_VOCABULARY
from ident.discrepancy.by_evidence.decide.no_name import NO_NAME


def line(truth: list[Any], *names: tuple[str, list[int], float, bool], verdict: str = "named") -> Any:
    answer = {
        "verdict": verdict,
        "processor_seconds": 1.0,
        "names": [
            {"name": n, "joints": j, "probability": p, "named": named, "set": [[n, j, p]]}
            for n, j, p, named in names
        ],
    }
    return {"name": "log", "kind": "foreign", "truth": truth, "answers": {"evidence": answer}}


def judged(test: Any, one: Any) -> bool:
    return bool(test(one, one["answers"]["evidence"]))


def test_a_name_counts_with_its_joint_and_only_where_it_is_given() -> None:
    truth = [["payload", []], ["stribeck_friction", [2]]]
    both = line(truth, ("payload", [], 0.99, True), ("stribeck_friction", [2], 0.95, True))
    assert judged(first_is_right, both) and judged(all_right, both) and not judged(wrong, both)
    elsewhere = line(truth, ("stribeck_friction", [3], 0.95, True))
    assert not judged(first_is_right, elsewhere) and judged(wrong, elsewhere)
    unsure = line(truth, ("payload", [], 0.99, True), ("hysteresis", [2], 0.6, False))
    assert not judged(wrong, unsure) and judged(shown_wrong, unsure) and not judged(all_right, unsure)
    pair = line([["wrist_coupling", [5]]], ("wrist_coupling", [5, 6], 0.99, True))
    assert judged(first_is_right, pair)
    outside = line([[UNKNOWN, [1]]], ("stribeck_friction", [1], 0.99, True))
    assert judged(wrong, outside)
    assert not judged(first_is_right, line([["payload", []]], verdict="unnamed"))


def test_the_report_tells_clean_arms_from_changed_ones_and_says_how_well_probabilities_hold() -> None:
    clean = line([], verdict="clean")
    missed = line([["payload", []]], verdict="clean")
    accused = line([], ("payload", [], 0.7, False), verdict="unnamed")
    text = report([clean, missed, accused])
    assert "| clean arm called clean | 1 of 2 |\n" in text
    assert "| changed arm called clean | 1 of 1 |\n" in text
    assert "| clean arm with a finding | 1 of 2 |\n" in text
    nameless = line([[UNKNOWN, [1]]], verdict="unnamed")
    first = "| right name and joint first, of what the vocabulary has | 0 of 1 |\n"
    assert first in text and first in report([clean, missed, nameless])
    real = {**line([["payload", []]], ("torque_ripple", [1], 0.99, True)), "kind": "real"}
    assert "| a name that is not hidden | 0 of 1 |\n" in report([clean, real])
    both = {**missed, "answers": {**missed["answers"], "rules": {**missed["answers"]["evidence"]}}}
    assert "| changed arm called clean | 1 of 1 | 1 of 1 |" in report([both]), "of a search that there was"
    right = line([["payload", []]], ("payload", [], 0.8, False))
    assert "2 names, expected calibration error 0.450" in calibration([right, accused])
    assert "hold the truth in 50%" in calibration([right, accused])


def test_a_set_holds_what_no_other_finding_has_and_nothing_where_all_is_had() -> None:
    friction, unknown = ["stribeck_friction", [2]], [UNKNOWN, [1]]
    right = {"name": "stribeck_friction", "joints": [2]}
    assert holds_the_truth([friction], [[*friction, 0.9]], [])
    assert not holds_the_truth([friction], [["hysteresis", [2], 0.9], ["nothing", [], 0.1]], [])
    assert holds_the_truth([unknown], [["hysteresis", [1], 0.5], [NO_NAME, [1], 0.5]], [])
    assert not holds_the_truth([unknown], [[NO_NAME, [3], 1.0]], [])
    assert not holds_the_truth([friction], [[NO_NAME, [2], 1.0]], [])
    assert not holds_the_truth([friction], [["viscous_friction", [2], 1.0]], [right])
    assert holds_the_truth([friction], [["viscous_friction", [2], 0.6], ["nothing", [], 0.4]], [right])


def test_the_calibration_error_is_that_of_tenths() -> None:
    said, right = np.array([0.95, 0.99, 0.15, 0.12]), np.array([1.0, 0.0, 0.0, 1.0])
    assert calibration_error(said, right) == pytest.approx((0.94 + 0.73) / 4.0)


def test_the_own_bench_draws_half_a_floor_to_five_and_all_kinds() -> None:
    drawn = [drawn_of(seed) for seed in range(400)]
    sizes = np.array([one.size for one in drawn])
    assert sizes.min() >= 0.5 and sizes.max() <= 5.0
    assert np.median(sizes) == pytest.approx(np.sqrt(0.5 * 5.0), rel=0.15)
    outside = np.mean([one.effects[:1] != () and one.effects[0] in OUTSIDE_VOCABULARY for one in drawn])
    shares = np.bincount([len(one.effects) for one in drawn], minlength=3) / len(drawn)
    assert shares == pytest.approx([0.1, 0.7, 0.2], abs=0.07) and outside == pytest.approx(0.1, abs=0.05)
    assert {name for one in drawn for name in one.effects} <= {*NAMES_OF_OWN, *OUTSIDE_VOCABULARY}
    said = own_truth((OUTSIDE_VOCABULARY[0], "payload"), ([2], ()))
    assert said == ((UNKNOWN, (2,)), ("payload", ()))


def test_the_diagram_has_a_point_per_tenth_and_plant() -> None:
    right = line([["payload", []]], ("payload", [], 0.97, True))
    wrong_one = line([["payload", []]], ("hysteresis", [1], 0.95, True))
    own_one = {**line([["payload", []]], ("payload", [], 0.35, True)), "kind": "own"}
    said, came = said_and_right([right, wrong_one])
    assert tenths(said, came) == [(pytest.approx(0.96), 1, 2)]
    drawn = picture([right, wrong_one, own_one])
    assert "own bench" in drawn and "2 names, error 0.46" in drawn and "1 names, error 0.65" in drawn
    assert drawn.count("<rect") == 2 and drawn.count("<circle") == 2


def test_what_is_drawn_the_plant_can_hide() -> None:
    drawn = [(draw_of(seed).arm, hidden(seed)) for seed in range(300)]
    assert {effect.name for _, effects in drawn for effect in effects} <= set(NAMES)
    shares = np.bincount([len(effects) for _, effects in drawn], minlength=3) / len(drawn)
    assert 0.12 < shares[0] < 0.28 and 0.12 < shares[2] < 0.28
    truths = [truth for _, effects in drawn for truth in truth_of(effects)]
    assert any(name == UNKNOWN for name, _ in truths)
    assert all(joints == () for name, joints in truths if name in ("payload", "base_tilt"))
    assert {arm for arm, _ in drawn} == set(ARMS)


@pytest.mark.parametrize(
    ("name", "joint", "seed", "said"),
    [
        ("static_friction", 1, 97674, "breaks away from nothing"),
        ("time_delay", 0, 97674, "no size of time_delay"),  # it swings at 36 Hz
        ("load_dependent_friction", 0, 97480, "no size of load_dependent_friction"),  # the gear locks
    ],
)
def test_nothing_is_drawn_that_no_arm_is_driven_with(name: str, joint: int, seed: int, said: str) -> None:
    draw = draw_of(seed)
    smooth = replace(draw.settings, friction="tanh")
    with pytest.raises(RuntimeError, match=said):
        effect_of(np.random.default_rng(1), name, joint, ARMS[draw.arm], smooth, seed)


@pytest.mark.slow
def test_what_is_drawn_its_log_shows_whatever_the_noise_does() -> None:
    """On the arm of 300 kg logs with the same noise differ by more than it where one reading rounds up."""
    arm, settings = ARMS["heavy6"], Settings(motion="multisine", law="p_pi", periods=1, step=2e-4)
    effect = effect_of(np.random.default_rng(1), "gravity_spring", 1, arm, settings, 96251)
    with_it, without = (
        record(arm, replace(settings, noise=0.0), one, 96251, 0).control_signal for one in ((effect,), ())
    )
    noise = record(arm, settings, (), 96251, 0).control_signal - without
    assert (np.std(with_it - without, axis=0) / np.std(noise, axis=0)).max() > 1.5


@pytest.mark.slow
def test_what_a_refit_takes_up_is_not_drawn_for_one() -> None:
    arm, settings = ARMS["compact6"], Settings(motion="multisine", periods=1, step=2e-4)

    def drawn(name: str, refit: bool) -> float:
        return effect_of(np.random.default_rng(1), name, 1, arm, settings, 97321, refit).size

    assert drawn("payload", False) > 0.0
    with pytest.raises(RuntimeError, match="no size of payload"):
        drawn("payload", True)
    assert drawn("position_dependent_friction", True) >= drawn("position_dependent_friction", False)
