"""Object values that follow from the arm's description: identity, units, limits, stops, windows."""

from __future__ import annotations

import numpy as np

from drivers.simulated.device import Device, FactorGroup, Pair
from drivers.simulated.object_dictionary import Entry, ObjectDictionary
from robots import Robot
from robots.arrays import FloatArray

_PROFILE = 0x6000
_FITTING_BITS, _WIDE_BITS = 16, 32
_HOMING_SHARE = 0.05
"""Of an axis' limits, for homing."""
_FOLLOWING_MARGIN = 1.5
_FOLLOWING_FLOOR = 0.02
"""Following error that is allowed besides the loop's own lag, rad or m."""


def set_parameters(
    dictionary: ObjectDictionary, robot: Robot, axis: int, serial: int, device: Device | None = None
) -> None:
    """Fills in what the EDS cannot know.

    Args:
        dictionary: of the node of this axis.
        robot: the description.
        axis: index of the drive from 0.
        serial: serial number, object 1018:04.
        device: what the drive is built of; the one that the description means where None.
    """
    drive = robot.drive[axis]
    device = device or Device.described(robot, axis)
    revolute = robot.joint[axis].kind == "revolute"
    counts = device.increments_per_output_unit(revolute) * float(device.units_per_increment)
    size = abs(counts)
    velocity = size * float(device.factors.velocity)
    dictionary.set(0x1018, 4, serial)
    _set_factors(dictionary, device.factors)
    low, high = sorted(float(limit) * counts for limit in output_range(robot)[:, axis])
    dictionary.set(0x607D, 1, _int32(np.floor(low)))
    dictionary.set(0x607D, 2, _int32(np.ceil(high)))
    speed = float(_at_outputs(robot, robot.velocity_limits)[axis])
    acceleration = float(_at_outputs(robot, robot.acceleration_limits)[axis])
    dictionary.set(0x607F, 0, _uint32(speed * velocity))
    dictionary.set(0x6080, 0, _uint32(speed * device.motor_turns * (60 / (2 * np.pi) if revolute else 60.0)))
    dictionary.set(0x6084, 0, _uint32(acceleration * velocity))
    dictionary.set(0x6085, 0, _uint32(acceleration * velocity))
    dictionary.set(0x6099, 1, _uint32(_HOMING_SHARE * speed * velocity))
    dictionary.set(0x6099, 2, _uint32(_HOMING_SHARE * speed * velocity))
    dictionary.set(0x609A, 0, _uint32(_HOMING_SHARE * acceleration * velocity))
    dictionary.set(0x6065, 0, _uint32(following_window(robot, axis) * size))
    signal = drive.control_signal
    # 1000 counts of the control signal are the rated torque (mN·m at the motor), wherever torque is relative.
    rated = 1000 * drive.gain * signal.per_count / (drive.gear * (1.0 if revolute else 2 * np.pi))
    dictionary.set(0x6076, 0, max(1, _uint32(rated * 1000)))
    dictionary.set(0x6072, 0, min(0xFFFF, _uint32(robot.controller.saturation[axis] / signal.per_count)))
    word = signal.index << 16 | signal.subindex << 8
    second = []
    if control_signal_bits(robot, axis) == _FITTING_BITS:
        dictionary.set(0x1A00, 3, word | _FITTING_BITS)
    else:
        dictionary.set(0x1A00, 0, 2)
        second.append(word | _WIDE_BITS)
    if drive.velocity is not None:
        second.append(drive.velocity.index << 16 | drive.velocity.subindex << 8 | _WIDE_BITS)
    for number, entry in enumerate(second, start=1):
        dictionary.set(0x1A01, number, entry)
    dictionary.set(0x1A01, 0, len(second))
    _set_period(dictionary, robot.bus.cycle_time)


def _set_factors(dictionary: ObjectDictionary, factors: FactorGroup) -> None:
    """608F, 6091, 6092, 607E, 60A8 and 60A9, or their absence."""
    pairs: dict[int, Pair | None] = {
        0x608F: factors.resolution,
        0x6091: factors.gear_ratio,
        0x6092: factors.feed,
    }
    for index, pair in pairs.items():
        if pair is None:
            dictionary.remove(index)
            continue
        for subindex, value in enumerate(pair, start=1):
            dictionary.set(index, subindex, value)
    for index, unit in ((0x60A8, factors.position_unit), (0x60A9, factors.velocity_unit)):
        if unit is not None:
            dictionary.add(Entry(index, 0, "I", "ro", unit, None, None, mappable=False))
    dictionary.set(0x607E, 0, factors.polarity)


def control_signal_bits(robot: Robot, axis: int) -> int:
    """Width of the control-signal object: 16 for one of the profile (6000h and up), 32 for a maker's own."""
    return _FITTING_BITS if robot.drive[axis].control_signal.index >= _PROFILE else _WIDE_BITS


def output_range(robot: Robot) -> FloatArray:
    """Lowest and highest position of each drive output within the joint limits, (2, n), rad or m."""
    transmission = robot.transmission_matrix
    forward, backward = np.maximum(transmission, 0.0), np.minimum(transmission, 0.0)
    lowest = forward @ robot.lower + backward @ robot.upper
    highest = forward @ robot.upper + backward @ robot.lower
    return np.stack([lowest, highest])


def following_window(robot: Robot, axis: int) -> float:
    """Following error that full speed explains, with a margin, rad or m: the drive's 6065 by default."""
    controller = robot.controller
    speed = float(_at_outputs(robot, robot.velocity_limits)[axis])
    lag = max(0.0, 1.0 - controller.velocity_feed_forward[axis]) / controller.position_gain[axis]
    if controller.type != "cascade_p_pi":
        lag *= controller.velocity_gain[axis]
    return _FOLLOWING_MARGIN * speed * (lag + 2 * robot.bus.cycle_time) + _FOLLOWING_FLOOR


def _at_outputs(robot: Robot, joint_limits: FloatArray) -> FloatArray:
    return np.asarray(np.abs(robot.transmission_matrix) @ joint_limits)


def _set_period(dictionary: ObjectDictionary, period: float) -> None:
    for exponent in range(-3, -7, -1):
        mantissa = period / 10.0**exponent
        if 1 <= round(mantissa) <= 255 and abs(mantissa - round(mantissa)) < 1e-6:
            dictionary.set(0x60C2, 1, round(mantissa))
            dictionary.set(0x60C2, 2, exponent)
            return


def _int32(value: float) -> int:
    return int(min(max(value, -(2.0**31)), 2.0**31 - 1))


def _uint32(value: float) -> int:
    return int(min(max(round(value), 0), 2**32 - 1))
