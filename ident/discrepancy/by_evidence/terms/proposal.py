"""A term as it is reported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

NOTES = {
    "own model": "a parameter of the model that has changed: friction, inertia or offset of the drive",
    "speed": "drag of air or lubricant, an eddy-current brake, a hose",
    "position": "a spring or counterbalance that is not linear, a dress pack",
    "position and speed": "lubricant that is thicker at one end of the travel, a damper with a lever",
    "position and sign": "a seal or brake that rubs more at one end of the travel",
    "load": "a bearing or gear under load, a torque constant that droops",
    "load and speed": "losses of a gear with load and speed, a worm or wave gear",
    "time": "warming up, a drift of the torque sensor or the drive's offset",
    "angle": "an unbalance, a magnet or cogging with the turn of the joint",
    "angle and sign": "a bent shaft, an eccentric bearing, a brake disc that is not flat",
    "angle and speed": "an eccentric rotor in a brake's field, a bearing out of round",
    "neighbour": "crosstalk between drives, a cable over both joints, a coupling of the gears",
}
"""Per family of the dictionary, what in nature looks like it."""


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
