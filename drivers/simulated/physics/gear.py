"""A gear that gives way: the rotor and the gear's output are two masses with a state each.

Between them act a spring with a cubic term, a dead zone (backlash: stiff damped contact on either flank,
no pull), Maxwell-slip elements (hysteresis; Iwan 1966, Al-Bender et al. 2005) and a transmission
error that is periodic in the motor's angle. What the error does to the stretch, its slope does to the
torque on the rotor, so that an inexact gear makes no energy.
"""

from __future__ import annotations

import math

from drivers.simulated.physics.compile import inner
from drivers.simulated.physics.records import SLIP_ELEMENTS, Harmonics, Record
from robots.arrays import FloatArray

_CONTACT_SHARE = 0.05
"""Penetration, as a share of the gap, at which a flank's damping has half its size."""


@inner
def transmission_error(kinematic: Harmonics, drive: int, position: float) -> tuple[float, float]:
    """Error of the output position at a rotor position, rad, and its slope."""
    error, slope = 0.0, 0.0
    for k in range(len(kinematic.drive)):
        if kinematic.drive[k] == drive:
            phase = kinematic.order[k] * position + kinematic.phase[k]
            error += kinematic.amplitude[k] * math.sin(phase)
            slope += kinematic.amplitude[k] * kinematic.order[k] * math.cos(phase)
    return error, slope


@inner
def beyond_gap(stretch: float, gap: float) -> float:
    """What is left of a stretch after the dead zone from −gap to +gap."""
    return stretch - min(max(stretch, -gap), gap)


@inner
def slide(slip: FloatArray, change: float, last: float) -> float:
    """Moves Maxwell-slip elements along a way; returns the mean of their stretches, rad.

    Args:
        slip: (SLIP_ELEMENTS,) stretches.
        change: the way, rad.
        last: stretch at which the last element slides, rad; the others slide earlier, one after the other.
    """
    total = 0.0
    for k in range(SLIP_ELEMENTS):
        limit = last * (k + 1.0) / SLIP_ELEMENTS
        slip[k] = min(max(slip[k] + change, -limit), limit)
        total += slip[k]
    return total / SLIP_ELEMENTS


@inner
def spring_torque(drive: Record, slip: FloatArray, stretch: float) -> float:
    """Torque of springs and slip elements for a stretch of rotor against output, N·m."""
    x = beyond_gap(stretch, drive.gap)
    torque: float = (drive.stiffness + drive.cubic_stiffness * x * x) * x
    if drive.slip_stiffness > 0.0:
        for k in range(SLIP_ELEMENTS):
            torque += drive.slip_stiffness / SLIP_ELEMENTS * slip[k]
    return torque


@inner
def contact_damping(drive: Record, stretch: float) -> float:
    """Damping of the gear at a stretch: none while no flank touches, N·m·s/rad."""
    damping: float = drive.damping
    if drive.gap > 0.0:
        x = abs(beyond_gap(stretch, drive.gap))
        damping *= x / (x + _CONTACT_SHARE * drive.gap)
    return damping


@inner
def prepare(
    drive: Record,
    index: int,
    motor: Record,
    slip: FloatArray,
    kinematic: Harmonics,
    shaft: float,
    shaft_speed: float,
) -> float:
    """Writes ``stretch``, ``lever``, ``gear_torque`` at the start of a step; returns the gear's damping."""
    error, slope = transmission_error(kinematic, index, motor.position)
    motor.lever = 1.0 - slope
    motor.stretch = motor.position - error - shaft
    spring = spring_torque(drive, slip, motor.stretch)
    damping = contact_damping(drive, motor.stretch)
    torque = spring + damping * (motor.lever * motor.velocity - shaft_speed)
    if drive.gap > 0.0 and torque * spring <= 0.0:
        # Flanks push and never pull.
        torque, damping = 0.0, 0.0
    motor.gear_torque = torque
    return damping


@inner
def wind(
    drive: Record, index: int, motor: Record, slip: FloatArray, kinematic: Harmonics, shaft: float
) -> None:
    """Brings ``stretch`` and the slip elements to the positions after a step."""
    error, _ = transmission_error(kinematic, index, motor.position)
    stretch = motor.position - error - shaft
    if drive.slip_stiffness > 0.0:
        slide(
            slip,
            beyond_gap(stretch, drive.gap) - beyond_gap(motor.stretch, drive.gap),
            drive.slip_stretch,
        )
    motor.stretch = stretch
