"""The picture of the live view in the docs: a slow run of the simulated arm, 3.6 s after its beginning.

PYTHONPATH=. python benchmarks/live_view_picture.py [docs/images/live-view.svg]
"""

from __future__ import annotations

import re
import sys
from io import StringIO
from pathlib import Path

import numpy as np
from rich._export_format import CONSOLE_SVG_FORMAT
from rich.console import Console

import robots
from daq.session.live_view import LiveView
from daq.session.states import Conduct
from drivers import Samples
from drivers.simulated.offline import simulate_offline
from drivers.simulated.truth import draw_truth
from robots.arrays import FloatArray
from trajectories import Trajectory
from trajectories.motions.sampled import sampled_motion

SECONDS, SHOWN = 30.0, 3.6
WIDTH = 100
FORMAT = re.sub(r"<!--.*?-->|@font-face \{\{.*?\}\}", "", CONSOLE_SVG_FORMAT, flags=re.DOTALL)
FORMAT = FORMAT.replace("Fira Code, ", "")
"""Without the fonts that it would fetch from elsewhere."""


def main() -> None:
    """Simulate, show, write."""
    robot = robots.load("tx40")
    period = robot.bus.cycle_time
    time = np.arange(round(SECONDS / period)) * period
    reference = motion(np.array(robot.home), time)
    run = simulate_offline(robot, draw_truth(robot, 3), reference[: round(SHOWN / period)])
    rows = len(run.position)
    samples = Samples(
        cycle=np.arange(rows),
        time=period * np.arange(rows),
        reference=run.reference,
        position=run.position,
        control_signal=run.control_signal,
        statusword=np.full(run.position.shape, 0x1237, dtype=np.uint16),
        complete=np.ones(run.position.shape, dtype=np.bool_),
        lateness=np.full(rows, 3e-5),
    )
    console = Console(width=WIDTH, file=StringIO(), record=True, force_terminal=True)
    view, conduct = LiveView(console, robot), Conduct()
    trajectory = Trajectory.sampled(
        sampled_motion(time, reference, np.zeros_like(reference)), period, family="move"
    )
    quiet = Console(file=StringIO())
    view._console, shown = quiet, console
    view.begin(f"{robot.name}: slow run", trajectory, conduct)
    view._console = shown
    conduct.begin()
    view.samples(samples)
    console.print(view.picture())
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/images/live-view.svg")
    picture = console.export_svg(title=f"armhil commission {robot.name} --move", code_format=FORMAT)
    path.write_text(picture, encoding="utf-8")


def motion(home: FloatArray, time: FloatArray) -> FloatArray:
    """Rows × n: every joint swings slowly about its rest."""
    share = np.clip(time / 2.0, 0.0, 1.0)[:, None] ** 3
    return np.asarray(home + 0.6 * share * np.sin(0.5 * time[:, None] + np.arange(len(home))))


if __name__ == "__main__":
    main()
