"""The whole day of an arm by the commands, in virtual time; ``benchmarks/whole_day.md`` has its 30 nights."""

from __future__ import annotations

import re
from math import exp
from pathlib import Path

import pytest

import robots
from benchmarks.shoulder_and_elbow import shoulder_and_elbow
from benchmarks.whole_day import HIDDEN, SEED, Size, in_virtual_time
from drivers.simulated import draw_truth
from tests.drivers.test_vcan import needs_tool

SIZE = Size(nights=1, worn=1, wear=0.3, first=6.0, duration=8.0, evaluations=200)
STAGES = ["plan", "check", "first move", "approach", "warm-up", "slow run", "full run", "return"]
SLOW = 0.1
"""rad/s; slower rows are few. What friction does nearer to rest, this motion does not show: an exponent of 1
and one of 2 fit it equally, and differ at rest by a factor of two."""


def figure(text: str, before: str) -> tuple[float, float]:
    """What follows these words, and its σ."""
    found = re.search(re.escape(before) + r" \+?([\d.]+)[ %(]*± ?([\d.]+)", text)
    assert found is not None, text
    return float(found[1]), float(found[2])


def falling(size: float, speed: float, exponent: float) -> float:
    """Stribeck friction at a slow speed, N·m."""
    return size * exp(-((SLOW / speed) ** exponent))


@pytest.mark.slow
@pytest.mark.timeout(900)
@needs_tool
def test_an_arm_is_commissioned_understood_watched_and_its_wear_is_told(tmp_path: Path) -> None:
    told = in_virtual_time(tmp_path, SIZE)
    assert told["stages"] == STAGES

    named = {(effect, *joints): sentence for effect, joints, sentence in told["named"]}
    assert set(named) == {("stribeck_friction", 1), ("position_dependent_friction", 2)}
    truth = draw_truth(robots.load(shoulder_and_elbow(tmp_path / "again")), SEED).parameters
    (oil,), (gear,) = HIDDEN["stribeck_friction"], HIDDEN["position_dependent_friction"]
    sentence = named["stribeck_friction", 1]
    exponent = re.search(r"exponent ([\d.]+)", sentence)
    assert exponent is not None, sentence
    found = falling(figure(sentence, "Fs1")[0], figure(sentence, "stribeck_speed")[0], float(exponent[1]))
    true = falling(oil["rise"] * truth["Fc1"], oil["speed"], oil["exponent"])
    assert found == pytest.approx(true, rel=0.15)
    sentence = named["position_dependent_friction", 2]
    assert figure(sentence, "Fq_cos2")[0] == pytest.approx(gear["wave"] * truth["Fc2"], rel=0.02)
    assert figure(sentence, "waves")[0] == pytest.approx(gear["order"], abs=0.01)
    assert told["accepted model, left %"] < told["first model, left %"] / 10.0

    quiet, worn = told["nights"]
    assert quiet["verdict"] == "ok" and worn["verdict"] == "failed"
    more, sigma = figure(worn["sentence"], "Coulomb friction of joint 2")
    assert more == pytest.approx(100.0 * SIZE.wear, abs=3.0 * sigma) and "joint 1" not in worn["sentence"]
    assert "the thermometer says 0 K" in worn["sentence"], "commissioned with --celsius, checked with it"
    assert told["messages"] == ["failed"]
    assert told["pages"] == {"overview": True, "arm": True, "metrics": True}
