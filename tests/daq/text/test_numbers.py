"""Numbers as the report prints them and as JSON has them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.text.numbers import json_value, percent, probability, significant, with_sigma


@pytest.mark.parametrize(
    ("value", "sigma", "texts"),
    [
        (95.1089, 0.1085, ("95.11", "0.11")),
        (-3.1648, 0.0444, ("−3.165", "0.044")),
        (1234.5, 321.0, ("1230", "320")),
        (9.996, 0.0996, ("10.00", "0.10")),
        (3.21e-7, 4.4e-9, ("3.210·10⁻⁷", "0.044·10⁻⁷")),
        (-0.0001, 0.2, ("0.00", "0.20")),
        (math.nan, math.nan, ("–", "–")),
        (2.0, math.inf, ("2.000", "∞")),
        (95.1089, 0.0, ("95.11", "0")),
    ],
)
def test_sigma_sets_the_digits(value: float, sigma: float, texts: tuple[str, str]) -> None:
    assert with_sigma(value, sigma) == texts


@given(
    value=st.floats(-1e9, 1e9),
    sigma=st.floats(1e-12, 1e9),
)
def test_rounding_never_moves_a_value_by_more_than_a_share_of_sigma(value: float, sigma: float) -> None:
    shown = with_sigma(value, sigma)[0].replace("−", "-")
    superscript = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    mantissa, _, power = shown.partition("·10")
    number = float(mantissa) * 10.0 ** (int(power.translate(superscript)) if power else 0)
    assert abs(number - value) <= 0.051 * sigma + 1e-9 * abs(value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (significant(0.00012345), "0.000123"),
        (significant(1.2e-9), "1.20·10⁻⁹"),
        (significant(5294.0, 4), "5294"),
        (significant(None), "–"),
        (percent(4.0834), "4.08\u00a0%"),
        (percent(math.inf), "∞"),
        (percent(512.3), "512\u00a0%"),
        (probability(3e-12), "p < 0.0001"),
        (probability(0.0431), "p = 0.043"),
    ],
)
def test_number_texts(text: str, expected: str) -> None:
    assert text == expected


def test_values_as_json_has_them() -> None:
    given = {"a": np.array([[1.0, math.nan], [math.inf, 2.5]]), "b": (np.int64(3), True, None, "x")}
    assert json_value(given) == {"a": [[1.0, None], [None, 2.5]], "b": [3, True, None, "x"]}
    assert type(json_value(np.float32(1.5))) is float
