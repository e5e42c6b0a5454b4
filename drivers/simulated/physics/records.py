"""What the compiled plant works on: one record per drive and per joint, and arrays for the rest.

Angles of a drive are at its gear output; "motor side" is the rotor's place, divided by the gear ratio.
On a prismatic axis read m for rad and N for N·m.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.simulated.physics.base import Base
from drivers.simulated.physics.chain import Chain
from robots.arrays import BoolArray, FloatArray

Records = NDArray[np.void]
Record = Any
"""One entry of a record array inside compiled code."""

SLIP_ELEMENTS = 4
"""Maxwell-slip elements of a gear with hysteresis."""

DRIVE = np.dtype(
    [
        # Rotor and dry friction.
        ("inertia", "f8"),
        ("coulomb", "f8"),
        ("bristle_width", "f8"),
        ("bristle_damping", "f8"),
        ("coulomb_asymmetry", "f8"),
        ("stribeck_rise", "f8"),
        ("stribeck_speed", "f8"),
        ("stribeck_exponent", "f8"),
        ("static_rise", "f8"),
        ("static_speed", "f8"),
        ("load_rise", "f8"),
        ("driven_rise", "f8"),
        ("load_square", "f8"),
        ("load_time", "f8"),
        ("wave_height", "f8"),
        ("wave_order", "f8"),
        ("wave_phase", "f8"),
        ("spot_height", "f8"),
        ("spot_centre", "f8"),
        ("spot_width", "f8"),
        # Viscous friction.
        ("viscous", "f8"),
        ("viscous_asymmetry", "f8"),
        ("power_share", "f8"),
        ("power_exponent", "f8"),
        ("power_speed", "f8"),
        ("cubic_viscous", "f8"),
        # Temperature of the gear, above that at which the figures hold.
        ("start_warmth", "f8"),
        ("ambient_warmth", "f8"),
        ("ambient_rate", "f8"),
        ("heating", "f8"),
        ("warming_time", "f8"),
        ("coulomb_per_kelvin", "f8"),
        ("viscous_per_kelvin", "f8"),
        # A brake that rubs now and then.
        ("drag_rise", "f8"),
        ("drag_period", "f8"),
        ("drag_share", "f8"),
        # Motor: control signal to torque.
        ("gain", "f8"),
        ("current_limit", "f8"),
        ("current_lag", "f8"),
        ("command_threshold", "f8"),
        ("iron_loss", "f8"),
        ("iron_current", "f8"),
        ("torque_offset", "f8"),
        ("gain_per_kelvin", "f8"),
        ("winding_heating", "f8"),
        ("winding_time", "f8"),
        # Gear that gives way.
        ("compliant", "i8"),
        ("stiffness", "f8"),
        ("cubic_stiffness", "f8"),
        ("damping", "f8"),
        ("gap", "f8"),
        ("slip_stiffness", "f8"),
        ("slip_stretch", "f8"),
        # Slip elements between rotor and housing.
        ("drag_stiffness", "f8"),
        ("drag_stretch", "f8"),
        # Encoder that sits beside its axis.
        ("scale_amplitude", "f8"),
        ("scale_turns", "f8"),
        ("scale_phase", "f8"),
        # Channels of the bus.
        ("position_delay", "f8"),
        ("torque_delay", "f8"),
        ("brake", "f8"),
    ]
)

JOINT = np.dtype(
    [
        ("offset", "f8"),
        ("torsion_stiffness", "f8"),
        ("torsion_centre", "f8"),
        ("spring_stiffness", "f8"),
        ("spring_length", "f8"),
        ("spring_fixed_radius", "f8"),
        ("spring_moving_radius", "f8"),
        ("spring_angle", "f8"),
        ("cable_stiffness", "f8"),
        ("cable_cubic", "f8"),
        ("cable_centre", "f8"),
        ("pack_stiffness", "f8"),
        ("pack_centre", "f8"),
        ("pack_slip", "f8"),
        ("pack_bend", "f8"),
        ("wall_upper", "f8"),
        ("wall_lower", "f8"),
        ("wall_stiffness", "f8"),
        ("wall_damping", "f8"),
        ("slosh_inertia", "f8"),
        ("slosh_stiffness", "f8"),
        ("slosh_damping", "f8"),
    ]
)

MOTOR_STATE = np.dtype(
    [
        ("position", "f8"),
        ("velocity", "f8"),
        ("last_change", "f8"),
        ("bristle", "f8"),
        ("level", "f8"),
        ("dragging", "i8"),
        ("bristle_start", "f8"),
        ("bristle_slope", "f8"),
        ("dry", "f8"),
        ("slope", "f8"),
        ("viscous", "f8"),
        ("gear_torque", "f8"),
        ("drag", "f8"),
        ("load", "f8"),
        ("warmth", "f8"),
        ("winding_warmth", "f8"),
        ("current", "f8"),
        ("torque", "f8"),
        # Of the coming step of a compliant gear, see ``step``.
        ("lever", "f8"),
        ("push", "f8"),
        ("joining", "f8"),
        ("stretch", "f8"),
    ]
)

JOINT_STATE = np.dtype([("slosh_position", "f8"), ("slosh_velocity", "f8"), ("pack_torque", "f8")])


class Harmonics(NamedTuple):
    """Sines over the motor angle: torque ripple, or transmission error of a gear."""

    drive: NDArray[np.int64]
    """(k,) index from 0."""
    order: FloatArray
    """(k,) periods per rad of the drive output, times 2π: order · position is a phase."""
    phase: FloatArray
    amplitude: FloatArray
    """(k,) N·m, or rad at the drive output."""
    per_current: FloatArray
    """(k,) amplitude as a share of the motor's torque."""


class Plane(NamedTuple):
    """A half-space that the tool cannot enter without force: n · p ≥ d."""

    normal: FloatArray
    """(3,) unit vector in the base frame, out of the obstacle."""
    distance: float
    stiffness: float
    """N/m; 0 where there is no obstacle."""
    damping: float
    point: FloatArray
    """(3,) of the tool in the last link's frame, m."""


class Arm(NamedTuple):
    """Everything about the plant that does not change in a run. d ≥ n drives: those beyond n are passive."""

    chain: Chain
    drives: Records
    """(d,) of DRIVE."""
    joints: Records
    """(n,) of JOINT."""
    transmission: FloatArray
    """(d, n) gear output position per joint position."""
    ripple: Harmonics
    kinematic: Harmonics
    plane: Plane
    base: Base
    crosstalk: FloatArray
    """(n, n) share of each drive's torque that turns up at another one."""
    step_time: float
    substeps: int


class Motion(NamedTuple):
    """Everything that changes in a run."""

    position: FloatArray
    """(n,) of the joints."""
    velocity: FloatArray
    motors: Records
    """(d,) of MOTOR_STATE."""
    slip: FloatArray
    """(d, SLIP_ELEMENTS) stretch of each Maxwell-slip element between rotor and output."""
    dragged: FloatArray
    """(d, SLIP_ELEMENTS) the same between rotor and housing."""
    joints: Records
    """(n,) of JOINT_STATE."""
    braked: BoolArray
    """(d,)."""
    push: FloatArray
    """(n,) torque of the surroundings on the joints in this step, N·m."""
    clock: FloatArray
    """(1,) s since the arm was first released."""
    at_rest: BoolArray
    """(1,)."""
    mass: FloatArray
    """(n, n) scratch: of links."""
    loads: FloatArray
    """(n,) scratch: bias and joint-side torques."""
    matrix: FloatArray
    """(n, n) scratch."""
    right: FloatArray
    """(n,) scratch; between steps the change of the joints' speeds in the last one."""
    coming: FloatArray
    """(n,) scratch: the joints' speeds in the middle of the coming step."""
    rocking: FloatArray
    """(3, b) angles of the foot, their rates, and the rates' change in the last step."""
    tool: FloatArray
    """(n, 15) scratch: axis of each joint, its origin, and frame, in the base frame."""


def resting(position: FloatArray, drives: int, base: int = 0) -> Motion:
    """An arm at a posture, not moving, all brakes engaged; motor positions are still to be set."""
    n = len(position)
    return Motion(
        position=np.array(position, dtype=np.float64),
        velocity=np.zeros(n),
        motors=np.zeros(drives, MOTOR_STATE),
        slip=np.zeros((drives, SLIP_ELEMENTS)),
        dragged=np.zeros((drives, SLIP_ELEMENTS)),
        joints=np.zeros(n, JOINT_STATE),
        braked=np.ones(drives, dtype=np.bool_),
        push=np.zeros(n),
        clock=np.zeros(1),
        at_rest=np.ones(1, dtype=np.bool_),
        mass=np.zeros((n, n)),
        loads=np.zeros(n),
        matrix=np.zeros((n, n)),
        right=np.zeros(n),
        coming=np.zeros(n),
        rocking=np.zeros((3, base)),
        tool=np.zeros((n, 15)),
    )
