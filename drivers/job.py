"""Everything that the cyclic process needs to know, handed over before it begins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drivers.channel import Channel
from drivers.units import Units
from robots.arrays import FloatArray, IntArray
from robots.description import Robot

_PROCESS_STALL = 0.2
"""s; how long a busy machine may keep a process waiting where all drives are processes of it."""


@dataclass(frozen=True)
class Budgets:
    """How much may go wrong before the master stops the arm; the defaults are for a real one."""

    receive_seconds: float = 0.0
    """How long after a SYNC the drives' answers are waited for, where that is more than the ordinary share
    of the period; the next SYNCs are put off by it."""

    incomplete_in_a_row: int = 3
    """SYNCs in a row that a drive may leave unanswered."""
    missed_in_a_row: int = 10
    """Deadlines that one stall of the cyclic process may skip."""
    enable_seconds: float = 2.0
    """For each step of the state machine; brakes open in one of them."""
    answer_seconds: float = 1.0
    """Until each drive answers the first SYNCs."""
    settle_seconds: float = 0.3
    """At rest on the reference's first point before it begins."""
    standstill_seconds: float = 1.0
    """After the last set-point, for the arm to come to rest before the drives are disabled."""

    @classmethod
    def on(cls, channel: Channel, cycle_time: float) -> Self:
        """What fits a channel whose SYNC comes every ``cycle_time`` s.

        Behind ``udp_multicast`` and ``vcan`` devices there are only simulated drives: ordinary processes of
        this machine, which a busy processor delays, and whose time goes by SYNCs. Waiting for them costs
        nothing but punctuality.
        """
        virtual_device = channel.interface == "socketcan" and channel.name.startswith(("vcan", "vxcan"))
        if channel.interface == "udp_multicast" or virtual_device:
            return cls(receive_seconds=0.03, missed_in_a_row=round(_PROCESS_STALL / cycle_time))
        return cls()


@dataclass(frozen=True)
class Job:
    """One stream, in counts of the drives wherever the cycle needs it."""

    channel: Channel
    bitrate: int
    nodes: tuple[int, ...]
    drives: tuple[str, ...]
    """How messages name each drive."""
    control_signal_bits: tuple[int, ...]
    cycle_time: float
    units: Units
    reference: NDArray[np.int32]
    """N × n targets."""
    velocity: FloatArray
    """(n,) joint limits."""
    acceleration: FloatArray
    """(n,) joint limits."""
    following_error: IntArray
    """(n,) counts at the drive output."""
    start_tolerance: FloatArray
    """(n,) joint: how far the arm may stand from the reference's first point."""
    budgets: Budgets
    parent: int
    """Process id: when that process is gone, the arm is stopped."""
    ring_capacity: int


def following_error_window(robot: Robot, cycle_time: float) -> FloatArray:
    """The largest drive-output error that the loop of the description can have and still be in control.

    At that error the controller's output is at its saturation while the arm moves at full speed;
    the set-point itself lags its target by up to two periods of interpolation, and reporting takes one.

    Args:
        robot: with controller gains and velocity limits.
        cycle_time: s.

    Returns:
        (n,) rad or m at the drive output.
    """
    controller = robot.controller
    speed = np.abs(robot.transmission_matrix) @ robot.velocity_limits
    lag = speed * np.maximum(0.0, 1.0 - np.array(controller.velocity_feed_forward))
    saturation, k_p, k_v = (
        np.array(values)
        for values in (controller.saturation, controller.position_gain, controller.velocity_gain)
    )
    if controller.type == "cascade_p_pi":
        error = (saturation / k_v + lag) / k_p
    else:
        error = (saturation + k_v * lag) / k_p
    return np.asarray(error + 3 * cycle_time * speed)
