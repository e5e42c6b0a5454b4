"""Torque ripple: cogging and currents that are not quite sines, periodic in the motor's angle."""

from __future__ import annotations

import numpy as np

from ident.effects.family import Place, PresentModel, Shape
from ident.effects.placed import (
    ANY,
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    drive_torque,
    each_geared_drive,
    speed_limit,
    torque_unit,
)
from ident.effects.scales import dry_friction
from ident.effects.shown import as_filter_shows
from ident.effects.simulated import DriveChange, PositionTorque, SimulatedParts, Table
from ident.effects.state import State
from robots.arrays import FloatArray
from robots.description import Robot

PERIODS = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0)
"""Per turn of the motor: once for a run-out, twice for a wave generator, pole pairs and their multiples."""

_FEWEST = 4.0
"""Periods over the travel: what has fewer is a spring."""

WITHOUT_GEAR = {"periods_per_joint_turn": "per turn", "periods_per_metre": "per metre"}
"""Shapes of a ripple of any period, and how they are said."""

_SLOW = 0.1
"""Of the speed limit: a wave that the filter passes below that speed alone shows on few rows."""


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """Cogging is a torque of its own; with currents a share of the torque comes and goes over the angle."""
    periods, with_torque = shape
    return _of_waves(robot, place, periods * motor_angle(robot, place), with_torque, present)


def _make_of_any(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """The same over the angle of the drive's output."""
    periods, with_torque = shape
    return _of_waves(robot, place, periods * waves_per_period(robot, place), with_torque, present)


def _of_waves(
    robot: Robot, place: Place, waves: float, with_torque: float, present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """Of a wave's phase per output of the drive, 1 (or rad/m)."""
    row, drive = drive_row(robot, place), place.joints[0]

    def law(state: State) -> FloatArray:
        phase = waves * (state.position @ row)
        left = as_filter_shows(robot, waves * np.abs(state.velocity @ row) / (2.0 * np.pi), state.time)
        # What the torque has too much the control signal need not ask for.
        size = -left * drive_torque(robot, present.torque(state), drive) if with_torque else left
        return along(row, size * np.cos(phase), size * np.sin(phase))

    def parts(values: FloatArray) -> SimulatedParts:
        reach = float(np.abs(row) @ np.maximum(np.abs(robot.lower), np.abs(robot.upper))) + 0.1

        def curve(position: FloatArray) -> FloatArray:
            return np.asarray(values[0] * np.cos(waves * position) + values[1] * np.sin(waves * position))

        table = Table.of(curve, -reach, reach)
        if with_torque:
            return SimulatedParts(drives=(DriveChange(drive, gain_curve=table),))
        return SimulatedParts(position=(PositionTorque(row, row, table, side="drive"),))

    unit = "1" if with_torque else torque_unit(robot, place)
    stem = "ripple_share" if with_torque else "ripple"
    symbols = (f"{stem}_cos", f"{stem}_sin")
    size = 0.05 if with_torque else 0.3 * dry_friction(robot, place)
    return Parameters(symbols, (unit, unit), (ANY, ANY), (size, size)), law, parts


def ripple_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    """Periods per turn of the motor are whole numbers: tried, not refined."""
    return (Shape("periods_per_turn", "1", PERIODS, 1.0, PERIODS[-1], fixed=True),)


def _shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    return (*ripple_shapes(robot, place), Shape("with_torque", "1", (0.0, 1.0), 0.0, 1.0, fixed=True))


def waves_per_period(robot: Robot, place: Place) -> float:
    """Of one period per turn of the output, 1, or per metre where it slides, rad/m."""
    return 1.0 if robot.joint[place.joints[0]].unit == "rad" else 2.0 * np.pi


def motor_angle(robot: Robot, place: Place) -> float:
    """Of a drive's motor per rad of the output, 1, or per metre where it slides, rad/m."""
    return robot.drive[place.joints[0]].gear * waves_per_period(robot, place)


def _shapes_of_any(robot: Robot, place: Place) -> tuple[Shape, ...]:
    """Any period from a quarter of the travel to what the filter passes at a tenth of the speed limit.

    Neighbours are half a wave apart over the travel, so that none between them is missed.
    """
    row, unit = drive_row(robot, place), waves_per_period(robot, place)
    travel = float(np.abs(row) @ (robot.upper - robot.lower))
    slow = _SLOW * speed_limit(robot, row)
    lowest, highest = 2.0 * np.pi * _FEWEST / travel, 2.0 * np.pi * robot.identification.cutoff_hz / slow
    step, count = np.pi / travel, max(2, int((highest - lowest) * travel / np.pi))
    grid = tuple(float(waves) / unit for waves in lowest + step * np.arange(count))
    turns = robot.joint[place.joints[0]].unit == "rad"
    name, of = ("periods_per_joint_turn", "1") if turns else ("periods_per_metre", "1/m")
    shape = Shape(name, of, grid, grid[0], grid[-1], scanned="position")
    return shape, Shape("with_torque", "1", (0.0, 1.0), 0.0, 1.0, fixed=True)


ANY_PERIOD = Family(
    "torque_ripple",
    "torque that is periodic in the joint's angle; no gear of the description explains its period",
    "drive",
    each_geared_drive,
    _make_of_any,
    _shapes_of_any,
    several=True,
)

TORQUE_RIPPLE = Family(
    "torque_ripple",
    "torque that is periodic in the motor's angle",
    "drive",
    each_geared_drive,
    _make,
    _shapes,
    confused_with=("gear_ripple",),
    several=True,
    forms=(ANY_PERIOD,),
    settled_by="uncouple the motor and turn it alone: ripple of the torque stays",
    equation=(
        "a torque over the angle of the motor, as of `gear_ripple`; `with_torque` 1 says that it "
        "is a share of the drive's torque, and its parameters are `ripple_share_cos` and "
        "`ripple_share_sin`; with `periods_per_joint_turn` (`periods_per_metre` where it slides) "
        "over the angle of the joint, whatever its gear"
    ),
    row=180,
)
