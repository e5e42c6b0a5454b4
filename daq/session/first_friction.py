"""What a drive takes against friction in its first half degree, beside what is described.

A gear gives way before it slips: it winds up over an arc first (pre-sliding, Dahl 1968). Until then its
torque is on the way from one direction's friction to the other's, and a mean over it says less than friction.
So the second half of what a drive really moves in one direction is looked at. Where it never comes that far
it bears at least what is measured, and that is all that can be said of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from daq.session.first_motion import Turn
from drivers.frames.samples import Samples
from robots import Robot
from robots.arrays import BoolArray, FloatArray, IntArray

FRICTION_RATIO = (0.35, 2.8)
"""Of the measured friction to the described one."""
MOVING = 0.5
"""What goes at this share of its reference's highest speed counts as moving."""
BEYOND = 0.5
"""Share of a way behind a reversal in which friction may still wind up."""
SPEED_SECONDS = 0.1
"""Over which a drive's speed is taken: a tenth of its way, so that a coarse encoder has a count in it."""
LEAST_SLIPPING = 0.1
"""Share of the rows in which a drive was to move, in which it has to slip."""


@dataclass(frozen=True)
class Ways:
    """One drive in the turn of a joint that it moves.

    Attributes:
        up, down: (rows of the turn,) in which it slips with the joint, up and down; where it never does, in
            which it was to move.
        slipped: whether it did.
        measured, described: friction at its output, N·m or N.
    """

    up: BoolArray
    down: BoolArray
    slipped: bool
    measured: float
    described: float

    def words(self, drive: int, unit: str) -> str | None:
        """What is not as described, or None; the drive (from 0) takes a torque or a force in ``unit``."""
        least = FRICTION_RATIO[0] if self.slipped else 0.0
        ratio = self.measured / self.described if self.described > 0.0 else 1.0
        if least <= ratio <= FRICTION_RATIO[1]:
            return None
        likely = "the sign is likely wrong" if ratio < 0 else "gain, per_count, node_id or dynamics.coulomb"
        return (
            f"drive[{drive + 1}] takes {self.measured:.3g} {unit} against friction, described"
            f" {self.described:.3g}: {likely}"
        )


def turned_by(robot: Robot, joint: int) -> IntArray:
    """Drives (from 0) that a joint (from 0) turns with it."""
    return np.flatnonzero(np.abs(robot.transmission_matrix[:, joint]) > 1e-9)


def told_rows(robot: Robot, samples: Samples, turn: Turn) -> tuple[BoolArray, BoolArray]:
    """Rows of a turn in which its joint was to move up, and down."""
    speed = np.gradient(samples.reference[turn.rows, turn.joint], robot.bus.cycle_time)
    up, down = (side * speed > MOVING * np.abs(speed).max() for side in (1.0, -1.0))
    return up, down


def ways_of(robot: Robot, samples: Samples, turn: Turn, drive: int) -> Ways:
    """What one drive (from 0) did and took in a joint's turn."""
    told = told_rows(robot, samples, turn)
    rows = _slipping(robot, samples, turn, drive)
    slipped = all(one.sum() >= LEAST_SLIPPING * two.sum() for one, two in zip(rows, told, strict=True))
    up, down = rows if slipped else told
    coupling = robot.transmission_matrix[drive, turn.joint]
    signal = samples.control_signal[turn.rows, drive] * np.sign(coupling)
    measured = robot.gains[drive] * float(np.mean(signal[up]) - np.mean(signal[down])) / 2
    speed = np.gradient(samples.reference[turn.rows, turn.joint], robot.bus.cycle_time)[told[0]].mean()
    dynamics = robot.drive[drive].dynamics
    return Ways(up, down, slipped, measured, dynamics.coulomb + dynamics.viscous * abs(coupling * speed))


def _slipping(robot: Robot, samples: Samples, turn: Turn, drive: int) -> tuple[BoolArray, BoolArray]:
    cycle, coupling = robot.bus.cycle_time, robot.transmission_matrix[drive]
    row = coupling * np.sign(coupling[turn.joint])
    fastest = np.abs(np.gradient(samples.reference[turn.rows] @ row, cycle)).max()
    position = samples.position[turn.rows] @ row
    way = max(turn.above, turn.below) * abs(coupling[turn.joint])
    up, down = (
        (side * _speed(position, cycle) > MOVING * fastest)
        & (side * position - np.minimum.accumulate(side * position) > BEYOND * way)
        for side in (1.0, -1.0)
    )
    return up, down


def _speed(position: FloatArray, cycle: float) -> FloatArray:
    width = 2 * max(1, round(SPEED_SECONDS / cycle / 2))
    padded = np.pad(position, width // 2, mode="edge")
    return np.asarray((padded[width:] - padded[:-width]) / (width * cycle))
