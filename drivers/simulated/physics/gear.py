"""A gear that gives way: the rotor and the gear's output are two masses with a state each.

Between them act a spring with a cubic term, a dead zone (backlash: stiff damped contact on either flank,
no pull), Maxwell-slip elements (hysteresis; Iwan 1966, Ruderman and Bertram 2012) and a transmission
error that is periodic in the motor's angle. What the error does to the stretch, its slope does to the
torque on the rotor, so that an inexact gear makes no energy.
"""

from __future__ import annotations

import math

from drivers.simulated.physics.compile import inner
from drivers.simulated.physics.records import SLIP_ELEMENTS, Arm, Harmonics, Record
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
def slip_limit(drive: Record, element: int) -> float:
    """Stretch at which a Maxwell-slip element begins to slide, rad."""
    last: float = drive.slip_stretch
    return last * (element + 1.0) / SLIP_ELEMENTS


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
def slide(drive: Record, slip: FloatArray, before: float, after: float) -> None:
    """Moves the slip elements as the stretch goes from ``before`` to ``after``."""
    if drive.slip_stiffness > 0.0:
        change = beyond_gap(after, drive.gap) - beyond_gap(before, drive.gap)
        for k in range(SLIP_ELEMENTS):
            limit = slip_limit(drive, k)
            slip[k] = min(max(slip[k] + change, -limit), limit)


@inner
def contact_damping(drive: Record, stretch: float) -> float:
    """Damping of the gear at a stretch: none while no flank touches, N·m·s/rad."""
    damping: float = drive.damping
    if drive.gap > 0.0:
        x = abs(beyond_gap(stretch, drive.gap))
        damping *= x / (x + _CONTACT_SHARE * drive.gap)
    return damping


@inner
def prepare(arm: Arm, drive: int, motor: Record, slip: FloatArray, shaft: float, shaft_speed: float) -> float:
    """Torque of the gear at the start of a step; writes ``stretch`` and ``lever``, returns its damping."""
    figures = arm.drives[drive]
    error, slope = transmission_error(arm.kinematic, drive, motor.position)
    motor.lever = 1.0 - slope
    motor.stretch = motor.position - error - shaft
    spring = spring_torque(figures, slip, motor.stretch)
    damping = contact_damping(figures, motor.stretch)
    torque = spring + damping * (motor.lever * motor.velocity - shaft_speed)
    if figures.gap > 0.0 and torque * spring <= 0.0:
        # Flanks push and never pull.
        torque, damping = 0.0, 0.0
    motor.gear_torque = torque
    return damping
