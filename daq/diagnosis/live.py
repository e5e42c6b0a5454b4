"""``armhil diagnose --live``: with the arm in the loop, until the name is settled or somebody says no.

Nothing moves without leave: every motion is asked for, and a question that nobody answers is a no.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from daq.diagnosis.diagnose import DiagnoseRequest, DiagnoseResult, conditions_of, run_diagnose
from daq.files.run_folder import make_run_folder
from daq.progress import Steps
from robots import Robot
from trajectories import Trajectory, plan

Ask = Callable[[str], bool]
"""Asked before each motion, with what will move in words; only True moves the arm."""

StreamAndRecord = Callable[[Trajectory, Path], Path]
"""Drives a motion and records it to a path."""


class MotionRefused(Exception):
    """There is nothing to diagnose and nobody allowed a motion; one line."""


@dataclass(frozen=True)
class LiveRequest:
    """What to do with the arm.

    Attributes:
        diagnose: where to begin; without captures two are recorded first, one to fit, one to validate.
        robot: the arm on the bench.
        folder: for captures and results.
        rounds: motions at most that are made to tell candidates apart.
        duration: of one period of the motions that are recorded first, s.
        periods: how often each is repeated.
        evaluations: trials of the search for each of them.
        seed: of those.
    """

    diagnose: DiagnoseRequest
    robot: Robot
    folder: Path
    rounds: int = 2
    duration: float = 12.0
    periods: int = 2
    evaluations: int = 3000
    seed: int = 0


@dataclass(frozen=True)
class LiveResult:
    """What came out.

    Attributes:
        results: the diagnosis before any further motion, and after each.
        request: of the last of them.
        recorded: captures that were made.
        refused: what was asked for and not allowed; empty where nothing was refused.
    """

    results: tuple[DiagnoseResult, ...]
    request: DiagnoseRequest
    recorded: tuple[Path, ...]
    refused: str

    @property
    def last(self) -> DiagnoseResult:
        return self.results[-1]


def run_live(request: LiveRequest, stream: StreamAndRecord, ask: Ask, steps: Steps) -> LiveResult:
    """Diagnose; where that is ambiguous, make the motion that tells candidates apart, and diagnose again.

    Args:
        request: what to do.
        stream: drives the arm and records.
        ask: asked before each motion.
        steps: told what happens.

    Raises:
        MotionRefused: there are no captures to begin with, and recording some was not allowed.
        PlanError, IdentificationError, CaptureError, DriveError, BusError: one line each.
    """
    recorded: list[Path] = []
    diagnose = request.diagnose
    if not diagnose.fit:
        recorded += _first_captures(request, stream, ask, steps)
        diagnose = replace(diagnose, fit=(recorded[0],), validation=(recorded[1],))
    results = [run_diagnose(replace(diagnose, out=request.folder / "diagnosis"), steps)]
    for number in range(1, request.rounds + 1):
        motion = next((item for item in results[-1].apart if item.trajectory is not None), None)
        if motion is None or motion.trajectory is None:
            break
        question = f"to tell {' from '.join(motion.candidates[:3])}"
        if not ask(motion_words(request.robot, motion.trajectory, question)):
            return LiveResult(tuple(results), diagnose, tuple(recorded), question)
        recorded.append(stream(motion.trajectory, request.folder / f"tell-apart-{number}.mcap"))
        diagnose = replace(diagnose, fit=(*diagnose.fit, recorded[-1]))
        results.append(run_diagnose(replace(diagnose, out=request.folder / f"diagnosis-{number + 1}"), steps))
    return LiveResult(tuple(results), diagnose, tuple(recorded), "")


def motion_words(robot: Robot, trajectory: Trajectory, purpose: str) -> str:
    """What will move: how long, how fast, what for."""
    share = float((np.abs(trajectory.velocity).max(axis=0) / robot.velocity_limits).max())
    return (
        f"{robot.name} will move for {trajectory.duration:.0f} s {purpose},"
        f" at up to {100 * share:.0f} % of its speed limits"
    )


def _first_captures(request: LiveRequest, stream: StreamAndRecord, ask: Ask, steps: Steps) -> Sequence[Path]:
    conditions = conditions_of(request.diagnose.cell)
    recorded = []
    for name, seed in (("fit", request.seed), ("validation", request.seed + 1)):
        with steps.step(f"Plan the motion for {name}.mcap") as update:
            trajectory = plan(
                request.robot,
                cycle_time=request.robot.bus.cycle_time,
                duration=request.duration,
                seed=seed,
                conditions=conditions,
                evaluations=request.evaluations,
                periods=request.periods,
                progress=lambda share, score: update(share, ""),
            )
        question = motion_words(request.robot, trajectory, f"to record {name}.mcap")
        if not ask(question):
            raise MotionRefused(
                f"nothing was recorded: {question}; allowed: --yes, the answer yes, or captures to begin with"
            )
        recorded.append(stream(trajectory, request.folder / f"{name}.mcap"))
    return recorded


def live_folder(out: Path | None, robot: Robot) -> Path:
    """Where captures and results go.

    Raises:
        OutputError: the folder cannot be made.
    """
    return make_run_folder(out, f"diagnose-{robot.name}")
