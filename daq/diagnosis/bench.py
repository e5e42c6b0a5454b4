"""The arm on its bench, real or simulated: stream a motion and record it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from daq.demo import RunFailed, RunInterrupted
from daq.identification.run_facts import outcome_facts, run_facts
from daq.progress import Steps
from daq.recording.listener import listening
from daq.recording.recorder import Recorder
from drivers import ArmSession, Channel, Samples
from robots import Robot
from robots.arrays import FloatArray
from trajectories import Conditions, Trajectory, approach

_AT_START = 1e-3
"""rad or m; nearer than this the arm stands where a motion begins."""


def stream_and_record(
    robot: Robot, channel: Channel, trajectory: Trajectory, conditions: Conditions, path: Path, steps: Steps
) -> Path:
    """Move to where the motion begins, slowly and unrecorded, then stream the motion and record it.

    Args:
        robot: the arm.
        channel: where its drives are.
        trajectory: begins and ends at rest.
        conditions: what the way to its start has to keep.
        path: of the capture.
        steps: told what happens.

    Raises:
        BusError, DriveError: the bus is occupied, or a drive refuses.
        TrajectoryError: no way leads to the start of the motion.
        CaptureError: the recording cannot be written.
        RunInterrupted: stopped on request.
        RunFailed: the arm ended the run itself.
    """
    with ArmSession(robot, channel) as session:
        actual = session.actual_position()
        if np.abs(actual - trajectory.position[0]).max() > _AT_START:
            with steps.step("Move to where the motion begins"):
                _drive(session, _way(robot, actual, trajectory, conditions))
        facts = run_facts(robot, {"channel": str(channel), "kind": "diagnosis"}, trajectory, session.drives)
        with (
            steps.step(f"Stream and record {path.name}") as update,
            listening(channel, robot.bus.bitrate) as listener,
            Recorder(path, robot, facts, listener=listener) as recorder,
        ):
            total = len(trajectory.time)

            def keep(samples: Samples) -> None:
                recorder.write(samples)
                if len(samples.cycle):
                    update(int(samples.cycle[-1]) / total, f"cycle {int(samples.cycle[-1])}")

            result = session.stream(trajectory.position, keep)
            recorder.finish(outcome_facts(result))
        _refuse_early_end(result.outcome, result.reason)
    return path


def _way(robot: Robot, actual: FloatArray, trajectory: Trajectory, conditions: Conditions) -> Trajectory:
    return approach(
        robot,
        actual,
        trajectory.position[0],
        robot.bus.cycle_time,
        surroundings=conditions.surroundings,
        tool=conditions.tool,
        tool_speed=conditions.tool_speed,
    )


def _drive(session: ArmSession, way: Trajectory) -> None:
    result = session.stream(way.position, lambda samples: None)
    _refuse_early_end(result.outcome, result.reason)


def _refuse_early_end(outcome: str, reason: str) -> None:
    if outcome == "stopped":
        raise RunInterrupted(f"stopped ({reason}): axes at rest and disabled")
    if outcome != "completed":
        raise RunFailed(f"the run ended early: {reason}")
