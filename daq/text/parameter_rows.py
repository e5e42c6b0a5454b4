"""Parameters as JSON has them, wherever they come from."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Protocol

from daq.text.numbers import json_number


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
        {"name": p.name, "value": json_number(p.value), "sigma": json_number(p.sigma), "unit": p.unit}
        for p in parameters
    ]
