"""Effects that joined the vocabulary later: named among those that they pass for, with their sizes."""

from __future__ import annotations

import numpy as np
import pytest

import robots
from ident.discrepancy.by_evidence.report.answer import EvidenceFinding
from ident.effects.vocabulary import confused_with, family_named
from tests.ident.discrepancy.by_evidence.test_search import search

pytestmark = pytest.mark.slow

EMPS = robots.load("emps")
GAIN, LIMIT = float(EMPS.gains[0]), float(EMPS.torque_limits[0])
LARGEST = 3.7
"""Control signal that the motion asks for at most."""


def only(name: str, hidden: dict[str, object]) -> EvidenceFinding:
    """The one sure finding where this is hidden in the axis, asked for with all names that it passes for."""
    families = [family_named(one) for one in (name, *confused_with(name))]
    answer = search({name: [{"drive": 1, **hidden}]}, families=families)
    (found,) = (one for one in answer.findings if one.sure)
    assert (found.name, found.joints) == (name, (1,))
    return found


def values(finding: EvidenceFinding) -> dict[str, tuple[float, float]]:
    """Parameters and shapes with their deviations."""
    return {one.name: (one.value, one.sigma) for one in finding.parameters}


def test_a_torque_constant_that_droops() -> None:
    found = values(only("torque_constant_droop", {"loss": 0.1, "current": LARGEST}))
    # What is asked for beyond the torque at the largest torque: the plant's droop has another form.
    torque = GAIN * LARGEST / 1.1
    more = found["droop1"][0] * (torque / LIMIT) ** found["power"][0]
    assert more == pytest.approx(0.1, rel=0.1)


def test_a_dead_zone_of_the_command() -> None:
    width, sigma = values(only("command_dead_zone", {"width": 0.03}))["dead_zone1"]
    assert width == pytest.approx(0.03 * GAIN, abs=3.0 * sigma)


def test_an_encoder_that_runs_out_of_true() -> None:
    turns = float(EMPS.drive[0].gear)
    size, phase = 0.003 / turns, 0.4
    hidden = {"amplitude": size, "turns": turns, "phase": phase}
    found = values(only("encoder_eccentricity", hidden))
    for name, true in (("reads_cos1", size * np.sin(phase)), ("reads_sin1", size * np.cos(phase))):
        value, sigma = found[name]
        assert value == pytest.approx(true, abs=3.0 * sigma), name
