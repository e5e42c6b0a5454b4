"""A gear that takes more of its load one way than the other is told from friction of the load."""

from __future__ import annotations

import pytest

from ident.effects.vocabulary import family_named
from tests.ident.discrepancy.blind_search import search

FAMILIES = [
    family_named(name)
    for name in ("directional_efficiency", "load_dependent_friction", "drive_gain_error", "payload")
]


def test_an_efficiency_that_differs_with_the_direction_is_named() -> None:
    gear = {"drive": 1, "driving": 0.4, "driven": 0.05}
    found = search(
        "emps", 78, {"directional_efficiency": [gear]}, duration=5.0, vocabulary=FAMILIES, at_reversals=False
    )
    assert [(one.effect, one.joints) for one in found.findings] == [("directional_efficiency", (1,))]
    assert found.verdict == "named"
    values = {p.name: p.value for p in found.findings[0].parameters}
    assert values["mu_mean1"] == pytest.approx(0.225, rel=0.1)
    assert values["dmu1"] == pytest.approx(0.175, rel=0.2)
