"""Plan an exciting trajectory."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from daq.api.frames import frame
from daq.api.picture import Picture, traces
from daq.api.recordings import Place, load_arm
from daq.api.said import said
from daq.planning.plan import run_plan
from daq.planning.plan_result import PlanRequest, PlanResult
from daq.planning.plan_terminal import print_plan
from daq.text.progress import Silent
from robots import Robot


@dataclass(frozen=True)
class Plan:
    """A planned motion, and what it will tell.

    Attributes:
        result: everything that ``armhil plan`` returns; ``result.trajectory`` has the set-points.
    """

    result: PlanResult

    @property
    def path(self) -> Path:
        """The trajectory file, which ``armhil run`` streams."""
        return self.result.files["trajectory"]

    def summary(self) -> str:
        """Predicted parameters, use of the limits, the verdict."""
        return said(lambda console: print_plan(console, self.result))

    def to_frame(self) -> Any:
        """One row per parameter: expected value and the σ that the motion promises (pandas)."""
        found = self.result.trajectory.detail.prediction
        if found is None:
            return frame({"parameter": [], "expected": [], "sigma": [], "percent_sigma": []}, "parameter")
        columns = {
            "parameter": list(found.names),
            "expected": found.values,
            "sigma": found.sigma,
            "percent_sigma": found.percent_sigma,
        }
        return frame(columns, "parameter")

    def plot(self) -> Picture:
        """The positions."""
        arm, motion = self.result.robot, self.result.trajectory
        names, units = [joint.name for joint in arm.joint], [joint.unit for joint in arm.joint]
        return traces(f"{arm.name}: planned", names, units, motion.time, {"position": motion.position})


def plan(arm: Robot | Place, out: Place, **request: Any) -> Plan:
    """Plan a motion that shows the parameters, and write it.

    Args:
        arm: which.
        out: folder for the trajectory file and its page.
        request: further fields of :class:`daq.planning.plan.PlanRequest`, as ``duration`` or ``evaluations``.

    Raises:
        UserError: no motion meets the request, or a file cannot be written.
    """
    robot = arm if isinstance(arm, Robot) else load_arm(arm)
    return Plan(run_plan(PlanRequest(robot, out=Path(out), **request), Silent()))
