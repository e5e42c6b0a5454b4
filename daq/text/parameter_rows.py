"""Parameters as JSON has them, wherever they come from."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, Protocol


class Parameter(Protocol):
    """A value with its deviation."""

    @property
    def name(self) -> str: ...
    @property
    def value(self) -> float: ...
    @property
    def sigma(self) -> float: ...
    @property
    def unit(self) -> str: ...


def parameter_rows(parameters: Iterable[Parameter]) -> list[dict[str, Any]]:
    """One object a parameter."""
    return [
        {"name": p.name, "value": number(p.value), "sigma": number(p.sigma), "unit": p.unit}
        for p in parameters
    ]


def number(value: float | None) -> float | None:
    """A number that JSON has; null for the others."""
    return float(value) if value is not None and math.isfinite(value) else None
