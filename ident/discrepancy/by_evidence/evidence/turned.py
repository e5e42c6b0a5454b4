"""Rows at which dry friction has turned its sign: below that speed a drive is at standstill, or creeps.

How fast a drive has to be for that is told by the law that the simulated loop shows (:mod:`presliding`): some
millimetres or milliradians a second in most gears, a tenth of a radian a second on the wrist of an arm whose
engine holds it by a soft constraint. A sign of the speed says nothing of such rows, and what it leaves there
is no effect.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import binary_dilation

from ident.discrepancy.by_evidence.evidence.prepared import TURNED, Part, Prepared
from ident.discrepancy.loop import Standstill
from ident.effects import FrictionSign, State
from ident.effects.simulated import SoftConstraint
from robots.arrays import BoolArray
from robots.description import Robot


def where_turned(prepared: Prepared, standstill: Standstill | None) -> Prepared:
    """The recordings without rows at which the friction of a drive that moves with the joint turns its sign.

    Args:
        prepared: see above; a margin beside standstills is that of its settings.
        standstill: of each drive; None where nobody knows.
    """
    if standstill is None:
        return prepared
    return replace(prepared, parts=tuple(_part(prepared.robot, one, standstill) for one in prepared.parts))


def _part(robot: Robot, part: Part, standstill: Standstill) -> Part:
    turns = ~turned(robot, part.own, standstill) @ (robot.transmission_matrix != 0.0)
    assert part.own.time is not None
    reach = round(robot.identification.standstill_margin / float(part.own.time[1] - part.own.time[0]))
    near = binary_dilation(turns, np.ones((2 * reach + 1, 1), dtype=np.bool_))
    return replace(part, used=part.used & ~near)


def turned(robot: Robot, state: State, standstill: Standstill) -> BoolArray:
    """Samples × drives: whether a drive is so fast that its dry friction is all there."""
    matrix = robot.transmission_matrix
    speed, rate = state.velocity @ matrix.T, state.acceleration @ matrix.T
    whole = np.ones(speed.shape, dtype=np.bool_)
    for drive, law in enumerate(standstill):
        if isinstance(law, SoftConstraint):
            whole[:, drive] = np.abs(speed[:, drive] + law.time * rate[:, drive]) >= TURNED * law.width
        elif isinstance(law, FrictionSign):
            whole[:, drive] = np.abs(law(speed[:, drive])) >= TURNED
    return whole
