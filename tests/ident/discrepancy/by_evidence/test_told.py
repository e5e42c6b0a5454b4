"""An effect that contains several others is these where it is no likelier by the data than all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from ident.discrepancy.by_evidence.decide.told import simplified, unsure
from ident.effects.family import Shape
from robots.arrays import FloatArray
from tests.ident.discrepancy.by_evidence.toy_effects import (
    NotLookedAt,
    family,
    found_alone,
    names_of,
    problem_of,
    searching,
    torque,
    wave,
    waves,
)

PART = Shape("part", "1", (0.2, 0.6), 0.0, 1.0)


def both(position: FloatArray, shape: Sequence[float]) -> FloatArray:
    """Nine half waves, and a part of seventeen."""
    return wave(9.0, position) + shape[0] * wave(17.0, position)


PARTS = ("coulomb_friction", "viscous_friction")
NINE, THIRTEEN = waves(PARTS[0], w9=1.0), waves(PARTS[1], w13=1.0)
BOTH = family(
    "drifting_friction", both, (PART,), contains=PARTS, beside=lambda position, _: wave(13.0, position)
)


def simplest(part: float, contains: tuple[str, ...] = PARTS) -> list[str]:
    """Names that are left of one effect, which is found where both waves are, and so much of a third."""
    search = searching(
        problem_of(lambda position: torque(position, w9=1.0, w13=1.0, w17=part)),
        [NINE, THIRTEEN, replace(BOTH, contains=contains)],
    )
    searched = search.run()
    assert names_of(searched) == ["drifting_friction"]
    return names_of(simplified(search, searched, NotLookedAt()))


def test_what_two_names_say_together_is_these_two() -> None:
    """Two frictions of one joint were a drift that settles in 2000 ± 18 000 s."""
    assert simplest(0.0) == list(PARTS)


@pytest.mark.parametrize("part", [0.3, 0.6])
def test_what_two_names_do_not_say_makes_it_another(part: float) -> None:
    assert simplest(part) == ["drifting_friction"]


def test_an_effect_that_contains_nothing_stands() -> None:
    assert simplest(0.0, contains=()) == ["drifting_friction"]


def test_of_what_it_contains_only_what_is_there_is_left() -> None:
    """What is superfluous of the names goes, as it does of any set."""
    search = searching(problem_of(lambda position: torque(position, w9=1.0)), [NINE, THIRTEEN, BOTH])
    assert names_of(simplified(search, found_alone(search, BOTH), NotLookedAt())) == ["coulomb_friction"]


def test_a_size_that_may_be_nothing_is_told() -> None:
    """What has to be there is not."""
    search = searching(
        problem_of(lambda position: torque(position, w9=1.0, w17=0.6)), [replace(BOTH, essential=(1,))]
    )
    said = unsure(search.run().found, 0, np.full(2, 0.1))
    assert said.startswith("drifting_friction_beside") and said.endswith("which may as well be nothing")
