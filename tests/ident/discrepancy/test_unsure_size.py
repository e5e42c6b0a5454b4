"""What makes an effect that effect and is not told from nothing, in words."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from ident.discrepancy.accepted import unsure_size

EFFECT: Any = SimpleNamespace(
    parameters=(SimpleNamespace(name="Fc1", unit="N·m"), SimpleNamespace(name="ratio", unit="1"))
)


def test_the_surest_of_parameters_that_are_not_told_from_nothing_is_said() -> None:
    sigma = np.array([1.0, 0.2])
    said = unsure_size(EFFECT, (), np.array([1.0, 0.3]), sigma, there=False)
    assert said == "ratio is 0.3 ± 0.2, which may as well be nothing"
    assert unsure_size(EFFECT, (), np.array([1.0, 0.3]), sigma, there=True) == ""
    assert unsure_size(EFFECT, (), np.array([1.0, 0.5]), sigma, there=False) == ""


def test_what_an_effect_cannot_do_without_has_to_be_told() -> None:
    said = unsure_size(EFFECT, (0,), np.array([1.0, 0.5]), np.array([1.0, 0.2]), there=True)
    assert said == "Fc1 is 1 ± 1 N·m, which may as well be nothing"


def test_a_factor_without_bounds_is_no_warning() -> None:
    """Of a column that is next to nothing; numpy said so on the terminal."""
    said = unsure_size(EFFECT, (), np.array([0.0, 1e200]), np.array([1.0, 0.0]), there=False)
    assert said == ""
    values, sigma = np.array([0.0, 1e200]), np.array([1.0, 1e201])
    assert unsure_size(EFFECT, (), values, sigma, there=False).startswith("ratio is 1e+200")
    assert unsure_size(EFFECT, (0,), np.array([0.0, 1e200]), np.zeros(2), there=False).startswith("Fc1 is 0")
    assert unsure_size(EFFECT, (), np.array([0.0, 1e200]), np.zeros(2), there=False) == ""
