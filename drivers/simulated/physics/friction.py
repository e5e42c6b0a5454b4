"""Friction in a gear: bristles that bend before they slide, with levels that depend on nearly everything.

A sign function of the velocity cannot hold a load at standstill. A bristle can (Dahl 1968; Canudas de Wit
et al. 1995, "LuGre"): it bends by a tiny *pre-sliding displacement* and holds any torque below the level
for ever, as a real gear does. With s the deflection relative to the bend d at the Coulomb torque Fc, w the
velocity and Fc·g(w, …) the level,

    ds/dt = w/d − |w|/(d·g) · s,     torque = Fc·s + damping while it bends.

For a velocity and a level that are constant over a step this has an exact solution, s(w). Its tangent at
the predicted velocity makes the torque ``dry + slope · w_new``, which the plant solves for w_new: the stiff
bristle then sets no limit to the step, and where it slides the torque is the level exactly.

The level follows Stribeck's curve (Armstrong-Hélouvry 1994), the direction, the position, the torque
through the gear and the temperature; viscous friction follows a power of the speed and a cubic term.
"""

from __future__ import annotations

import math

from drivers.simulated.physics.compile import inner
from drivers.simulated.physics.records import Record

_DAMPING_SPEED = 50.0
"""Bristle damping dies out above this many widths per second, so that sliding is purely Coulomb."""
_FADED = 26.0
"""Beyond this exp(−x²) is nothing, and takes long to find out by underflow."""
_LOWEST_LEVEL = 0.02
"""Dry friction does not vanish, whatever lowers it."""
_ROUNDING = 1e-3
"""Share of the reference speed below which a power law is rounded off."""
_CREEP_SPEED = 1e-5
"""Speed at which an engaged brake gives half its torque, rad/s or m/s."""


@inner
def level(drive: Record, motor: Record, speed: float, position: float) -> float:
    """Level of dry friction relative to the Coulomb torque, for a speed and place of the rotor."""
    size = abs(speed)
    g: float = 1.0 + (drive.coulomb_asymmetry if speed >= 0.0 else -drive.coulomb_asymmetry)
    if drive.stribeck_rise != 0.0:
        g *= 1.0 + drive.stribeck_rise * math.exp(-((size / drive.stribeck_speed) ** drive.stribeck_exponent))
    if drive.static_rise != 0.0:
        g *= 1.0 + drive.static_rise * math.exp(-((size / drive.static_speed) ** 2))
    if drive.wave_height != 0.0:
        g *= 1.0 + drive.wave_height * math.cos(drive.wave_order * position - drive.wave_phase)
    if drive.spot_height != 0.0:
        away = (position - drive.spot_centre) / drive.spot_width
        g *= 1.0 + drive.spot_height * math.exp(-0.5 * away * away)
    if drive.coulomb_per_kelvin != 0.0:
        g *= math.exp(drive.coulomb_per_kelvin * motor.warmth)
    if drive.load_rise != 0.0 or drive.driven_rise != 0.0:
        # The gear lifts its load where both have one sign, and lets it down where they do not.
        g += (drive.load_rise if motor.load * speed >= 0.0 else drive.driven_rise) * abs(motor.load)
    if drive.load_square != 0.0:
        g += drive.load_square * motor.load * motor.load
    if motor.dragging:
        g += drive.drag_rise
    return max(g, _LOWEST_LEVEL)


@inner
def viscous(drive: Record, motor: Record, speed: float) -> float:
    """Viscous torque per speed at this speed."""
    factor: float = drive.viscous
    if drive.viscous_asymmetry != 0.0:
        factor *= 1.0 + (drive.viscous_asymmetry if speed >= 0.0 else -drive.viscous_asymmetry)
    if drive.power_share != 0.0:
        ratio = speed / drive.power_speed
        power = (ratio * ratio + _ROUNDING * _ROUNDING) ** (0.5 * (drive.power_exponent - 1.0))
        factor *= 1.0 - drive.power_share + drive.power_share * power
    if drive.viscous_per_kelvin != 0.0:
        factor *= math.exp(drive.viscous_per_kelvin * motor.warmth)
    factor += drive.cubic_viscous * speed * speed
    return factor


@inner
def linearise(drive: Record, motor: Record, speed: float, position: float, braked: bool, step: float) -> None:
    """Writes ``dry``, ``slope`` and ``viscous`` of the coming step: torque = dry + slope · new speed.

    Args:
        drive: figures of the drive.
        motor: its state; what :func:`advance` needs is kept there too.
        speed: speed of the rotor now, rad/s.
        position: its place, rad.
        braked: whether its brake is engaged.
        step: s.
    """
    predicted = speed + motor.last_change
    motor.viscous = viscous(drive, motor, predicted)
    motor.dry, motor.slope = 0.0, 0.0
    if drive.coulomb > 0.0:
        g = level(drive, motor, predicted, position)
        motor.level = g
        reach = step / (drive.bristle_width * g)
        decay = math.exp(-abs(predicted) * reach)
        direction = math.copysign(1.0, predicted)
        towards = direction * g - motor.bristle
        # s(w) = s + (g sign w − s)(1 − decay);  ds/dw = (g − s sign w)·decay·step/(d g).
        motor.bristle_slope = max(direction * towards * decay * reach, 0.0)
        bent = towards * (1.0 - decay) - motor.bristle_slope * predicted
        motor.bristle_start = motor.bristle + bent
        fading = predicted / (_DAMPING_SPEED * drive.bristle_width)
        damping = 0.0
        if abs(fading) < _FADED:
            damping = drive.bristle_damping / step * math.exp(-fading * fading)
        motor.dry = drive.coulomb * motor.bristle_start + damping * bent
        motor.slope = (drive.coulomb + damping) * motor.bristle_slope
    if braked:
        # Hardly dependent on the speed, linear in the new one: stable at any step.
        motor.slope += drive.brake / (abs(speed) + _CREEP_SPEED)


@inner
def advance(drive: Record, motor: Record, new_speed: float) -> None:
    """Moves the bristle over the step that :func:`linearise` prepared."""
    if drive.coulomb > 0.0:
        moved = motor.bristle_start + motor.bristle_slope * new_speed
        limit = max(motor.level, abs(motor.bristle))
        motor.bristle = min(max(moved, -limit), limit)


@inner
def age(drive: Record, motor: Record, speed: float, clock: float, step: float) -> None:
    """What changes with time: the gear warms by friction and cools to what is around it, a brake rubs."""
    if drive.drag_period > 0.0:
        turns = clock / drive.drag_period
        motor.dragging = turns - math.floor(turns) < drive.drag_share
    if drive.warming_time > 0.0:
        around = drive.ambient_warmth + drive.ambient_rate * clock
        power = (motor.dry + (motor.slope + motor.viscous) * speed) * speed
        motor.warmth += step / drive.warming_time * (around + drive.heating * power - motor.warmth)
