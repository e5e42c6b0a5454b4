"""How an arm stands still: its gears wound up by what they hold."""

from __future__ import annotations

import math

import numpy as np

from drivers.simulated.physics.records import SLIP_ELEMENTS, Arm, Motion
from robots.arrays import FloatArray

_BISECTIONS = 80
_WIDEST = 1.0
"""Largest stretch that is looked for, rad."""


def gear_stretch(arm: Arm, motion: Motion, rotors: FloatArray, holding: FloatArray) -> FloatArray:
    """How far each rotor is ahead of its gear's output, transmission error included, (n,).

    Winds the slip elements of ``motion`` up accordingly.

    Args:
        arm: the plant's figures.
        motion: the plant's state; its slip elements are written.
        rotors: rotor positions, (n,).
        holding: torques through the gears, (n,), N·m.
    """
    ahead = np.zeros(len(rotors))
    for i in np.flatnonzero(arm.drives["compliant"][: len(rotors)]):
        low, high = -_WIDEST, _WIDEST
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            if _torque(arm, int(i), middle) < holding[i]:
                low = middle
            else:
                high = middle
        stretch = 0.5 * (low + high)
        motion.slip[i] = _slip(arm, int(i), stretch)
        motion.motors["stretch"][i] = stretch
        ahead[i] = stretch + _error(arm, int(i), float(rotors[i]))
    return ahead


def _beyond_gap(arm: Arm, i: int, stretch: float) -> float:
    gap = float(arm.drives["gap"][i])
    return stretch - min(max(stretch, -gap), gap)


def _slip(arm: Arm, i: int, stretch: float) -> FloatArray:
    limits = float(arm.drives["slip_stretch"][i]) * np.arange(1, SLIP_ELEMENTS + 1) / SLIP_ELEMENTS
    return np.asarray(np.clip(_beyond_gap(arm, i, stretch), -limits, limits))


def _torque(arm: Arm, i: int, stretch: float) -> float:
    drive = arm.drives[i]
    x = _beyond_gap(arm, i, stretch)
    elements = drive["slip_stiffness"] * _slip(arm, i, stretch).mean()
    return float((drive["stiffness"] + drive["cubic_stiffness"] * x * x) * x + elements)


def _error(arm: Arm, i: int, position: float) -> float:
    kinematic = arm.kinematic
    return sum(
        float(kinematic.amplitude[k])
        * math.sin(float(kinematic.order[k]) * position + float(kinematic.phase[k]))
        for k in np.flatnonzero(kinematic.drive == i)
    )
