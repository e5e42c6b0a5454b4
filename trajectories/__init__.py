"""The motion that makes parameters visible: exciting trajectories and plain moves."""

from trajectories.approach import approach
from trajectories.collision import CollisionCheck, Nearest
from trajectories.discriminate import Discrimination, discriminate
from trajectories.errors import PlanError, TrajectoryError
from trajectories.information import Information, Objective
from trajectories.judgement import Judge, Judgement, predicted
from trajectories.limits import Limits, Margins, Use
from trajectories.motion import Extremes, Motion, MotionSequence, MotionState, StretchedMotion
from trajectories.noise import TorqueNoise
from trajectories.plan import Conditions, plan
from trajectories.prediction import Prediction, predict
from trajectories.separation import Separation
from trajectories.surroundings import Obstacle, Surroundings
from trajectories.tool_speed import FastestTool, Tool, ToolSpeed
from trajectories.trajectory import Detail, Repeat, Trajectory
from trajectories.wanted import objective_for

__all__ = [
    "CollisionCheck",
    "Conditions",
    "Detail",
    "Discrimination",
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
    "discriminate",
    "objective_for",
    "plan",
    "predict",
    "predicted",
]
