"""The first motions of an arm that nobody has seen move: at rest, a touch, half a degree, joint by joint.

Each is judged before the next (``first_judgement``). At rest the joints hold still. A touch asks a joint for
a way so small that even a description that is wrong by a factor of fifty moves it by less than a degree. Only
then the joint moves by half a degree to both sides, slowly: what torque both directions have in common
is gravity, what differs is friction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio

from daq.session.cell import Cell
from daq.session.session_error import SessionError
from robots import Robot, rigid_body_model
from robots.arrays import FloatArray
from trajectories import Trajectory
from trajectories.motions.sampled import sampled_motion

HALF_DEGREE = {"revolute": float(np.radians(0.5)), "prismatic": 0.5e-3}
"""rad, m; farthest that a joint goes to either side, also where one drive's sign is wrong."""
TOUCH = {"revolute": float(np.radians(0.015)), "prismatic": 15e-6}
"""rad, m."""
REST_SECONDS = 1.0
TOUCH_SECONDS = 0.3
"""One way, and each pause."""
MOVE_SECONDS = 1.0
"""One way of half a degree."""
PAUSE_SECONDS = 0.4


@dataclass(frozen=True)
class Turn:
    """The rows in which one joint has its turn, and how far it goes above and below where it stood."""

    joint: int
    rows: slice
    above: float
    below: float


@dataclass(frozen=True)
class FirstMotion:
    """One of the three motions, with the turns of the joints; none at rest."""

    trajectory: Trajectory
    turns: tuple[Turn, ...]


def at_rest(robot: Robot, posture: FloatArray) -> FirstMotion:
    """Every joint holds still for a second at a posture (n,), rad or m."""
    rows = round(REST_SECONDS / robot.bus.cycle_time)
    return FirstMotion(_trajectory(robot, np.tile(posture, (rows, 1))), ())


def touch(robot: Robot, posture: FloatArray, joints: Sequence[int]) -> FirstMotion:
    """Each of the joints (from 0) in turn a touch there and back."""
    return _in_turns(robot, posture, joints, TOUCH, TOUCH_SECONDS, TOUCH_SECONDS)


def in_order(robot: Robot) -> list[int]:
    """The joints (from 0) as they have their turns: those that fewer drives move come first.

    A coupled joint takes others with it where one of its drives has the wrong sign. By then each of those
    drives that moves a joint alone has been found right.
    """
    coupled = np.abs(robot.transmission_matrix) > 1e-9
    return sorted(range(robot.n), key=lambda k: int(coupled[:, k].sum()))


def half_degree(robot: Robot, posture: FloatArray, joints: Sequence[int]) -> FirstMotion:
    """Each of the joints (from 0) in turn half a degree to either side and back."""
    return _in_turns(robot, posture, joints, HALF_DEGREE, MOVE_SECONDS, PAUSE_SECONDS)


def direction_question(robot: Robot, motion: FirstMotion) -> str:
    """Which way the one joint of a motion should have gone, for whoever has looked.

    No torque tells a drive that counts position and torque both the wrong way round from its mirror image.
    """
    (turn,) = motion.turns
    joint = robot.joint[turn.joint]
    axis = _axis(robot, np.asarray(motion.trajectory.position[0]), turn.joint)
    up = turn.above > 0.0
    if joint.kind == "revolute":
        size = f"{np.degrees(turn.above if up else turn.below):.2g}°"
        way = f"{'counter-clockwise' if up else 'clockwise'}, seen from {_side(axis)}"
    else:
        size, way = (
            f"{1e3 * (turn.above if up else turn.below):.2g} mm",
            f"towards {_side(axis if up else -axis)}",
        )
    return f"Did {joint.name} go first by {size} {way}?"


def _axis(robot: Robot, posture: FloatArray, k: int) -> FloatArray:
    """(3,) the direction about or along which a joint's position grows, in the frame of the URDF's base."""
    model = rigid_body_model(robot)
    data = model.createData()
    pinocchio.computeJointJacobians(model, data, posture)
    jacobian = pinocchio.getJointJacobian(model, data, k + 1, pinocchio.LOCAL_WORLD_ALIGNED)
    column = np.asarray(jacobian).reshape(6, robot.n)[:, k]
    return np.asarray(column[3:] if robot.joint[k].kind == "revolute" else column[:3])


def _side(axis: FloatArray) -> str:
    """A side of the base, where a direction is nearly one."""
    k = int(np.abs(axis).argmax())
    if abs(axis[k]) > np.cos(np.radians(20.0)):
        return f"the {'+' if axis[k] > 0 else '-'}{'xyz'[k]} side of the URDF's base"
    return f"where ({', '.join(f'{part:.1f}' for part in axis)}) of the URDF's base points"


def refuse_in_the_way(robot: Robot, motion: FirstMotion, cell: Cell) -> None:
    """Is there room for it?

    Raises:
        SessionError: names what it breaks first.
    """
    start = np.asarray(motion.trajectory.position[0])
    problems = cell.conditions.judge(robot, start=start).judge(motion.trajectory.motion).problems
    if problems:
        raise SessionError(
            f"stage first move: there is no room for half a degree of it: {problems[0]};"
            " move the arm by hand, or with its maker's pendant, to where there is"
        )


def _in_turns(
    robot: Robot,
    posture: FloatArray,
    joints: Sequence[int],
    size: dict[str, float],
    seconds: float,
    pause: float,
) -> FirstMotion:
    cycle = robot.bus.cycle_time
    hold = np.tile(posture, (max(2, round(pause / cycle)), 1))
    pieces, turns, row = [hold], [], len(hold)
    for k in joints:
        way_out = size[robot.joint[k].kind] / _amplified(robot, k)
        above = min(way_out, max(0.0, robot.upper[k] - posture[k]))
        below = min(way_out, max(0.0, posture[k] - robot.lower[k]))
        ways = [way for way in (above, -below) if abs(way) > 0.5 * way_out] or [above or -below]
        before = len(pieces)
        for way in ways:
            end = posture.copy()
            end[k] += way
            there = _ramp(posture, end, seconds, cycle)
            pieces += [there, np.tile(end, (len(hold), 1)), there[::-1], hold]
        length = sum(len(piece) for piece in pieces[before:])
        turns.append(Turn(k, slice(row, row + length), max(0.0, *ways), max(0.0, *(-way for way in ways))))
        row += length
    return FirstMotion(_trajectory(robot, np.vstack(pieces)), tuple(turns))


def _amplified(robot: Robot, k: int) -> float:
    """How far any joint goes for each rad (or m) of joint k, at most, where one drive's sign is wrong."""
    coupling = robot.transmission_matrix
    drives = np.tile(coupling[:, k], (robot.n, 1))
    drives[np.diag_indices(robot.n)] *= -1.0
    return float(max(1.0, np.abs(np.linalg.solve(coupling, drives.T)).max()))


def _ramp(start: FloatArray, end: FloatArray, seconds: float, cycle: float) -> FloatArray:
    """A quintic from rest to rest, rows × n."""
    s = np.linspace(0.0, 1.0, max(8, round(seconds / cycle)))[:, np.newaxis]
    return np.asarray(start + (10 * s**3 - 15 * s**4 + 6 * s**5) * (end - start))


def _trajectory(robot: Robot, position: FloatArray) -> Trajectory:
    time = robot.bus.cycle_time * np.arange(len(position), dtype=np.float64)
    motion = sampled_motion(time, position, np.zeros_like(position))
    return Trajectory.sampled(motion, robot.bus.cycle_time, family="move")
