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
    gear = {"drive": 2, "driving": 0.25, "driven": 0.08}
    found = search(
        "tx40", 78, {"directional_efficiency": [gear]}, duration=8.0, vocabulary=FAMILIES, at_reversals=False
    )
    assert [(one.effect, one.joints) for one in found.findings] == [("directional_efficiency", (2,))]
    assert found.verdict == "named"
    values = {p.name: p.value for p in found.findings[0].parameters}
    assert values["mu_mean2"] == pytest.approx(0.165, rel=0.1)
    assert values["dmu2"] == pytest.approx(0.085, rel=0.2)
