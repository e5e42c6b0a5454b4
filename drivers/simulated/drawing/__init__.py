"""Scenarios drawn from a seed for blind tests: one effect, a place, and a size that noise does not hide."""

from drivers.simulated.drawing.draw import DrawnScenario, draw_scenario
from drivers.simulated.drawing.exercise import exercise
from drivers.simulated.drawing.recipes import EFFECTS

__all__ = ["EFFECTS", "DrawnScenario", "draw_scenario", "exercise"]
