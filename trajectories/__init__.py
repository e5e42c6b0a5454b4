"""The motion that makes parameters visible: exciting trajectories and plain moves."""

from trajectories.approach import approach, as_far_as_clear
from trajectories.constraints.collision import CollisionCheck, Nearest
from trajectories.constraints.surroundings import Obstacle, Surroundings
from trajectories.constraints.tool_speed import FastestTool, Tool, ToolSpeed
from trajectories.constraints.use import Use
from trajectories.discriminate import Discrimination, discriminate
from trajectories.errors import PlanError, TrajectoryError
from trajectories.information.expected import ExpectedValues
from trajectories.information.matrix import Information, Objective
from trajectories.information.noise import TorqueNoise
from trajectories.information.prediction import Prediction, predict
from trajectories.information.separation import Separation
from trajectories.information.wanted import objective_for
from trajectories.judgement import Conditions, Judge, Judgement, predicted
from trajectories.limits import Limits, Margins
from trajectories.motions.motion import Extremes, Motion, MotionSequence, MotionState, StretchedMotion
from trajectories.plan import plan
from trajectories.trajectory import Detail, Repeat, Trajectory

__all__ = [
    "CollisionCheck",
    "Conditions",
    "Detail",
    "Discrimination",
    "ExpectedValues",
    "Extremes",
    "FastestTool",
    "Information",
    "Judge",
    "Judgement",
    "Limits",
    "Margins",
    "Motion",
    "MotionSequence",
    "MotionState",
    "Nearest",
    "Objective",
    "Obstacle",
    "PlanError",
    "Prediction",
    "Repeat",
    "Separation",
    "StretchedMotion",
    "Surroundings",
    "Tool",
    "ToolSpeed",
    "TorqueNoise",
    "Trajectory",
    "TrajectoryError",
    "Use",
    "approach",
    "as_far_as_clear",
    "discriminate",
    "objective_for",
    "plan",
    "predict",
    "predicted",
]
