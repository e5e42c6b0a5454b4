"""What effects declare of themselves, against what they do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ident.effects import State
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


def _from(sample: int) -> State:
    torque = None if MOTION.torque is None else MOTION.torque[sample:]
    return State(
        MOTION.position[sample:],
        MOTION.velocity[sample:],
        MOTION.acceleration[sample:],
        TIME[sample:],
        torque,
    )
