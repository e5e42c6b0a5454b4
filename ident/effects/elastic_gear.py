"""Joint elasticity and backlash: gears through which the link follows its drive with a state of its own."""

from __future__ import annotations

import numpy as np
import pinocchio

from ident.effects.family import Place, PresentModel, Shape
from ident.effects.foot import AXES
from ident.effects.gear_state import FORGOTTEN, Course, Gear, finer
from ident.effects.giving_way import torque_of_giving_way
from ident.effects.moved_links import slopes_of_links
from ident.effects.placed import (
    OFFSET_AT_LINK,
    Family,
    Law,
    Parameters,
    Parts,
    angle_unit,
    drive_torque,
    each_drive,
    torque_unit,
)
from ident.effects.shown import as_positions_show
from ident.effects.simulated import GearSpring, SimulatedParts
from ident.effects.state import State
from ident.effects.ways import Pliant
from robots import rigid_body_model
from robots.arrays import FloatArray
from robots.description import Robot
from robots.identity_cache import IdentityCache

_CONTACT = (0.5, 1.6, 4.0)
"""Frequency of the link on the flanks of a gear with play, in the home posture, over the cut-off of the
filter of positions: lowest, where the search starts, highest. Of harder impacts a filtered record keeps
nothing."""
_CONTACT_DAMPING = (0.02, 0.3, 1.5)
"""Its damping, ratio to critical."""
_FREQUENCIES = (6.0, 7.5, 9.4, 11.7, 14.6, 18.3, 22.9, 28.6, 35.8, 44.7, 55.9, 69.8, 87.3, 109.1)
_GAPS = (5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 4e-3, 8e-3)
_ONE = ((0.0, 3.0),)
"""The torque of a gear with the right shape is wholly there: its factor is 1."""
_ABOUT_ONE = (0.1,)
"""Deviation of that factor: what links that are known to a tenth leave of it."""
_LEAST = 0.01
"""Of the described inertia of the links at home: an arm that folds has more."""

_AT_HOME: IdentityCache[FloatArray] = IdentityCache()
"""Every effect of a gear with every shape asks for these."""


def inertia_along(mass: FloatArray, back: FloatArray, described: float) -> FloatArray:
    """(samples,) inertia of mass matrices (samples, n, n) for a joint motion (n,), kg·m² (or kg).

    Parameters that were fitted to a motion need be no body's: their inertia can be next to nothing, or
    negative, and a link of that inertia would fly from flank to flank. No posture has so little.

    Args:
        mass: of the model.
        back: joint motion per motion of a drive.
        described: inertia of the described links there, kg·m² (or kg).
    """
    return np.asarray(np.maximum(np.einsum("i,sij,j->s", back, mass, back), _LEAST * described))


def link_inertia(robot: Robot, drive: int) -> float:
    """Inertia of the described links at a drive's output in the home position, kg·m² (or kg)."""
    return float(_AT_HOME.of(robot, lambda: _link_inertias(robot))[drive])


def _link_inertias(robot: Robot) -> FloatArray:
    """(n,) of all drives."""
    model = rigid_body_model(robot)
    mass = pinocchio.crba(model, model.createData(), np.array(robot.home, dtype=np.float64))
    back = np.linalg.inv(robot.transmission_matrix)
    whole = np.triu(mass) + np.triu(mass, 1).T
    return np.asarray(np.maximum(np.einsum("id,ij,jd->d", back, whole, back), 1e-6))


def behind_gear(robot: Robot, drive: int, gear: Gear, offset_at_link: float = 1.0) -> Pliant:
    """Where links give way behind a drive's gear: they lag behind a drive that pushes them."""
    back = np.linalg.inv(robot.transmission_matrix)[:, drive]
    along = np.concatenate([np.zeros(AXES), -back])
    return Pliant(along, gear, link_inertia(robot, drive), offset=offset_at_link)


def gear_columns(robot: Robot, drive: int, present: PresentModel, place: Pliant) -> Law:
    """Torque of links that follow through the gear less that of links that follow rigidly."""
    back, gear, offset_at_link = -place.along[AXES:], place.gear, place.offset
    described = place.described
    rings = gear.is_linear and gear.rings_for(described) > FORGOTTEN

    def law(state: State) -> FloatArray:
        if rings and state.measured is not None:
            # It multiplies what a motion misses, a hundred times: a simulated one, far more than an encoder.
            state = state.measured
        if state.time is None or state.time.shape[0] < 2:
            return np.zeros((*state.position.shape, 1))
        if present.ways(state):
            together = torque_of_giving_way((place,), present, state)[:, :, np.newaxis]
            return as_positions_show(robot, state, together) if gear.gap > 0.0 else together
        slopes = slopes_of_links(present, state, drive, back)

        def course() -> Course:
            inertia = inertia_along(present.link_mass_matrix(state.position), back, described)
            loads = np.empty((inertia.size, 3))
            through = present.link_torque(state) + offset_at_link * present.offset_torque()
            loads[:, 0] = drive_torque(robot, through, drive)
            loads[:, 1:] = slopes.along(back)[:2].T
            loads[inertia <= _LEAST * described, 1:] = 0.0  # no body's
            return finer(inertia, loads, state)

        def carried() -> FloatArray:
            """(samples,) through the gear: what was measured, less what the drive takes for itself."""
            return drive_torque(robot, np.asarray(state.torque) - present.own_torque(state), drive)

        fine = state.once(present, (drive, offset_at_link), course)
        step = float(state.time[1] - state.time[0])
        # The link lags behind a drive that pushes it.
        lag = gear.lag(fine, step, None if state.torque is None else carried)
        change = -slopes.torque(lag)[:, :, np.newaxis]
        # What a spring makes of a filtered motion is filtered; impacts are not.
        return as_positions_show(robot, state, change) if gear.gap > 0.0 else change

    return law


def _elasticity(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    drive, (compliance, damping_ratio) = place.joints[0], shape
    damping = 2 * damping_ratio * float(np.sqrt(link_inertia(robot, drive) / compliance))
    behind = behind_gear(robot, drive, Gear(1.0 / compliance, damping))
    law = gear_columns(robot, drive, present, behind)

    def parts(values: FloatArray) -> SimulatedParts:
        return SimulatedParts(springs=(GearSpring(drive, compliance * float(values[0]), damping),))

    return Parameters(("elasticity",), ("1",), _ONE, _ABOUT_ONE, (1.0,), gives_way=(behind,)), law, parts


def _elastic_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    inertia = link_inertia(robot, place.joints[0])
    low, *grid, high = (1.0 / (inertia * (2 * np.pi * f) ** 2) for f in (120.0, *_FREQUENCIES[::-1], 3.0))
    unit = f"{angle_unit(robot, place)}/({torque_unit(robot, place)})"
    return (
        Shape("compliance", unit, tuple(map(float, grid)), float(low), float(high), True),
        Shape("damping_ratio", "1", (0.08,), 0.002, 1.0, True),
    )


def _backlash(
    robot: Robot, place: Place, shape: tuple[float, ...], present: PresentModel
) -> tuple[Parameters, Law, Parts]:
    drive, (gap, offset_at_link, stiffness, ratio) = place.joints[0], shape
    damping = 2 * ratio * float(np.sqrt(link_inertia(robot, drive) * stiffness))
    behind = behind_gear(robot, drive, Gear(stiffness, damping, gap), offset_at_link)
    law = gear_columns(robot, drive, present, behind)

    def parts(values: FloatArray) -> SimulatedParts:
        size = gap * float(values[0])
        return SimulatedParts(springs=(GearSpring(drive, 1.0 / stiffness, damping, size, offset_at_link),))

    return Parameters(("play",), ("1",), _ONE, _ABOUT_ONE, (1.0,), gives_way=(behind,)), law, parts


def _gap_shapes(robot: Robot, place: Place) -> tuple[Shape, ...]:
    inertia, cutoff = link_inertia(robot, place.joints[0]), robot.identification.cutoff_hz
    softest, flank, hardest = (inertia * (2 * np.pi * share * cutoff) ** 2 for share in _CONTACT)
    least, ratio, most = _CONTACT_DAMPING
    return (
        Shape("gap", angle_unit(robot, place), _GAPS, 2e-5, 2e-2, True),
        OFFSET_AT_LINK,
        Shape(
            "contact_stiffness",
            f"{torque_unit(robot, place)}/{angle_unit(robot, place)}",
            (flank,),
            softest,
            hardest,
            True,
        ),
        Shape("contact_damping_ratio", "1", (ratio,), least, most, True),
    )


JOINT_ELASTICITY = Family(
    "joint_elasticity",
    "a gear that gives way, so that the link follows late and may ring",
    "drive",
    each_drive,
    _elasticity,
    _elastic_shapes,
    confused_with=("backlash", "current_loop_lag"),
    shows="both",
    stiff=True,
    rough=True,
    history=True,
    settled_by=(
        "lock the motor and hang known weights on the link, a dial gauge on it: a gear that gives way"
        " moves in proportion"
    ),
    told_from={
        "current_loop_lag": (
            "lock the link and step the control signal: the current shows the lag, no gear is in it"
        ),
    },
    timeless=True,
    equation=(
        "links behind the gear are moved by the measured motion of the drive through a spring "
        "with damper; the torque is that of the links as they then move, less that of links which"
        " move rigidly with the drive. The factor of that torque, `elasticity`, is 1 where the "
        "shape is right"
    ),
    row=110,
)
BACKLASH = Family(
    "backlash",
    "play in the gear: the link is free between the flanks",
    "drive",
    each_drive,
    _backlash,
    _gap_shapes,
    confused_with=("joint_elasticity", "hysteresis"),
    shows="both",
    stiff=True,
    rough=True,
    history=True,
    settled_by=("lock the motor and push the link both ways, a dial gauge on it: play moves without force"),
    told_from={
        "joint_elasticity": (
            "lock the motor and push the link both ways with a dial gauge on it: play moves without force"
        ),
        "hysteresis": (
            "lock the motor and push the link both ways with a dial gauge on it: play moves without force"
        ),
    },
    timeless=True,
    equation=(
        "as `joint_elasticity`, between two flanks that push and never pull; the factor is "
        "`play`. Stiffness and damping of a flank are those of impacts as a filtered record shows"
        " them"
    ),
    row=120,
)
