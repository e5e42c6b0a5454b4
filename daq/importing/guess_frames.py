"""Where the axes' zeros are, and whether the last motor turns with the joint before: by one fit of all.

Bodies that are turned with their frames make the same torque, so a log shows the zero of an axis only by what
the axes behind it then do. What it does not show is left as it is.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from daq.importing.channels import Channels
from daq.importing.guess_torque import LogHints, given_factor
from daq.importing.guess_which import Sampled
from daq.importing.proof import TorqueProof
from robots import Robot
from robots.arrays import FloatArray

_BETTER = 0.985
"""Share of the error that another zero must leave at most: less may be chance."""
_BEYOND = 0.05
"""Share of its range by which a joint may be beyond its limits by calibration."""
COUPLED = 0.95
"""The same for a coupled wrist."""
_ALONE = 0.5
"""Share of the best turn's gain from which on another turn gains as much: 0.3 to 0.4 where a zero is off."""
_ROUNDS = 3


def beyond(robot: Robot, joint: int, low: float, high: float) -> float:
    """By how much of its range a joint is beyond its limits."""
    lower, upper = robot.joint[joint].position
    return max(lower - low, high - upper, 0.0) / (upper - lower)


def quarter_turns(robot: Robot, proof: TorqueProof) -> tuple[FloatArray, list[str]]:
    """(n,) offsets that bring joints within their limits, or make the torque fit; and why, in words.

    Args:
        robot: the arm.
        proof: torques at the joints, or near them.
    """
    low, high = proof.position.min(axis=0), proof.position.max(axis=0)
    offset, words = np.zeros(robot.n), list[str]()
    allowed: list[list[float]] = []
    for j, joint in enumerate(robot.joint):
        turns = [
            quarter * np.pi / 2
            for quarter in ((0,) if joint.kind == "prismatic" else (0, -1, 1, -2, 2, -3, 3))
        ]
        off = [beyond(robot, j, low[j] + turn, high[j] + turn) for turn in turns]
        fits = [turn for turn, out in zip(turns, off, strict=True) if out <= _BEYOND]
        allowed.append(fits or [0.0])
        offset[j] = allowed[j][0]
    best = proof.error(offset)
    for _ in range(_ROUNDS):
        moves = _moves(proof, offset, allowed)
        if not moves or moves[0][0] >= _BETTER * best:
            break
        error, j, turn = moves[0]
        rival = _rival(proof, offset, moves, best)
        if rival is not None:
            _, other, also = rival
            first = f"{robot.joint[j].name}: its zero may be off by {np.rad2deg(turn - offset[j]):g}°"
            or_by = f"{np.rad2deg(also - offset[other]):g}°"
            second = f"by {or_by}" if other == j else f"that of {robot.joint[other].name} by {or_by}"
            words.append(f"{first}, or {second}: the torque tells neither; not moved, --offset moves it")
            break
        offset[j], best = turn, error
    for j, joint in enumerate(robot.joint):
        if offset[j]:
            why = "its limits" if offset[j] == allowed[j][0] else "its torque"
            words.append(f"{joint.name}: zero moved by {np.rad2deg(offset[j]):g}°, by {why}; look it over")
    return offset, words


def _moves(
    proof: TorqueProof, offset: FloatArray, allowed: list[list[float]]
) -> list[tuple[float, int, float]]:
    """Error, joint and its zero of each turn of one joint, best first.

    The first axis turns the arm about the vertical, the last only itself: their zeros are not seen.
    """
    seen = range(1, len(offset) - 1)
    turns = [(j, turn) for j in seen for turn in allowed[j] if turn != offset[j]]
    return sorted((proof.error(_turned(offset, j, turn)), j, turn) for j, turn in turns)


def _turned(offset: FloatArray, joint: int, turn: float) -> FloatArray:
    tried = offset.copy()
    tried[joint] = turn
    return tried


def _rival(
    proof: TorqueProof, offset: FloatArray, moves: list[tuple[float, int, float]], now: float
) -> tuple[float, int, float] | None:
    """Another turn in the place of the best one that gains nearly as much; None where there is none.

    Where a zero is off, its turn alone mends it. Where a model lacks something else, any turn helps that
    gives it other columns. A turn that still gains after the best one is no rival: both zeros are off.
    """
    least, joint, turn = moves[0]
    mended = _turned(offset, joint, turn)
    for error, j, other in moves[1:]:
        if now - error < _ALONE * (now - least):
            return None
        if j == joint or proof.error(_turned(mended, j, other)) >= _BETTER * least:
            return error, j, other
    return None


def coupled_wrist(robot: Robot, position: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Transmissions of a last motor that turns with the joint before, with the joint positions that follow.

    Args:
        robot: the arm.
        position: samples × n at the drive outputs.
    """
    if robot.n != 6 or any(joint.kind == "prismatic" for joint in robot.joint):
        return []
    found = []
    for sign in (1.0, -1.0):
        transmission = np.eye(6)
        transmission[5, 4] = sign
        found.append((transmission, np.asarray(np.linalg.solve(transmission, position.T).T)))
    return found


def axes_and_offsets(
    robot: Robot, log: Sampled, torque: Channels, table: dict[str, Any], hints: LogHints
) -> tuple[Robot, Sampled, FloatArray, list[str]]:
    """Zeros and coupling of the axes: the arm, its motion and offsets (n,) with them, and words."""
    given, _ = given_factor(hints, log)
    logged = log.even(torque.values[:, log.moving]) * given
    found, better = (robot, log), list[str]()
    proof = TorqueProof.of(robot, log.position, logged, log.period, log.cutoff)
    offset, words = quarter_turns(robot, proof)
    error = proof.error(offset)
    for transmission, position in coupled_wrist(robot, log.position) if "ratio" in table else []:
        rows = tuple(tuple(row) for row in transmission.tolist())
        tried = robot.model_copy(update={"transmission": rows})
        at_joints = np.asarray(logged @ transmission)
        other = TorqueProof.of(tried, position, at_joints, log.period, log.cutoff)
        turned, said = quarter_turns(tried, other)
        if other.error(turned) < COUPLED * error:
            found, error = (tried, replace(log, position=position)), other.error(turned)
            offset, words = turned, said
            better = [f"wrist: motor 6 turns with joints 5 and 6 ({transmission[5, 4]:+g}), by its torque"]
    if hints.offset:
        return *found, np.array(hints.offset)[log.moving], better
    return *found, offset, [*words, *better]
