"""One effect drawn from a seed: where it sits, its shape, and a size measured in noise floors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivers.errors import DriveError
from drivers.simulated.drawing.exercise import exercise
from drivers.simulated.drawing.gap import Ruler
from drivers.simulated.drawing.places import Place
from drivers.simulated.drawing.recipes import EFFECTS, Recipe
from drivers.simulated.scenario import Scenario
from drivers.simulated.truth import PlantTruth, draw_truth
from robots import Robot
from robots.arrays import FloatArray

_STEPS = 9
_TOLERANCE = 0.15
"""The gap may exceed what was asked for by this share."""


@dataclass(frozen=True)
class DrawnScenario:
    """An effect, and how much of it can be seen. ``gap`` and ``floor`` are (n,), N·m at the joints."""

    effect: str
    axes: tuple[int, ...]
    """Joints or drives that it sits on, from 1; empty where it is of the whole arm."""
    seed: int
    scenario: Scenario
    gap: tuple[float, ...]
    floor: tuple[float, ...]
    ratio: float
    """The largest gap over floor of all joints."""
    shape: Mapping[str, Any]
    """What was drawn beside its size."""

    def with_magnitude(self, magnitude: float) -> Scenario:
        """The same effect there with another size, 1 being the largest that is sensible."""
        return Scenario.from_dict(EFFECTS[self.effect].entries(magnitude, self.axes, dict(self.shape)))

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers for the sealed file, without the scenario itself."""
        return {
            "effect": self.effect,
            "axes": list(self.axes),
            "seed": self.seed,
            "gap": list(self.gap),
            "floor": list(self.floor),
            "ratio": self.ratio,
        }


def draw_scenario(
    robot: Robot,
    effect: str,
    seed: int,
    size: float = 4.0,
    *,
    truth: PlantTruth | None = None,
    reference: FloatArray | None = None,
    allowed: Callable[[tuple[int, ...]], bool] = lambda axes: True,
) -> DrawnScenario:
    """Draws a place and a shape, and finds the magnitude whose gap is ``size`` noise floors.

    Where no sensible magnitude is visible enough at a place (play in a light wrist moves hardly any mass),
    another place is drawn.

    Args:
        robot: the description.
        effect: one of ``EFFECTS``: the vocabulary, or an effect outside it.
        seed: the same seed always gives the same scenario.
        size: gap over noise floor at the joint where that is largest, by simulation; exceeded by 15 % at
            most, or up to twice where the gap jumps with the magnitude.
        truth: the arm; drawn from the seed where None.
        reference: motion on which the gap is measured, (N, n) per SYNC from ``robot.home``;
            :func:`exercise` where None.
        allowed: whether it may sit on these axes, from 1.

    Raises:
        DriveError: no such effect, the arm has no place for it, or no sensible magnitude reaches the size.
    """
    if effect not in EFFECTS:
        raise DriveError(f"effect {effect}: does not exist; allowed: {', '.join(EFFECTS)}")
    if not size > 0:
        raise DriveError(f"size {size:g}; allowed: greater than 0")
    recipe = EFFECTS[effect]
    arm = draw_truth(robot, seed) if truth is None else truth
    motion = exercise(robot) if reference is None else reference
    ruler = Ruler.of(robot, arm, motion)
    rng = np.random.default_rng(np.random.SeedSequence([seed, 0xD7, *effect.encode()]))
    places = [place for place in recipe.places(robot) if allowed(place)]
    if not places:
        raise DriveError(f"effect {effect}: {robot.name} has no place for it")
    for choice in rng.permutation(len(places)):
        place = places[int(choice)]
        shape = recipe.shape(rng, Place(place, robot, ruler))
        if (found := _sized(recipe, shape, place, ruler, size)) is not None:
            scenario, gap = found
            return DrawnScenario(
                effect=effect,
                axes=place,
                seed=seed,
                scenario=scenario,
                gap=tuple(float(value) for value in gap),
                floor=tuple(float(value) for value in ruler.floor),
                ratio=float((gap / ruler.floor).max()),
                shape=shape,
            )
    raise DriveError(
        f"effect {effect}: no sensible magnitude makes a gap of {size:g} noise floors on {robot.name}; "
        "choose a smaller size"
    )


def _sized(
    recipe: Recipe, shape: dict[str, Any], place: tuple[int, ...], ruler: Ruler, size: float
) -> tuple[Scenario, FloatArray] | None:
    """The magnitude up to 1 whose gap is the size, by secants in the logarithms; None where 1 is less."""

    def measured(magnitude: float) -> tuple[Scenario, FloatArray, float]:
        scenario = Scenario.from_dict(recipe.entries(magnitude, place, shape))
        gap = ruler.gap(scenario)
        return scenario, gap, float((gap / ruler.floor).max())

    low, high = (1e-4, 0.0), (1.0, measured(1.0)[2])
    if high[1] < size:
        return None
    magnitude = min(1.0, size / high[1])
    best = None
    for _ in range(_STEPS):
        scenario, gap, ratio = measured(magnitude)
        if ratio >= size and (best is None or ratio < best[2]):
            best = (scenario, gap, ratio)
        if size <= ratio <= (1.0 + _TOLERANCE) * size:
            return scenario, gap
        if ratio < size:
            low = (magnitude, ratio)
        else:
            high = (magnitude, ratio)
        magnitude = _between(low, high, size * (1.0 + 0.5 * _TOLERANCE))
    return None if best is None or best[2] > 2.0 * size else (best[0], best[1])


def _between(low: tuple[float, float], high: tuple[float, float], size: float) -> float:
    """A magnitude for a ratio between two measured ones, kept away from either."""
    bottom, top = np.log(low[0]), np.log(high[0])
    if low[1] > 0:
        share = np.log(size / low[1]) / max(np.log(high[1] / low[1]), 1e-9)
    else:
        # Near zero most effects are linear.
        share = 1.0 + np.log(size / high[1]) / (top - bottom)
    return float(np.exp(bottom + min(max(share, 0.1), 0.9) * (top - bottom)))
