"""Drive-gain error: a drive makes more or less torque of its control signal than its gain says."""

from __future__ import annotations

from ident.effects.family import Place, PresentModel
from ident.effects.placed import (
    Family,
    Law,
    Parameters,
    Parts,
    along,
    drive_row,
    drive_torque,
    each_drive,
)
from ident.effects.simulated import DriveChange, SimulatedParts
from ident.effects.state import State
from robots.arrays import FloatArray
from robots.description import Robot


def _make(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    """torque = (1 + δ) g_τ v_τ, so g_τ v_τ is the torque less δ/(1 + δ) of it, δ of it to first order."""
    drive, row = place.joints[0], drive_row(robot, place)

    def law(state: State) -> FloatArray:
        return along(row, -drive_torque(robot, present.torque(state), drive))

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(drives=(DriveChange.of_missing_share(drive, values[0]),))

    return Parameters(("gain_error",), ("1",), ((-0.9, 0.9),), (0.08,)), law, parts


DRIVE_GAIN_ERROR = Family(
    "drive_gain_error",
    "a drive gain that is not what it is thought to be",
    "drive",
    each_drive,
    _make,
    needs_prior=True,
    confused_with=("payload", "load_dependent_friction"),
    settled_by=(
        "record once more with a known payload: it weighs too much where the gain is wrong (armhil gain)"
    ),
    told_from={
        "rotor_inertia": "record once more with a known payload: it weighs too much where the gain is wrong",
        "payload": "take the tool off and record again: a payload leaves with it, a wrong gain stays",
        "load_dependent_friction": (
            "hold a known payload still, reached from both sides: friction turns its sign, a gain does not"
        ),
    },
    equation=(
        "the share of the torque that the control signal does not show: δ/(1 + δ) where the true "
        "gain is (1 + δ) times the described one"
    ),
    row=160,
)
