"""The simulated arm: CiA 402 drives with position loops on a bus, and the plant they move."""

from drivers.simulated.arm import SimulatedArm
from drivers.simulated.faults import DeadAt, EmergencyAt, Faults, LostFrames
from drivers.simulated.offline import SimulatedRun, simulate_offline
from drivers.simulated.scenario import Scenario, ScenarioError, load_scenario
from drivers.simulated.truth import PlantTruth, draw_truth, nominal_truth

__all__ = [
    "DeadAt",
    "EmergencyAt",
    "Faults",
    "LostFrames",
    "PlantTruth",
    "Scenario",
    "ScenarioError",
    "SimulatedArm",
    "SimulatedRun",
    "draw_truth",
    "load_scenario",
    "nominal_truth",
    "simulate_offline",
]
