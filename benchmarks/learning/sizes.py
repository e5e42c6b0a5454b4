"""How large an effect has to be to be seen so well: measured once per effect and place, by simulation."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drivers.errors import DriveError
from drivers.simulated import draw_truth
from drivers.simulated.drawing import EFFECTS, exercise
from drivers.simulated.drawing.gap import Ruler
from drivers.simulated.drawing.places import Place
from drivers.simulated.scenario import Scenario
from robots import Robot

Axes = tuple[int, ...]
_STEP = 10**-0.5
_STEPS = 9
_LEAST = 0.3
"""Noise floors below which no smaller magnitude is tried."""
_SECONDS = 3.2
_VISIBLE = 1.0
"""Noise floors that the largest magnitude has to show, or the place has no such effect."""


@dataclass(frozen=True)
class Sizes:
    """Noise floors of the gap over the recipe's magnitude.

    Attributes:
        measured: effect: place: pairs of magnitude and noise floors, largest magnitude first.
    """

    measured: Mapping[str, Mapping[Axes, Sequence[tuple[float, float]]]]

    @property
    def effects(self) -> list[str]:
        """Effects that have a place."""
        return [effect for effect, places in self.measured.items() if places]

    def places(self, effect: str) -> list[Axes]:
        """Where an effect can be seen."""
        return list(self.measured[effect])

    def magnitude(self, effect: str, place: Axes, floors: float) -> float:
        """The magnitude, at most 1, with a gap of so many noise floors, between the measured ones."""
        pairs = sorted(self.measured[effect][place])
        magnitude, seen = np.log(np.maximum(np.array(pairs), 1e-9)).T
        rising = np.maximum.accumulate(seen) + 1e-9 * np.arange(len(seen))
        return float(np.exp(np.interp(np.log(floors), rising, magnitude)))

    def save(self, path: Path) -> None:
        """As JSON."""
        content = {
            effect: [[list(place), list(map(list, pairs))] for place, pairs in places.items()]
            for effect, places in self.measured.items()
        }
        path.write_text(json.dumps(content), encoding="utf-8")

    @classmethod
    def load(cls, path: Path) -> Sizes:
        """The inverse of :meth:`save`."""
        content = json.loads(path.read_text(encoding="utf-8"))
        return cls(
            {
                effect: {tuple(place): [(m, r) for m, r in pairs] for place, pairs in places}
                for effect, places in content.items()
            }
        )


def measure(robot: Robot, effects: Sequence[str], seed: int, seconds: float = _SECONDS) -> Sizes:
    """Sizes on one arm and one motion of a seed."""
    truth, path = draw_truth(robot, seed), exercise(robot, seconds, seed)
    ruler, rng = Ruler.of(robot, truth, path), np.random.default_rng([seed, 0x512E])
    measured: dict[str, dict[Axes, list[tuple[float, float]]]] = {}
    for effect in effects:
        places = dict.fromkeys(EFFECTS[effect].places(robot))
        of_effect = {place: _curve(robot, ruler, effect, place, rng) for place in places}
        measured[effect] = {
            place: curve for place, curve in of_effect.items() if curve and curve[0][1] >= _VISIBLE
        }
    return Sizes(measured)


def _curve(
    robot: Robot, ruler: Ruler, effect: str, place: Axes, rng: np.random.Generator
) -> list[tuple[float, float]]:
    found: list[tuple[float, float]] = []
    for step in range(_STEPS):
        magnitude = _STEP**step
        scenario = scenario_of(robot, ruler, effect, place, magnitude, rng)
        try:
            gap = ruler.gap(scenario)
        except DriveError:  # a gear stiffer than the plant's step allows: smaller ones are stiffer still
            break
        found.append((magnitude, float((gap / ruler.floor).max())))
        if found[-1][1] < _LEAST:
            break
    return found


def scenario_of(
    robot: Robot, ruler: Ruler, effect: str, place: Axes, magnitude: float, rng: np.random.Generator
) -> Scenario:
    """The effect at a place with a shape drawn anew."""
    recipe = EFFECTS[effect]
    shape = recipe.shape(rng, Place(place, robot, ruler))
    return Scenario.from_dict(recipe.entries(magnitude, place, shape))
