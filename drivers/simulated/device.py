"""What one simulated drive is built of and set to: encoder, gear, direction, and its factor group.

The drive converts by CiA 402-2 from increments of its own encoder to the units of its objects and back. It
takes nothing from the master's reading of the same objects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from math import pi

import numpy as np

from drivers.simulated.quirks import STANDARD, Quirks
from robots.arrays import FloatArray
from robots.description import Robot

_POSITION_POLARITY = 0x80
_ASSUMED_INCREMENTS = 1 << 17
"""Of an encoder that the description says nothing of."""
_LARGEST_ENTRY = 2**32 - 1
_GEAR_DENOMINATOR = 10_000
_FEED_DENOMINATOR = 1_000_000

Pair = tuple[int, int]


@dataclass(frozen=True)
class FactorGroup:
    """Objects that set the units; None where the drive does not have one."""

    resolution: Pair | None = None
    """608F: encoder increments per motor revolutions."""
    gear_ratio: Pair | None = None
    """6091: motor revolutions per shaft revolutions."""
    feed: Pair | None = None
    """6092: position units per shaft revolutions."""
    position_unit: int | None = None
    """60A8: unit and power of ten."""
    units_per_turn: Fraction | None = None
    """What 60A8 makes of one turn of the shaft, where it names an angle."""
    polarity: int = 0
    """607E."""
    velocity_unit: int | None = None
    """60A9."""
    velocity: Fraction = Fraction(1)
    """Velocity units per position unit per second."""


@dataclass(frozen=True)
class Device:
    """One drive with its motor.

    Attributes:
        increments: of the encoder per motor turn.
        motor_turns: per turn (or metre) of the drive output, of the real gear.
        direction: -1 where the motor turns against the output: its encoder counts down, and its torque is
            counted against the output, while the output goes in the positive sense.
        factors: the drive's own setting of its units.
        quirks: what this kind of drive does otherwise than the standards say.
    """

    increments: int
    motor_turns: float
    direction: int = 1
    factors: FactorGroup = FactorGroup()
    quirks: Quirks = STANDARD

    @classmethod
    def described(cls, robot: Robot, axis: int) -> Device:
        """The drive that an arm's description means, set up in full as the standard has it."""
        drive = robot.drive[axis]
        increments = drive.encoder_counts or _ASSUMED_INCREMENTS
        ratio = Fraction(1)
        if robot.joint[axis].kind == "revolute":
            ratio = Fraction(drive.gear).limit_denominator(_GEAR_DENOMINATOR)
        if drive.counts_per_output_turn is None:
            feed = increments * ratio
        else:
            per_shaft_turn = drive.counts_per_output_turn / drive.gear * float(ratio)
            feed = Fraction(per_shaft_turn).limit_denominator(_FEED_DENOMINATOR)
        direction = drive.control_signal.sign or drive.sign
        factors = FactorGroup(
            resolution=(increments, 1),
            gear_ratio=(ratio.numerator, ratio.denominator),
            # Too large for the object: without a feed constant the unit is the increment.
            feed=(feed.numerator, feed.denominator) if feed.numerator <= _LARGEST_ENTRY else None,
            # What turns the sign of a drive's positions alone, and not that of its torque.
            polarity=0 if direction == drive.sign else _POSITION_POLARITY,
        )
        return cls(increments, drive.gear, direction, factors)

    @property
    def units_per_increment(self) -> Fraction:
        """Position units per increment of the encoder, signed by the polarity (CiA 402-2, factor group)."""
        group = self.factors
        scale = Fraction(1)
        per_shaft_turn = group.units_per_turn
        if per_shaft_turn is None and group.feed is not None:
            per_shaft_turn = Fraction(*group.feed)
        if per_shaft_turn is not None:
            resolution = Fraction(*group.resolution) if group.resolution else Fraction(self.increments)
            gear = Fraction(*group.gear_ratio) if group.gear_ratio else Fraction(1)
            scale = per_shaft_turn / (resolution * gear)
        return -scale if group.polarity & _POSITION_POLARITY else scale

    def increments_per_output_unit(self, revolute: bool) -> float:
        """Encoder increments per rad (or m) of the output, signed."""
        per_turn = self.direction * self.increments * self.motor_turns
        return per_turn / (2 * pi) if revolute else per_turn


class PositionScale:
    """Whole numbers between the encoder's increments and the units of the objects, both ways.

    Args:
        device: whose.
    """

    def __init__(self, device: Device) -> None:
        scale = device.units_per_increment
        self._up, self._down = scale.numerator, scale.denominator
        self._velocity = float(scale * device.factors.velocity)

    def units(self, increments: int) -> int:
        """Position units at a reading of the encoder, rounded."""
        return _divided(increments * self._up, self._down)

    def increments(self, units: int) -> int:
        """The reading of the encoder at a position in units, rounded."""
        return _divided(units * self._down, self._up)

    def velocity(self, increments_per_second: float) -> float:
        """Velocity units at a speed of the encoder."""
        return increments_per_second * self._velocity

    def speed(self, velocity_units: float) -> float:
        """Increments per second, without sign, at a velocity in units; likewise of an acceleration."""
        return abs(velocity_units / self._velocity)


def _divided(upper: int, lower: int) -> int:
    """The nearest whole number; ``lower`` may be negative."""
    if lower < 0:
        upper, lower = -upper, -lower
    return (2 * upper + lower) // (2 * lower)


def described_devices(robot: Robot, quirks: Quirks = STANDARD) -> tuple[Device, ...]:
    """The drives that an arm's description means, all of one kind."""
    return tuple(replace(Device.described(robot, axis), quirks=quirks) for axis in range(robot.n))


def increments_per_output_unit(robot: Robot, devices: Sequence[Device]) -> FloatArray:
    """Encoder increments per rad (or m) of each drive output, signed, (n,)."""
    pairs = zip(devices, robot.joint, strict=True)
    return np.array([device.increments_per_output_unit(joint.kind == "revolute") for device, joint in pairs])


def units_per_output_unit(robot: Robot, devices: Sequence[Device]) -> FloatArray:
    """Position units of the drives' objects per rad (or m) of each drive output, signed, (n,)."""
    scale = np.array([float(device.units_per_increment) for device in devices])
    return np.asarray(increments_per_output_unit(robot, devices) * scale)


def described_increments(robot: Robot) -> FloatArray:
    """Encoder increments per rad (or m) of the drive outputs that the description means, signed, (n,)."""
    return increments_per_output_unit(robot, described_devices(robot))
