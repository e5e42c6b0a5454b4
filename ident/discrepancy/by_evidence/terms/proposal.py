"""A term as it is reported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Proposal:
    """A term for one joint (from 1).

    Attributes:
        joint, formula, unit: τ gets value · formula.
        value, sigma: of the factor.
        variables: what it is made of.
        stability: share of halves of the recording that chose its variables.
        before, after: share of the joint's torque that is left beyond noise on recordings that were not
            fitted, without any term and with all of the joint.
        looks_like: what in nature does.
    """

    joint: int
    formula: str
    unit: str
    value: float
    sigma: float
    variables: tuple[str, ...]
    stability: float
    before: float
    after: float
    looks_like: str

    def as_json(self) -> dict[str, Any]:
        """As plain values."""
        return {
            "joint": self.joint,
            "formula": self.formula,
            "value": self.value,
            "sigma": self.sigma,
            "unit": self.unit,
            "variables": list(self.variables),
            "stability": self.stability,
            "unexplained": {"before": self.before, "after": self.after},
            "looks_like": self.looks_like,
        }
