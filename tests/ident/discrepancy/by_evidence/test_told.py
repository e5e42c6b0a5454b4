"""An effect that contains several others has to be likelier by the data than all of them together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from ident.discrepancy.by_evidence.decide.told import unsure
from ident.effects.family import Shape
from robots.arrays import FloatArray
from tests.ident.discrepancy.by_evidence.toy_effects import family, problem_of, searching, torque, wave, waves

PART = Shape("part", "1", (0.2, 0.6), 0.0, 1.0)


def both(position: FloatArray, shape: Sequence[float]) -> FloatArray:
    """Nine half waves, and a part of seventeen."""
    return wave(9.0, position) + shape[0] * wave(17.0, position)


NINE, THIRTEEN = waves("nine", w9=1.0), waves("thirteen", w13=1.0)
BOTH = family(
    "both", both, (PART,), contains=("nine", "thirteen"), beside=lambda position, _: wave(13.0, position)
)


def said(part: float, contains: tuple[str, ...] = ("nine", "thirteen")) -> str:
    """Of the one effect that is found where both waves are, and so much of a third."""
    search = searching(
        problem_of(lambda position: torque(position, w9=1.0, w13=1.0, w17=part)),
        [NINE, THIRTEEN, replace(BOTH, contains=contains)],
    )
    searched = search.run()
    (member,) = searched.found.members
    assert member.candidate.key == ("both", (0,))
    return unsure(search, searched, 0, np.full(2, 0.1))


def test_what_two_names_say_together_is_no_name_of_its_own() -> None:
    """Two frictions of one joint were a drift that settles in 2000 ± 18 000 s."""
    assert said(0.0) == "nine and thirteen say as much as this both"


@pytest.mark.parametrize("part", [0.3, 0.6])
def test_what_two_names_do_not_say_makes_it_another(part: float) -> None:
    assert said(part) == ""


def test_an_effect_that_contains_nothing_stands() -> None:
    assert said(0.0, contains=()) == ""


def test_sizes_come_first() -> None:
    """What has to be there is not: no names are asked what they say."""
    search = searching(
        problem_of(lambda position: torque(position, w9=1.0, w17=0.6)), [replace(BOTH, essential=(1,))]
    )
    said = unsure(search, search.run(), 0, np.full(2, 0.1))
    assert said.startswith("both_beside") and said.endswith("which may as well be nothing")
