"""What an arm presses against: found from wherever it begins, on either side, by what the rows show."""

from __future__ import annotations

import numpy as np
import pytest

from ident.discrepancy.by_evidence.decide.corners import best_corners
from ident.discrepancy.by_evidence.decide.present_with import present_with
from ident.discrepancy.by_evidence.decide.scanned import scanned
from ident.discrepancy.by_evidence.decide.screening import screen
from ident.discrepancy.by_evidence.decide.state import without_effects
from ident.discrepancy.by_evidence.library.candidates import Entry, candidates
from ident.effects.springs import CONTACT
from robots.arrays import FloatArray
from tests.ident.discrepancy.by_evidence.toy_effects import EMPS, REACH, problem_of

(CANDIDATE,) = candidates(EMPS, (CONTACT,))
STEP = float(np.diff(CANDIDATE.shapes[0].grid[:2])[0])


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("begins", [0.031, -0.044])
def test_it_is_tried_where_it_begins(begins: float, side: float) -> None:
    """A motion of a part of the travel, a spring that is pressed in a part of the motion."""

    def pressed(q: FloatArray) -> FloatArray:
        return np.asarray(side * 60.0 * np.maximum(side * (q - begins), 0.0))

    problem = problem_of(pressed)
    nothing = without_effects(problem)
    present = present_with(problem, nothing)
    found = best_corners(problem.rows, nothing, CANDIDATE, present)
    assert found[0] == (pytest.approx(begins, abs=STEP), side)
    first = screen(problem, nothing, scanned(problem.rows, nothing, (CANDIDATE,), present))[0]
    assert first.best.entry.placed.shape == found[0]
    # Each gain is that of the corner by itself; one of the others is the same but for its last digit.
    tried, others = {}, np.linspace(-0.8, 0.8, 17) * REACH
    for at in (*others[~np.isclose(others, found[0][0], rtol=0.0, atol=1e-9)], found[0][0]):
        placed = CANDIDATE.at(EMPS, (float(at), side), present)
        (alone,) = screen(problem, nothing, [Entry(CANDIDATE, placed, problem.rows.effect(placed))])
        tried[float(at)] = alone.gain
    assert max(tried, key=lambda at: tried[at]) == found[0][0]


def test_what_the_motion_does_not_pass_is_not_tried() -> None:
    problem = problem_of(np.zeros_like)
    nothing = without_effects(problem)
    for position, _ in best_corners(problem.rows, nothing, CANDIDATE, present_with(problem, nothing)):
        assert abs(position) < REACH
