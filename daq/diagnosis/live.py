"""``armhil diagnose --live``: with the arm in the loop, until the name is settled or somebody says no.

Nothing moves without leave: every motion is asked for, and a question that nobody answers is a no.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from daq.diagnosis.diagnose import conditions_of, run_diagnose
from daq.diagnosis.diagnose_result import DiagnoseRequest, DiagnoseResult
from daq.files.run_folder import make_run_folder
from daq.session.session_error import NotMoved
from daq.text.progress import Steps
from robots import Robot
from robots.errors import UserError
from trajectories import Trajectory, plan

StreamAndRecord = Callable[[Trajectory, Path, str], Path]
"""Asks for a motion, with what it is for, drives it and records it to a path; NotMoved where it may not."""


_PARTS = ("", "-validate")
"""What is added to the names of the captures of a motion's parts."""


class MotionRefused(UserError):
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


def run_live(request: LiveRequest, stream: StreamAndRecord, steps: Steps) -> LiveResult:
    """Diagnose; where that is ambiguous, make the motion that tells candidates apart, and diagnose again.

    Args:
        request: what to do.
        stream: asks, drives the arm and records.
        steps: told what happens.

    Raises:
        MotionRefused: there are no captures to begin with, and recording some was not allowed.
        PlanError, IdentificationError, CaptureError, DriveError, BusError: one line each.
    """
    recorded: list[Path] = []
    diagnose = request.diagnose
    if not diagnose.fit:
        recorded += _first_captures(request, stream, steps)
        diagnose = replace(diagnose, fit=(recorded[0],), validation=(recorded[1],))
    results = [run_diagnose(replace(diagnose, out=request.folder / "diagnosis"), steps)]
    for number in range(1, request.rounds + 1):
        motion = next((item for item in results[-1].apart if item.parts), None)
        if motion is None:
            break
        question = f"to tell {' from '.join(motion.candidates[:3])}"
        asked = (question, f"on another way, which judges what the first one says: {question}")
        try:
            for name, trajectory, purpose in zip(_PARTS, motion.trajectories, asked, strict=True):
                path = request.folder / f"tell-apart-{number}{name}.mcap"
                recorded.append(stream(trajectory, path, purpose))
        except NotMoved:
            return LiveResult(tuple(results), diagnose, tuple(recorded), question)
        diagnose = _with_parts(diagnose, *recorded[-len(_PARTS) :])
        results.append(run_diagnose(replace(diagnose, out=request.folder / f"diagnosis-{number + 1}"), steps))
    return LiveResult(tuple(results), diagnose, tuple(recorded), "")


def _with_parts(diagnose: DiagnoseRequest, fit: Path, validation: Path) -> DiagnoseRequest:
    """With the parts of a motion that tells candidates apart: the second judges, all else is fitted.

    What was recorded to validate has left the names open as well. It is too poor to judge what the motion
    shows, and with it there is more to fit. Where recordings are halved, the parts are, too.
    """
    if diagnose.split_half:
        return replace(diagnose, fit=(*diagnose.fit, fit, validation))
    return replace(diagnose, fit=(*diagnose.fit, *diagnose.validation, fit), validation=(validation,))


def _first_captures(request: LiveRequest, stream: StreamAndRecord, steps: Steps) -> Sequence[Path]:
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
        try:
            recorded.append(stream(trajectory, request.folder / f"{name}.mcap", f"to record {name}.mcap"))
        except NotMoved as refused:
            raise MotionRefused(
                f"nothing to diagnose: {refused}; allowed: --yes, the answer yes, or captures to begin with"
            ) from refused
    return recorded


def live_folder(out: Path | None, robot: Robot) -> Path:
    """Where captures and results go.

    Raises:
        OutputError: the folder cannot be made.
    """
    return make_run_folder(out, f"diagnose-{robot.name}")
