"""The simulated arm: CiA 402 drives with position loops on a bus, and the plant they move."""

from drivers.simulated.arm import SimulatedArm
from drivers.simulated.faults import DeadAt, EmergencyAt, Faults, LostFrames
from drivers.simulated.offline import SimulatedRun, simulate_offline
from drivers.simulated.truth import PlantTruth, draw_truth, nominal_truth

__all__ = [
    "DeadAt",
    "EmergencyAt",
    "Faults",
    "LostFrames",
    "PlantTruth",
    "SimulatedArm",
    "SimulatedRun",
    "draw_truth",
    "nominal_truth",
    "simulate_offline",
]
