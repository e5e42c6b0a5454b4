"""Numbers as the report prints them (digits by the uncertainty, typographic signs) and as JSON has them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_MOST_DECIMALS = 6
NOTHING = "–"
"""What stands where there is no number."""


def json_number(value: float | None) -> float | None:
    """A number that JSON has; null for NaN, the infinities and what is not there."""
    return float(value) if value is not None and math.isfinite(value) else None


def json_value(value: Any) -> Any:
    """Any value as JSON has it: arrays and tuples as lists, numbers as of :func:`json_number`."""
    if hasattr(value, "tolist"):  # numpy's arrays and numbers
        value = value.tolist()
    if isinstance(value, dict):
        return {key: json_value(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [json_value(part) for part in value]
    return json_number(value) if isinstance(value, float) else value


def _exponent(value: float) -> int:
    """Decimal exponent of a finite, non-zero value after rounding it to two significant digits."""
    return int(f"{abs(value):.1e}".split("e")[1])


def _not_finite(value: float | None) -> str | None:
    if value is None or math.isnan(value):
        return NOTHING
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    return None


def _fixed(value: float, decimals: int) -> str:
    """``value`` with so many decimals; negative ``decimals`` round to tens, hundreds…"""
    text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    if float(text) == 0.0:
        text = text.lstrip("-")
    return text.replace("-", "−")


def significant(value: float | None, digits: int = 3, signed: bool = False) -> str:
    """A number with so many significant digits, in powers of ten where decimals would be long."""
    special = _not_finite(value)
    if special is not None or value is None:
        return special or NOTHING
    if value == 0.0:
        return "0"
    exponent = int(f"{abs(value):.{digits - 1}e}".split("e")[1])
    sign = "+" if signed and value > 0 else ""
    if -4 <= exponent <= max(digits, 5):
        return sign + _fixed(value, digits - 1 - exponent)
    mantissa = _fixed(value / 10.0**exponent, digits - 1)
    return f"{sign}{mantissa}·10{str(exponent).translate(_SUPERSCRIPT)}"


def with_sigma(value: float, sigma: float, *others: float | None) -> tuple[str, ...]:
    """Value, standard deviation and further numbers of the same kind, rounded to the same digit.

    The standard deviation keeps two significant digits and sets the decimals of the rest; where it is
    zero or not finite, each number keeps four significant digits of its own.

    Returns:
        One text per number, in the order of the arguments.
    """
    numbers = (value, sigma, *others)
    if not math.isfinite(sigma) or sigma <= 0.0:
        return tuple(significant(number, 4) for number in numbers)
    decimals = 1 - _exponent(sigma)
    if decimals <= _MOST_DECIMALS:
        return tuple(_not_finite(number) or _fixed(float(number or 0.0), decimals) for number in numbers)
    largest = max((abs(x) for x in numbers if x is not None and math.isfinite(x)), default=sigma)
    power = _exponent(largest)
    unit = f"·10{str(power).translate(_SUPERSCRIPT)}"
    return tuple(
        _not_finite(number) or _fixed(float(number or 0.0) / 10.0**power, decimals + power) + unit
        for number in numbers
    )


def percent(value: float | None) -> str:
    """A percentage with its sign: three significant digits, none after the point above 100."""
    special = _not_finite(value)
    if special is not None or value is None:
        return special or NOTHING
    if abs(value) >= 1e5:
        return f"{significant(value, 2)}\u00a0%"
    return f"{_fixed(value, 0) if abs(value) >= 100 else significant(value, 3)}\u00a0%"


def setting(value: float | None) -> str:
    """A number that somebody chose: up to four significant digits, no trailing zeros."""
    text = significant(value, 4)
    mantissa, point, power = text.partition("·")
    return (mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa) + point + power


def correlation(value: float | None) -> str:
    """A correlation coefficient with two decimals."""
    special = _not_finite(value)
    if special is not None or value is None:
        return special or NOTHING
    return _fixed(value, 2)


def with_units(values: Sequence[str], units: Sequence[str]) -> str:
    """Figures of the joints and their units: the unit once where all have the same one."""
    if len(set(units)) == 1:
        return f"{'  '.join(values)} {units[0]}"
    return "  ".join(f"{value} {unit}" for value, unit in zip(values, units, strict=True))


def mixed_unit(units: Sequence[str]) -> str:
    """Of a figure over all joints, which is of two kinds where some of them slide."""
    return " and ".join(dict.fromkeys(units))


def probability(value: float | None) -> str:
    """A p-value as ``p = 0.031`` or ``p < 0.0001``."""
    if value is None or math.isnan(value):
        return NOTHING
    if value < 1e-4:
        return "p < 0.0001"
    return f"p = {significant(value, 2)}"


def count(value: int) -> str:
    """A whole number with thin spaces between thousands."""
    return f"{value:,}".replace(",", "\u202f")
