"""What an answer says beside names: what another recording leaves, what is misfit, how sure a size is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.discrepancy.by_evidence.confirm.held_out import HeldOut
from ident.discrepancy.by_evidence.decide.left_over import above_accepted, misfit_of
from ident.discrepancy.by_evidence.decide.search import Searched
from ident.discrepancy.by_evidence.decide.state import without_effects
from ident.discrepancy.by_evidence.evidence.prepared import prepare
from ident.discrepancy.by_evidence.workflow import _fails, _finding
from tests.ident.discrepancy.by_evidence.toy_effects import (
    EMPS,
    problem_of,
    recording,
    searching,
    torque,
    waves,
)

NINE = [waves("payload", w9=1.0)]


def held(searched_in: float, other: float) -> tuple[Searched, HeldOut]:
    """A wave of 1 N that was found, and another recording that has it or has another size of it."""
    problem = problem_of(lambda q: torque(q, w9=searched_in))
    validation = prepare(problem.prepared.robot, [recording(lambda q: torque(q, w9=other))])
    return searching(problem, NINE).run(), HeldOut.of(problem, validation)


@pytest.mark.parametrize(("other", "fails"), [(1.0, False), (0.7, False), (0.3, True), (0.0, True)])
def test_a_set_leaves_less_than_no_effect_where_more_than_half_of_it_is_there(
    other: float, fails: bool
) -> None:
    searched, validation = held(1.0, other)
    assert bool(_fails(searched, validation, 0)) is fails


def test_a_set_leaves_less_than_the_torque_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """A model that motion did not determine is none, however much less a finding makes it leave."""
    searched, validation = held(1.0, 1.0)
    for left, fails in ((0.9, False), (1.1, True)):
        monkeypatch.setattr(HeldOut, "unexplained", lambda self, found, left=left: np.array([left]))
        assert bool(_fails(searched, validation, 0)) is fails


def test_what_repeats_and_is_not_smooth_is_misfit_though_no_smooth_part_is() -> None:
    for size, above in ((0.0, 0.0), (0.3, 1.0), (3.0, 1.0)):
        problem = problem_of(lambda q, size=size: torque(q, w9=size))
        found = without_effects(problem)
        assert above_accepted(problem, found)[0] == pytest.approx(above, abs=0.2)
    assert float(found.level.excess[0]) > 3.0 and float(found.level.kappa[0]) < 1.0
    assert float(misfit_of(problem, found)[0]) == pytest.approx(3.0 / np.sqrt(2.0), rel=0.15)


def test_what_is_quicker_than_noise_is_no_more_misfit_than_all_that_is_left() -> None:
    """White rows of it are as many times as noisy: 266 N·m of a rocking foot, where 57 were left (98029)."""
    problem = problem_of(lambda q: torque(q, w9=3.0))
    found = without_effects(problem)
    (left,) = misfit_of(problem, found)
    quicker = replace(found, level=replace(found.level, excess=100.0 * found.level.excess))
    assert float(misfit_of(problem, quicker)[0]) == pytest.approx(float(left), rel=0.15)
    fewer = replace(found, level=replace(found.level, excess=np.ones(1)))
    assert float(misfit_of(problem, fewer)[0]) == pytest.approx(float(found.level.kappa[0]))


def test_what_does_not_repeat_is_no_misfit_however_noisy_rows_are() -> None:
    """Noise of the other periods' motion is in an effect's column, and the noise was known without it."""
    problem = problem_of(lambda q: torque(q, w9=0.0))
    found = without_effects(problem)
    found = replace(found, level=replace(found.level, excess=2.0 * np.ones(1)))
    noise = tuple(replace(one, deviation=0.5 * one.deviation) for one in problem.rows.noise)
    calmer = replace(problem, rows=replace(problem.rows, noise=noise))
    assert float(misfit_of(calmer, found)[0]) < noise[0].marginal
    assert above_accepted(calmer, found)[0] < 0.5


def test_a_gain_that_is_known_to_a_share_leaves_a_torque_known_to_that_share() -> None:
    problem = problem_of(lambda q: torque(q, w9=3.0), accepted=True)
    search = searching(problem, NINE)
    searched = search.run()
    validation = prepare(problem.prepared.robot, [recording(lambda q: torque(q, w9=3.0))])
    found = _finding(search, searched, HeldOut.of(problem, validation), 0)
    (size,) = found.parameters
    alone = np.sqrt(searched.found.theta(0)[1][0, 0])
    share = EMPS.drive[0].gain_relative_uncertainty
    assert size.value == pytest.approx(3.0, rel=0.05)
    assert size.sigma == pytest.approx(np.hypot(alone, share * size.value), rel=0.1)
    assert size.sigma > 1.5 * alone
