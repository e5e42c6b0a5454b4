"""Short motions of the one-axis arm, and an arm order on a bus of the test's own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from daq.recording.trajectory_file import write_trajectory
from daq.session.bench import ArmOrder
from drivers import Channel
from robots import Robot
from trajectories import MotionSequence, Repeat, Trajectory, approach


def there_and_back(
    robot: Robot, *, periods: int = 1, distance: float = 0.03, speed: float = 0.6
) -> Trajectory:
    """From home to a posture beside it and back, some times over; each period begins and ends at rest."""
    home = np.array(robot.home)
    beside = home.copy()
    beside[0] += distance
    cycle = robot.bus.cycle_time
    way, back = (approach(robot, a, b, cycle, speed).motion for a, b in ((home, beside), (beside, home)))
    period = way.duration + back.duration
    return Trajectory.sampled(
        MotionSequence((way, back) * periods),
        cycle,
        family="ruckig",
        seed=4,
        repeat=Repeat(0.0, period, periods),
    )


def written(folder: Path, robot: Robot, trajectory: Trajectory) -> Path:
    path = folder / "motion.trajectory.json"
    write_trajectory(path, trajectory, robot)
    return path


def order(robot: Robot, channel: Channel, source: str = "emps", **more: object) -> ArmOrder:
    return ArmOrder(robot, source, channel, **more)  # type: ignore[arg-type]


def refusing(asked: list[str]) -> Callable[[str], bool]:
    """Somebody who keeps what is asked and answers no."""

    def no(question: str) -> bool:
        asked.append(question)
        return False

    return no
