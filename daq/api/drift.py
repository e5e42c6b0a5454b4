"""Has an arm moved away from what it was?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from daq.api.frames import frame
from daq.api.identification import IdentifiedModel
from daq.api.picture import Picture, traces
from ident.drift import Comparison, Night, compare, geometry_of
from robots import Robot


@dataclass(frozen=True)
class Drift:
    """Nights of one arm beside the first.

    Attributes:
        arm: which.
        comparison: of the last night with the first; ``comparison.state`` is ``unchanged`` or ``changed``.
        torque: (nights, n) what the parameters' change makes on the trajectory, as a share of its torque.
    """

    arm: Robot
    comparison: Comparison
    torque: np.ndarray

    @property
    def moved(self) -> bool:
        """Whether anything has."""
        return self.comparison.state == "changed"

    def summary(self) -> str:
        """The sentence, and what moved."""
        moved = [
            f"  {p.name}: {p.change:+.3g} ± {p.sigma:.2g} {p.unit}" for p in self.comparison.parameters[:10]
        ]
        return "\n".join([self.comparison.sentence, *moved])

    def to_frame(self) -> Any:
        """One row per parameter that moved (pandas)."""
        found = self.comparison.parameters
        columns = {
            "parameter": [p.name for p in found],
            "change": [p.change for p in found],
            "sigma": [p.sigma for p in found],
            "unit": [p.unit for p in found],
        }
        return frame(columns, "parameter")

    def plot(self) -> Picture:
        """Change of the torque of each joint since the first night, % of its torque."""
        names = [joint.name for joint in self.arm.joint]
        nights = np.arange(float(len(self.torque)))
        return traces(
            "Change since the first night",
            names,
            ["%"] * len(names),
            nights,
            {"torque": 100.0 * self.torque},
            "nights",
        )


def drift(models: Sequence[IdentifiedModel]) -> Drift:
    """Compare the last model with the first, and with the nights between them.

    Args:
        models: of one arm on one trajectory, one per night, oldest first; at least two.

    Raises:
        IdentificationError: fewer than two, or they have other parameters than the first.
    """
    nights = [
        Night(
            float(day),
            one.fitted.result.least_squares.values,
            one.fitted.result.least_squares.covariance,
            label=f"night {day}",
        )
        for day, one in enumerate(models)
    ]
    last = models[-1].fitted
    geometry = geometry_of(last.base, last.rows, last.least_squares.sigma, nights[0].values)
    found = compare(nights[0], nights[1:], geometry)
    usual = geometry.torque_rms(geometry.beta)
    change = [geometry.torque_rms(night.values - nights[0].values) / usual for night in nights]
    return Drift(models[-1].arm, found, np.array(change))
