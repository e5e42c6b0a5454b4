"""The motion that makes parameters visible: exciting trajectories and plain moves."""

from trajectories.approach import approach
from trajectories.errors import PlanError, TrajectoryError
from trajectories.information import Information, Objective
from trajectories.limits import Limits, Margins, Use
from trajectories.motion import Extremes, Motion, MotionSequence, MotionState
from trajectories.plan import plan
from trajectories.trajectory import Detail, Trajectory

__all__ = [
    "Detail",
    "Extremes",
    "Information",
    "Limits",
    "Margins",
    "Motion",
    "MotionSequence",
    "MotionState",
    "Objective",
    "PlanError",
    "Trajectory",
    "TrajectoryError",
    "Use",
    "approach",
    "plan",
]
