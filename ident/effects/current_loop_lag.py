"""Current-loop lag: the torque follows the control signal late, as a first-order lag."""

from __future__ import annotations

from ident.effects.family import Place, PresentModel
from ident.effects.placed import (
    POSITIVE,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    drive_torque,
    each_drive,
    rate,
)
from ident.effects.simulated import DriveChange, SimulatedParts
from ident.effects.state import State
from robots.arrays import FloatArray
from robots.description import Robot


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """T dτ/dt + τ = g_τ v_τ: the control signal leads the torque by T of its rate."""
    drive, row = place.joints[0], drive_row(robot, place)

    def law(state: State) -> FloatArray:
        return along(row, rate(drive_torque(robot, present.torque(present.low_cutoff(state)), drive), state))

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(drives=(DriveChange(drive, lag=max(0.0, float(values[0]))),))

    return Parameters(("lag",), ("s",), (POSITIVE,), (0.003,)), law, parts


CURRENT_LOOP_LAG = Family(
    "current_loop_lag",
    "torque that follows the control signal late",
    "drive",
    each_drive,
    _make,
    confused_with=("time_delay",),
    taken_by_alignment=True,
    settled_by="lock the joint and step the control signal: a lag rounds the current",
    told_from={
        "time_delay": (
            "lock the joint and step the control signal: a delay shifts the current, a lag rounds it"
        ),
    },
    not_by_motion=("time_delay",),
    equation="the control signal leads the torque by `lag` times its rate",
    row=210,
)
