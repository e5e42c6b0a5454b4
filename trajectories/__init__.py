"""The motion that makes parameters visible: exciting trajectories and plain moves."""

from trajectories.approach import approach
from trajectories.collision import CollisionCheck, Nearest
from trajectories.errors import PlanError, TrajectoryError
from trajectories.information import Information, Objective
from trajectories.limits import Limits, Margins, Use
from trajectories.motion import Extremes, Motion, MotionSequence, MotionState
from trajectories.plan import plan
from trajectories.surroundings import Obstacle, Surroundings
from trajectories.trajectory import Detail, Trajectory

__all__ = [
    "CollisionCheck",
    "Detail",
    "Extremes",
    "Information",
    "Limits",
    "Margins",
    "Motion",
    "MotionSequence",
    "MotionState",
    "Nearest",
    "Objective",
    "Obstacle",
    "PlanError",
    "Surroundings",
    "Trajectory",
    "TrajectoryError",
    "Use",
    "approach",
    "plan",
]
