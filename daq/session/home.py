"""``armhil home``: drives search their home, and somebody who looks says whether the arm stands there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from daq.catalogue.database import Catalogue
from daq.recording.fault_ring import FaultRing
from daq.recording.listener import listening
from daq.recording.run_facts import run_facts
from daq.session.attestation import keep_attestation
from daq.session.bench import ArmOrder, OpenArm, Purpose, opened
from daq.session.joints import joint_index, shown
from daq.session.motion_words import time_words
from daq.session.recorded_runs import Conducting
from daq.session.session_error import NotMoved, RunFailed, RunInterrupted, SessionError
from daq.text.progress import Steps
from drivers import Homing, StreamResult
from robots import Robot
from robots.arrays import FloatArray
from trajectories import Trajectory
from trajectories.motions.segments import hold


@dataclass(frozen=True)
class HomeRequest:
    """What to home.

    Attributes:
        arm: which arm, where; ``stands_at`` is compared after the searches.
        folder: for what a fault leaves behind; exists and is writable.
        joints: numbers or names of those whose drives search, in this order; all that need it where None.
        note: the operator's.
        catalogue: where the attestation is kept; nowhere where None.
        confirm: asked before each search; False ends it there.
        look: asked with the drives' positions whether the arm stands so; must be a person.
        show: gets the drives' positions (n,), rad or m, before that.
    """

    arm: ArmOrder
    folder: Path
    joints: tuple[str, ...] | None = None
    note: str = ""
    catalogue: Catalogue | None = None
    confirm: Callable[[str], bool] = lambda question: True
    look: Callable[[str], bool] = lambda question: True
    show: Callable[[FloatArray], None] = lambda positions: None


@dataclass(frozen=True)
class HomeResult:
    """What came of it; ``run`` is the attestation's number in the catalogue."""

    searches: tuple[tuple[str, StreamResult], ...]
    posture: FloatArray
    run: int | None


def home(request: HomeRequest, steps: Steps, conducting: Conducting) -> HomeResult:
    """Have drives search their home one after the other, then have their positions attested.

    Raises:
        SessionError: there is no such joint.
        BusError, DriveError, ArmMismatch, LeaseHeld: the arm cannot be had, a drive has no search, or stands
            elsewhere than was said.
        RunInterrupted, RunFailed: a search did not end with a home.
        NotMoved: something was not confirmed.
    """
    order = request.arm
    homings = searches_of(order.robot, request.joints)
    purpose: Purpose = "home" if homings else "look"
    with opened(replace(order, stands_at=None), request.catalogue, steps, purpose) as arm:
        done = [(homing.joint, _search(request, arm, homing, steps, conducting)) for homing in homings]
        posture = arm.session.actual_position()
        request.show(posture)
        _attest(request, arm, posture)
        run = keep_attestation(request.catalogue, arm.identity, posture, order, request.note)
    return HomeResult(tuple(done), posture, run)


def searches_of(robot: Robot, joints: tuple[str, ...] | None) -> tuple[Homing, ...]:
    """The searches that the description has for some joints' drives, or for all that forget their position.

    Raises:
        SessionError, DriveError: there is no such joint, or it has no search.
    """
    if joints is not None:
        names = [robot.joint[joint_index(robot, text)].name for text in joints]
    else:
        names = [
            joint.name
            for joint, drive in zip(robot.joint, robot.drive, strict=True)
            if drive.position_reference == "homing" and drive.homing is not None
        ]
    return tuple(Homing.described(robot, name) for name in names)


def _search(
    request: HomeRequest, arm: OpenArm, homing: Homing, steps: Steps, conducting: Conducting
) -> StreamResult:
    robot = request.arm.robot
    if not request.confirm(_question(robot, homing)):
        raise NotMoved(f"the search of {homing.joint} was not confirmed; nothing is attested")
    run = {"channel": str(request.arm.channel), "kind": "homing", "note": request.note}
    still = Trajectory.sampled(
        hold(arm.session.actual_position(), homing.seconds), robot.bus.cycle_time, family="move"
    )
    facts = run_facts(robot, run, still, arm.session.drives)
    with (
        steps.step(f"Search home of {homing.joint}"),
        conducting() as conduct,
        listening(arm.session.channel, robot.bus.bitrate) as listener,
        FaultRing(request.folder, robot, facts, listener) as ring,
    ):
        conduct.begin()
        try:
            result = arm.session.home(homing, conduct.control)
        finally:
            conduct.end()
        ring.ended(result)
    if result.outcome == "stopped":
        raise RunInterrupted(f"stopped ({result.reason}): {result.ending}; nothing is attested")
    if result.outcome != "completed":
        raise RunFailed(
            f"the search of {homing.joint} ended: {result.reason}; {result.ending}; nothing is attested"
        )
    return result


def _question(robot: Robot, homing: Homing) -> str:
    axis = joint_index(robot, homing.joint)
    return (
        f"The drive of {homing.joint} is going to search its home by itself: method {homing.method}, at most"
        f" {shown(robot, axis, homing.travel)},\nat up to {100 * homing.share:g} % of its speed limit, for"
        f" at most {time_words(homing.seconds)}. The other joints hold.\nGo on?"
    )


def _attest(request: HomeRequest, arm: OpenArm, posture: FloatArray) -> None:
    """By --stands-at, or by a look at the arm.

    Raises:
        DriveError, SessionError: the arm stands elsewhere than --stands-at says.
        NotMoved: who looked says no.
    """
    stands_at = request.arm.stands_at
    if stands_at is not None:
        if len(stands_at) != request.arm.robot.n:
            raise SessionError(f"--stands-at has {len(stands_at)} positions; allowed: {request.arm.robot.n}")
        arm.session.attest_position(np.array(stands_at))
        return
    if not request.look("Look at the arm and its marks.\nDoes it stand so?"):
        raise NotMoved("not attested: the drives' positions are not those of the arm; nothing is kept")
    arm.session.attest_position(posture)
