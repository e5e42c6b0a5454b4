"""Rules of the decision: what may be half of a pair, and how well a shape is known."""

from __future__ import annotations

from collections.abc import Collection
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import lsq_linear

import robots
from ident.discrepancy.basis import alternatives
from ident.discrepancy.bounded import within_bounds
from ident.discrepancy.decision import _best_pair, _is_limit, _needed, _TieTolerance
from ident.discrepancy.examination import Examination
from ident.discrepancy.library import Library, Trial
from ident.discrepancy.refined import beside_factor
from ident.discrepancy.scoring import Score, best_per_place, singles
from ident.discrepancy.settings import DEFAULTS
from ident.effects.family import Place, PlacedEffect
from ident.effects.gain_drift import GAIN_DRIFT
from ident.effects.placed import Family
from ident.effects.springs import ANCHORED_SPRING, CABLE_SPRING, GRAVITY_SPRING
from ident.effects.vocabulary import family_named
from robots import Robot


class _Nothing:
    """A present model without torques; no column is asked for here."""

    def has(self, symbols: Collection[str], drive: int) -> bool:
        return True


def _trial(
    robot: Robot, family: Family, drive: int, start: int, count: int, prior_share: float = 0.0
) -> Trial:
    place = next(p for p in family.places(robot) if p.joints == (drive,))
    shape = tuple(s.grid[0] for s in family.shapes(robot, place))
    effect = family.effect(robot, place, shape, _Nothing())  # type: ignore[arg-type]
    end = start + count
    return Trial(family, place, effect, start, end, len(shape), np.eye(count), prior_share)


def test_a_form_without_a_name_is_no_half_of_a_pair() -> None:
    robot = robots.load("tx40")
    trials = (
        _trial(robot, family_named("viscous_friction"), 0, 0, 1),
        _trial(robot, GAIN_DRIFT, 1, 1, 3),
        _trial(robot, family_named("coulomb_friction"), 2, 4, 1),
    )
    # The drift of the gain explains most, dry friction on another drive least.
    products = np.array([60.0, 70.0, 70.0, -70.0, 40.0])
    columns = np.eye(5, dtype=np.float32)
    library = Library(trials, np.eye(5), products, columns)
    found = _best_pair(library, best_per_place(singles(library, products, 1000)), 1000)
    assert [sorted(trial.family.name for trial in pair.trials) for pair in found] == [
        ["coulomb_friction", "viscous_friction"]
    ]


@pytest.mark.parametrize(("spring", "limit"), [(GRAVITY_SPRING, True), (ANCHORED_SPRING, False)])
def test_a_limit_has_no_more_shapes_than_the_general_form(spring: Family, limit: bool) -> None:
    """Both are named gravity_spring; a spring between anchors is bent where no cable is."""
    robot = robots.load("tx40")
    assert _is_limit(_trial(robot, spring, 4, 0, 1), _trial(robot, CABLE_SPRING, 4, 1, 2)) is limit


def test_evidence_in_the_rows_of_the_prior_needs_to_exceed_noise_only() -> None:
    robot = robots.load("tx40")
    trials = tuple(
        _trial(robot, family_named(name), 0, start, 1, prior_share)
        for start, (name, prior_share) in enumerate([("rotor_inertia", 0.0), ("coulomb_friction", 0.75)])
    )
    products = np.array([11.0, 10.0])
    library = Library(trials, np.eye(2), products, np.eye(2, dtype=np.float32))
    by_data, by_prior = singles(library, products, 1000)
    assert [_needed(found, 40.0, 140.0) for found in (by_data, by_prior)] == [140.0, 65.0]
    assert by_data.value < 140.0 and by_prior.value > 65.0
    assert by_data.value > by_prior.value


SHAPE = (1e-3, 1.0, 1e5, 0.3)
"""Gap, offset at the link, stiffness and damping of the flanks."""


def _effect(name: str, shape: tuple[float, ...]) -> PlacedEffect:
    robot = robots.load("tx40")
    return family_named(name).effect(robot, Place("drive", (2,)), shape, _Nothing())  # type: ignore[arg-type]


@pytest.mark.parametrize(("name", "wider"), [("joint_elasticity", True), ("hysteresis", False)])
def test_a_factor_away_from_one_widens_what_is_said_of_the_shape(name: str, wider: bool) -> None:
    family = family_named(name)
    sizes = (2e-4, 0.05) if wider else (0.05,)
    noise = np.full(len(sizes), 1e-6)
    said = beside_factor(_effect(family.name, sizes), noise, np.array([0.9]))
    expected = np.hypot(1e-6, 0.1 * np.array(sizes)) if wider else noise
    assert said == pytest.approx(expected)


def test_what_is_not_searched_for_keeps_no_deviation() -> None:
    said = beside_factor(_effect("backlash", SHAPE), np.array([1e-6, 0.0, 0.0, 0.0]), np.array([0.8]))
    assert said == pytest.approx([2e-4, 0.0, 0.0, 0.0], rel=1e-3)


def test_a_parameter_at_its_bound_leaves_the_others_at_their_best() -> None:
    generator = np.random.default_rng(3)
    columns = generator.normal(size=(300, 3))
    columns[:, 1] += 2.0 * columns[:, 0]
    residual = columns @ np.array([-3.0, 2.0, 0.5]) + 0.1 * generator.normal(size=300)
    bounds = np.array([[0.0, np.inf], [0.0, np.inf], [-np.inf, np.inf]])
    found = within_bounds(columns, residual, bounds)
    reference = lsq_linear(columns, residual, (bounds[:, 0], bounds[:, 1])).x
    assert found == pytest.approx(reference, abs=1e-6)
    unbounded = within_bounds(columns, residual, np.tile([-np.inf, np.inf], (3, 1)))
    assert unbounded == pytest.approx(np.linalg.lstsq(columns, residual, rcond=None)[0])


def test_what_stands_in_both_sets_is_not_in_doubt() -> None:
    robot = robots.load("tx40")
    names = [("backlash", 4), ("drifting_friction", 2), ("joint_elasticity", 4), ("saturation", 0)]
    play, drift, soft, limit = (_trial(robot, family_named(n), d, k, 1) for k, (n, d) in enumerate(names))
    chosen = Score((play, drift), 900.0, 880.0, np.ones(2))
    rivals = [Score(pair, 880.0, 870.0, np.ones(2)) for pair in ((soft, drift), (play, limit), (soft, limit))]
    of_play, of_drift = (
        [candidate.words() for candidate in alternatives(chosen, rivals, k, 1000.0)] for k in range(2)
    )
    both = "joint_elasticity (joint 5) and saturation (joint 1)"
    assert of_play == ["joint_elasticity (joint 5)", both]
    assert of_drift == ["saturation (joint 1)", both]
    assert not alternatives(chosen, rivals[:1], 1, 1000.0)


def test_what_another_effect_does_to_other_joints_is_not_for_a_candidate_to_explain() -> None:
    """More data shows more of it: a name that half of them confirmed would be lost with the other half."""
    robot = robots.load("tx40")
    trial = _trial(robot, family_named("viscous_friction"), 0, 0, 1)
    columns: Any = np.zeros((200, 1), dtype=np.float32)
    columns[:100] = 0.1
    library = Library((trial,), np.eye(1), np.array([20.0]), columns)
    joint = np.repeat([0, 1], 100)
    for elsewhere in (10.0, 5000.0):
        examination: Any = SimpleNamespace(
            repeats=True,
            misfit=lambda settings: settings.smallest_share,
            joint_of_rows=joint,
            excess_of_joints=np.array([402.0, elsewhere]),
            excess=402.0 + elsewhere,
            torque=np.zeros(200),
        )
        even = _TieTolerance(examination, library, DEFAULTS)
        assert even.unexplained(*singles(library, library.score, 200)) == pytest.approx(400.0)


def test_where_nothing_repeats_likelihood_alone_decides() -> None:
    """The energy of noise is not known there: a share of it hid what two joints of a real arm showed."""
    examination: Any = SimpleNamespace(repeats=False)
    assert Examination.smallest_share(examination, DEFAULTS) == 0.0
