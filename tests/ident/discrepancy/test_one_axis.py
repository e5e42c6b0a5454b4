"""A single axis at 1 kHz: what its many reversals leave must not look like a missing effect."""

from __future__ import annotations

import pytest

from ident.discrepancy import Diagnosis
from tests.ident.discrepancy import blind_search

TRUTH = 501


def search(scenario: dict[str, object]) -> Diagnosis:
    return blind_search.search("emps", TRUTH, scenario, duration=5.0)


@pytest.mark.slow
def test_nothing_hidden_is_clean() -> None:
    found = search({})
    assert found.verdict == "clean", found.description
    beyond, rows = blind_search.beyond_noise(found.examinations[-1])
    assert beyond[0] < 0.1 * rows[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scenario", "effect"),
    [
        ({"drive_gain_error": [{"drive": 1, "change": -0.05}]}, "drive_gain_error"),
        ({"viscous_friction": [{"drive": 1, "change": 0.3}]}, "viscous_friction"),
    ],
)
def test_an_effect_of_a_drive_is_named(scenario: dict[str, object], effect: str) -> None:
    found = search(scenario)
    assert found.findings and found.findings[0].effect == effect, found.description


@pytest.mark.slow
def test_channels_too_far_apart_to_be_aligned_are_a_lag_of_some_kind() -> None:
    """Nobody has said how they lie, so how late they are is open to a sample, and no one name is sure."""
    found = search({"time_delay": [{"drive": 1, "position": 0.005}]})
    assert found.verdict == "unnamed"
    first, second = found.ranking[:2]
    assert {first.effect, second.effect} == {"current_loop_lag", "time_delay"}
    assert first.probability + second.probability > 0.8
