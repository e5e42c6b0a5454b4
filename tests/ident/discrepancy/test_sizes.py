"""Sizes come back with deviations that count what is not known of the arm that they were found on."""

from __future__ import annotations

import numpy as np
import pytest

from ident.effects.vocabulary import family_named
from tests.ident.discrepancy.blind_search import search

TRUTH, DRIVE, AMPLITUDE = 502, 4, 4e-4


@pytest.mark.slow
def test_a_ripple_of_a_gear_whose_links_are_known_to_a_tenth() -> None:
    """The torque is known to a twentieth; that it takes to move the links by the error is not."""
    scenario: dict[str, object] = {"gear_ripple": [{"drive": DRIVE, "amplitude": AMPLITUDE, "order": 2.0}]}
    only = (family_named("gear_ripple"),)
    found = search("tx40", TRUTH, scenario, duration=8.0, vocabulary=only, at_reversals=False)
    (finding,) = found.findings
    assert (finding.effect, finding.joints) == ("gear_ripple", (DRIVE,))
    values = {parameter.name: (parameter.value, parameter.sigma) for parameter in finding.parameters}
    cos, sin = (np.array(values[f"gear_error_{wave}{DRIVE}"]) for wave in ("cos", "sin"))
    amplitude = float(np.hypot(cos[0], sin[0]))
    sigma = float(np.hypot(cos[0] * cos[1], sin[0] * sin[1])) / amplitude
    assert abs(amplitude - AMPLITUDE) < 3.0 * sigma
    assert 0.05 < sigma / AMPLITUDE < 0.15
    assert values["periods_per_turn"] == (2.0, 0.0)  # tried, not fitted
