"""The stage of commissioning in which an arm moves for the first time, half a degree at a time.

At rest, then joint by joint a touch, then joint by joint half a degree. Each is recorded and judged before
the next begins, and the first that is not as described ends the stage.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from daq.recording.capture import Facts
from daq.recording.reader import read_capture
from daq.session.bench import OpenArm
from daq.session.cell import Cell
from daq.session.first_judgement import Finding, judge_loop, judge_move, judge_rest, summary
from daq.session.first_motion import (
    FirstMotion,
    at_rest,
    direction_question,
    half_degree,
    in_order,
    refuse_in_the_way,
    touch,
)
from daq.session.motion_words import Leg
from daq.session.recorded_runs import Recording, require_completed
from daq.session.session_error import SessionError
from drivers.frames.samples import Samples
from drivers.setup.rated_torque import doubtful_gain
from robots import Robot
from robots.arrays import FloatArray

Judge = Callable[[Robot, Samples, FirstMotion], list[Finding]]

STEP = "first move: "
"""Before the name of each of its recordings, in the catalogue."""


def first_legs(robot: Robot, posture: FloatArray, cell: Cell) -> tuple[Leg, ...]:
    """What the stage is going to drive from a posture (n,), for whoever has to allow it.

    Raises:
        SessionError: there is no room for it.
    """
    still, whole = at_rest(robot, posture), half_degree(robot, posture, range(robot.n))
    refuse_in_the_way(robot, whole, cell)
    touches = touch(robot, posture, range(robot.n))
    return (
        Leg("at rest, torque on, brakes open", still.trajectory),
        Leg("then each joint alone a touch that is hardly seen", touches.trajectory),
        Leg("and half a degree to both sides; look which way it goes", whole.trajectory),
    )


def refuse_doubtful_gains(arm: OpenArm, looked: Callable[[str], bool]) -> None:
    """Is a torque what the drives say it is? Where friction hides gravity, no small motion tells.

    Args:
        arm: whose drives have told their rated torques.
        looked: asked where a drive contradicts the description; True where the description is right.

    Raises:
        SessionError: it is not.
    """
    robot = arm.session.robot
    for k, report in enumerate(arm.session.drives):
        doubt = doubtful_gain(robot, k, report.settings)
        if doubt is None:
            continue
        where = f"drive[{k + 1}] ({report.joint}): {doubt}"
        if not looked(f"{where}\nHas the described gain been measured on this arm?"):
            raise SessionError(f"stage first move: {where}; correct the one that is wrong")


def first_move(
    arm: OpenArm,
    recording: Recording,
    path: Callable[[str], Path],
    facts: Facts,
    looked: Callable[[str], bool],
) -> str:
    """Drive and judge the first motions; what can be said of them afterwards.

    Args:
        arm: whose posture is attested.
        recording: streams and keeps.
        path: a new capture's file for a name.
        facts: what the runs count for.
        looked: asked after each half degree whether the joint went the way that it should.

    Raises:
        SessionError: a joint does not answer as described; says which, how, and where to look.
        RunInterrupted, RunFailed: a motion did not come to its end.
    """
    robot = arm.session.robot
    unjudged: list[str] = []

    def drive(name: str, motion: FirstMotion, judge: Judge) -> None:
        file, title = path(name), f"{STEP}{name}"
        _, result = recording.record(
            "commission", title, motion.trajectory, file, stage=title[:40], facts=facts
        )
        require_completed(result, file)
        findings = judge(robot, read_capture(file).samples, motion)
        if findings:
            raise SessionError(
                f"stage first move: {summary(findings)}; nothing moves until the description (robot.toml,"
                f" URDF) and the arm agree; recorded in {file}"
            )

    def judge_rest_too(robot: Robot, samples: Samples, _: FirstMotion) -> list[Finding]:
        findings, hidden = judge_rest(robot, samples)
        unjudged.extend(hidden)
        return findings

    drive("at rest", at_rest(robot, _posture(arm)), judge_rest_too)
    for k in in_order(robot):
        drive(f"{robot.joint[k].name} touch", touch(robot, _posture(arm), [k]), judge_loop)
    for k in in_order(robot):
        joint = robot.joint[k]
        motion = half_degree(robot, _posture(arm), [k])
        drive(f"{joint.name} 0.5 deg", motion, judge_move)
        if not looked(direction_question(robot, motion)):
            raise SessionError(
                f"stage first move: {joint.name} did not go the way that it should: sign of its drive, or the"
                " axis of the joint in the URDF; nothing moves until they are as the arm is"
            )
    words = "every joint answers as described"
    if unjudged:
        words += (
            f"; at rest the gravity of {', '.join(unjudged)} is too small to tell from friction: judged in"
            " motion only, where a zero that is off may stay unseen"
        )
    return words


def _posture(arm: OpenArm) -> FloatArray:
    return np.asarray(arm.session.actual_position())
