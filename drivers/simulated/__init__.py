"""The simulated arm: CiA 402 drives with position loops on a bus, and the plant they move."""

from drivers.simulated.arm import SimulatedArm
from drivers.simulated.drawing import DrawnScenario, draw_scenario
from drivers.simulated.faults import DeadAt, EmergencyAt, Faults, LostFrames
from drivers.simulated.offline import SimulatedRun, simulate_offline
from drivers.simulated.physics.entry_points import is_compiled
from drivers.simulated.scenario import Scenario, ScenarioError, load_scenario
from drivers.simulated.seal import open_seal, sealed_content, write_seal
from drivers.simulated.truth import PlantTruth, draw_truth, nominal_truth

__all__ = [
    "DeadAt",
    "DrawnScenario",
    "EmergencyAt",
    "Faults",
    "LostFrames",
    "PlantTruth",
    "Scenario",
    "ScenarioError",
    "SimulatedArm",
    "SimulatedRun",
    "draw_scenario",
    "draw_truth",
    "is_compiled",
    "load_scenario",
    "nominal_truth",
    "open_seal",
    "sealed_content",
    "simulate_offline",
    "write_seal",
]
