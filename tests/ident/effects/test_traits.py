"""What effects declare of themselves, against what they do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.effects import State
from ident.effects.elastic_gear import link_inertia
from ident.effects.placed import Family
from ident.effects.vocabulary import VOCABULARY, confused_with
from tests.ident.effects.test_vocabulary import MOTION, TIME, TX40, middle, present

FORMS = [form for family in VOCABULARY for form in (family, *family.forms)]
NAMES = {family.name for family in VOCABULARY}


@pytest.mark.parametrize("family", VOCABULARY, ids=lambda family: family.name)
def test_names_that_pass_for_each_other_do_so_both_ways(family: Family) -> None:
    for other in confused_with(family.name):
        assert family.name in confused_with(other)
    assert set(family.confused_with) <= set(confused_with(family.name)) <= NAMES - {family.name}
    assert set(family.told_from) <= NAMES - {family.name}
    assert family.settled_by


def test_a_pair_is_declared_once() -> None:
    pairs = [frozenset((family.name, other)) for family in VOCABULARY for other in family.told_from]
    assert len(pairs) == len(set(pairs))


@pytest.mark.parametrize("family", FORMS, ids=lambda family: family.name)
def test_only_a_history_makes_what_was_before_matter(family: Family) -> None:
    """Of a motion that is begun later, the end is the same; without its order, what has a history is not."""
    place = family.places(TX40)[-1]
    shapes = zip(family.shapes(TX40, place), middle(family, TX40, place), strict=True)
    within = tuple(0.5 * TIME[-1] if shape.name == "instant" else value for shape, value in shapes)
    effect = family.effect(TX40, place, within, present("tx40"))
    columns, size = effect.columns(MOTION), TIME.size
    if family.history:
        alone = replace(MOTION, time=None)
        assert not np.allclose(effect.columns(alone), columns, atol=1e-3 * np.abs(columns).max())
    else:
        later = _from(size // 3)
        end = slice(2 * size // 3, size - size // 10)
        shown = effect.columns(later)[end.start - size // 3 : end.stop - size // 3]
        np.testing.assert_allclose(shown, columns[end], atol=1e-3 * np.abs(columns).max())


@pytest.mark.parametrize("name", ["joint_elasticity", "stiffening_elasticity"])
@pytest.mark.parametrize("hertz", [7.0, 16.0, 33.0, 50.0])
def test_a_gear_that_gives_way_begins_near_any_that_a_recording_shows(name: str, hertz: float) -> None:
    """One that stiffens from 50 Hz on was a play, while the stiffest of the grid had 20 Hz."""
    family = next(one for one in VOCABULARY if one.name == name)
    for place in family.places(TX40):
        compliance = family.shapes(TX40, place)[0]
        there = 1.0 / (link_inertia(TX40, place.joints[0]) * (2.0 * np.pi * hertz) ** 2)
        assert np.abs(np.log(np.array(compliance.grid) / there)).min() < np.log(1.5)
        assert compliance.lower < there < compliance.upper


def _from(sample: int) -> State:
    torque = None if MOTION.torque is None else MOTION.torque[sample:]
    return State(
        MOTION.position[sample:],
        MOTION.velocity[sample:],
        MOTION.acceleration[sample:],
        TIME[sample:],
        torque,
    )
