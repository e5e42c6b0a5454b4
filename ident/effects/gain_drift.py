"""A drive gain that changes with the motor's heat: no name of the vocabulary, but a form of a residual.

The gain settles after a start, and magnets weaken as the losses of the winding, which go with the square of
the current, warm them: to first order, with the motor as a first-order store of heat.
"""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel, Shape, State
from ident.effects.placed import (
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    drive_torque,
    each_drive,
    torque_unit,
)
from ident.effects.scales import rated_torque
from ident.effects.simulated import DriveChange, SimulatedParts
from ident.effects.warming import warmed
from robots.arrays import FloatArray
from robots.description import Robot


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """The share of the torque that is missing, at the start and in the end; and per square of the torque."""
    drive, row, (settling,) = place.joints[0], drive_row(robot, place), shape

    def law(state: State) -> FloatArray:
        torque = -drive_torque(robot, present.torque(state), drive)
        course = np.ones_like(torque) if state.time is None else np.exp(-state.time / settling)
        heat = warmed(torque**2, state.time, settling)
        return along(row, course * torque, (1.0 - course) * torque, heat * torque)

    def parts(values: FloatArray) -> SimulatedParts:
        # A simulation has one gain: that of the end, without what follows the motion.
        return SimulatedParts(drives=(DriveChange.of_missing_share(drive, values[1]),))

    symbols = ("gain_cold", "gain_warm", "gain_heat")
    square = f"1/({torque_unit(robot, place)})²"
    bounds = ((-0.9, 0.9), (-0.9, 0.9), (-np.inf, 0.0))
    scale = (0.08, 0.08, 0.08 / (0.3 * rated_torque(robot, place)) ** 2)
    return Parameters(symbols, ("1", "1", square), bounds, scale), law, parts


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (Shape("settling_time", "s", (3.0, 8.0, 20.0, 60.0), 1.0, 600.0, True),)


GAIN_DRIFT = Family(
    "gain_drift",
    "a drive gain that changes over the recording",
    "drive",
    each_drive,
    _make,
    _shapes,
    needs_prior=True,
    contains=("drive_gain_error",),
    history=True,
    settled_by="record the same motion cold and warm: a gain that drifts has changed, all else has not",
)

UNNAMED_FAMILIES: tuple[Family, ...] = (GAIN_DRIFT,)
"""What a residual is described with where one of these explains it best; no finding is called by them."""
