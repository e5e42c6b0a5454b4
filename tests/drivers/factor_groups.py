"""Random drives with their factor groups as CiA 402-2 has them, and the arm's description that fits them.

The unit is drawn first, in position units per turn of the output; the objects follow from it by hand. Nothing
of the master's reading nor of the simulated drives' conversion is used.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np

from drivers.simulated.device import Device, FactorGroup
from robots import Robot
from robots.description import Drive

GEARS = (Fraction(45), Fraction(50), Fraction(101), Fraction(64, 3), Fraction(1919, 14), Fraction(7, 2))
ENCODERS = (65_536, 100_000, 1 << 17, 1 << 20)
UNITS = (131_072, 360_000, 1_000_000, 6_283_186)
ANGLES = {
    0xFD410000: Fraction(360_000),  # 10^-3 degree
    0xFC410000: Fraction(3_600_000),  # 10^-4 degree
    0x00430000: Fraction(1_296_000),  # second of arc
    0xFBB40000: Fraction(100_000),  # 10^-5 turn
}
INCREMENTS = 0x00B50000


def pair(value: Fraction, by: int = 1) -> tuple[int, int]:
    """Numerator and denominator of an object, not in lowest terms where ``by`` is not 1."""
    return value.numerator * by, value.denominator * by


def described(drive: Drive, rng: np.random.Generator) -> tuple[Drive, Device]:
    """A drive of the description with other units, and the simulated drive that has them."""
    gear, encoder = GEARS[rng.integers(len(GEARS))], int(rng.choice(ENCODERS))
    mounted, polarity = int(rng.choice([-1, 1])), int(rng.choice([0, 0x80]))
    by = int(rng.integers(1, 4))
    inside = bool(rng.integers(2))  # whether the drive knows the gear
    ratio = gear if inside else Fraction(1)
    outside = gear / ratio  # shaft turns per output turn
    resolution, gears = (encoder * by, by), pair(ratio, by)
    form = rng.integers(6)
    explicit: float | None
    if form == 0:  # a feed constant, with and without 608F
        feed = Fraction(int(rng.choice(UNITS)))
        group = FactorGroup(resolution if rng.integers(2) else None, gears, pair(feed, by))
        explicit = float(feed * outside)
    elif form == 1:  # a unit of angle
        unit = int(rng.choice(list(ANGLES)))
        group = FactorGroup(resolution, gears, None, unit, ANGLES[unit])
        explicit = float(ANGLES[unit] * outside)
    elif form == 2:  # increments, said by 60A8
        group = FactorGroup(resolution, gears, None, INCREMENTS)
        explicit = None
    elif form == 3:  # increments, because there is no feed constant
        group = FactorGroup(resolution, gears if rng.integers(2) else None)
        explicit = None
    elif form == 4:  # as delivered: 1/1 everywhere, the unit is the increment
        group = FactorGroup((1, 1), (1, 1), (1, 1))
        explicit = float(encoder * gear)
    else:  # a feed constant and a unit that say the same
        unit = int(rng.choice(list(ANGLES)))
        group = FactorGroup(resolution, gears, pair(ANGLES[unit], by), unit, ANGLES[unit])
        explicit = float(ANGLES[unit] * outside)
    sign = -mounted if polarity else mounted
    changes = {
        "encoder_counts": encoder if explicit is None or rng.integers(2) else None,
        "counts_per_output_turn": explicit,
        "gear": float(gear),
        "sign": sign,
    }
    device = Device(encoder, float(gear), mounted, replace(group, polarity=polarity))
    return drive.model_copy(update=changes), device


def consistent(robot: Robot, rng: np.random.Generator) -> tuple[Robot, tuple[Device, ...]]:
    """The arm with other drives, and a wrist that is coupled otherwise."""
    pairs = [described(drive, rng) for drive in robot.drive]
    transmission = np.array(robot.transmission)
    transmission[5, 4] = rng.choice([-1.0, 1.0, 0.5])
    transmission[4, 3] = rng.choice([0.0, 0.0, 0.25])
    changes = {
        "drive": tuple(drive for drive, _ in pairs),
        "transmission": tuple(tuple(row) for row in transmission.tolist()),
    }
    return robot.model_copy(update=changes), tuple(device for _, device in pairs)


def _scaled(value: tuple[int, int], rng: np.random.Generator) -> tuple[int, int]:
    upper, lower = ((3, 1), (1, 2), (10, 9), (1001, 1000), (45, 1))[rng.integers(5)]
    return value[0] * upper, value[1] * lower


def spoil(drive: Drive, device: Device, rng: np.random.Generator) -> Device:
    """The drive with one object of its factor group other than its description means."""
    group = device.factors
    choices = []
    if group.resolution is not None and group.resolution != (1, 1):
        if drive.encoder_counts is not None:  # else nobody but the drive says what its encoder is
            choices.append(replace(group, resolution=_scaled(group.resolution, rng)))
        choices.append(replace(group, resolution=(1, 1)))
    if group.gear_ratio is not None and group.resolution != (1, 1):
        gears = _scaled(group.gear_ratio, rng)
        scaled = group.feed is not None or group.units_per_turn is not None
        if scaled or abs(gears[0] / gears[1] / device.motor_turns - 1) > 1e-9:
            choices.append(replace(group, gear_ratio=gears))
    if group.feed is not None and group.resolution != (1, 1):
        choices.append(replace(group, feed=_scaled(group.feed, rng)))
        if group.position_unit is None:  # beside a unit of angle 1/1 is as delivered, and means nothing
            choices.append(replace(group, feed=(1, 1)))
    unit = int(rng.choice([0x00410000, 0x00B40000, 0x00100000]))
    angle = {0x00410000: Fraction(360), 0x00B40000: Fraction(1), 0x00100000: Fraction(710, 113)}[unit]
    choices.append(replace(group, position_unit=unit, units_per_turn=angle))
    return replace(device, factors=choices[rng.integers(len(choices))])
