"""Everything that the cyclic process needs to know, handed over before it begins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drivers.frames.channel import Channel
from drivers.frames.layout import DriveLink
from drivers.frames.units import Units
from robots.arrays import FloatArray, IntArray
from robots.description import Robot
from robots.windows import following_error_window as following_error_window

_STEP_MARGIN = 0.01
_PROCESS_LATENESS = 0.1
"""s; how long the answers of such processes are waited for."""
_PROCESS_STALL = 0.2
"""s; how long a busy machine may keep a process waiting where all drives are processes of it."""


@dataclass(frozen=True)
class Budgets:
    """How much may go wrong before the master stops the arm; the defaults are for a real one."""

    receive_seconds: float = 0.0
    """How long after a SYNC the drives' answers are waited for, where that is more than the ordinary share
    of the period; the next SYNCs are put off by it."""

    held_cycles: int = 1
    """SYNCs that an answer may be late, and that a row therefore waits before it is handed out: where a drive
    answers twice, its answers to so many SYNCs before are not believed, either."""
    incomplete_in_a_row: int = 3
    """SYNCs in a row that a drive may leave unanswered."""
    missed_in_a_row: int = 10
    """Deadlines that one stall of the cyclic process may skip."""
    enable_seconds: float = 2.0
    """For each step of the state machine; brakes open in one of them."""
    answer_seconds: float = 1.0
    """Until each drive answers the first SYNCs and has sent a heartbeat."""
    settle_seconds: float = 0.3
    """At rest on the reference's first point before it begins."""
    standstill_seconds: float = 1.0
    """After the last set-point, for the arm to come to rest before the drives are disabled."""
    watch_seconds: float = 0.1
    """How long a drive may hear no heartbeat and no RPDO of the master before it stops by itself (1016h,
    1400h:05)."""
    heartbeat_periods: float = 3.5
    """Heartbeats of a drive that may be missing."""
    stall_seconds: float = 0.0
    """What a busy machine may add to that, where the drives are processes of it."""
    torque_cycles: int = 5
    """SYNCs in a row with a joint torque above its limit."""
    frozen_cycles: int = 10
    """SYNCs in a row in which a reading may stay the same to the last count while its set-point moves on."""

    @classmethod
    def on(cls, channel: Channel, cycle_time: float) -> Self:
        """What fits a channel whose SYNC comes every ``cycle_time`` s.

        Behind ``udp_multicast`` and ``vcan`` devices there are only simulated drives: ordinary processes of
        this machine, which a busy processor delays, and whose time goes by SYNCs. Waiting for them costs
        nothing but punctuality.
        """
        if channel.only_simulated and channel.interface != "virtual":
            return cls(
                receive_seconds=_PROCESS_LATENESS,
                held_cycles=round(_PROCESS_LATENESS / cycle_time),
                missed_in_a_row=round(_PROCESS_STALL / cycle_time),
                watch_seconds=0.25,
                stall_seconds=_PROCESS_STALL,
            )
        return cls()


@dataclass(frozen=True)
class TorqueLimit:
    """A joint's torque from the raw control signals of its drives, and what it may be.

    Attributes:
        joint: its name.
        parts: axis and N·m (or N) at the joint per count of that axis' control-signal object.
        limit: N·m or N.
    """

    joint: str
    parts: tuple[tuple[int, float], ...]
    limit: float


@dataclass(frozen=True)
class HomingJob:
    """A search for one drive's home, in place of a reference to follow.

    Attributes:
        axis: whose drive is in homing mode.
        travel: counts that it may move until home is found.
        seconds: that this may take.
        speed: counts per second that it was told to search at.
        home: counts that it has to read at its home (607C); not compared where None.
        near: counts that it may stand from there, and that it may run ahead of its speed.
    """

    axis: int
    travel: int
    seconds: float
    speed: float = np.inf
    home: int | None = None
    near: int = 0


@dataclass(frozen=True)
class Job:
    """One stream, in counts of the drives wherever the cycle needs it."""

    channel: Channel
    bitrate: int
    links: tuple[DriveLink, ...]
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
    master_node: int = 127
    period_ends: tuple[int, ...] = ()
    """Rows at which a period of the reference is over and the next one begins."""
    torque_limits: tuple[TorqueLimit, ...] = ()
    position_limits: tuple[FloatArray, FloatArray] | None = None
    """Lowest and highest joint positions, each (n,), for motions that the master makes by itself."""
    brake_release: float = 0.0
    """s that brakes need to open after the drives are enabled."""
    brake_engage: float = 0.0
    """s that brakes need to fall in before torque may go."""

    homing: HomingJob | None = None
    """Where there is one, the reference is not followed."""
    arrival: FloatArray | None = None
    """(n,) rad or m: how near each joint must come to the last target before the stream is complete."""

    @property
    def nodes(self) -> tuple[int, ...]:
        return tuple(link.node for link in self.links)

    @property
    def drives(self) -> tuple[str, ...]:
        """How messages name each drive."""
        return tuple(link.name for link in self.links)

    @property
    def largest_step(self) -> list[int]:
        """Counts that a set-point may move in one cycle at the velocity limits, per axis."""
        speed = self.units.output_span(self.velocity) * np.abs(self.units.counts_per_output_unit)
        return [int(counts) for counts in np.ceil(speed * self.cycle_time * (1 + _STEP_MARGIN)) + 2]


def torque_limits(robot: Robot) -> tuple[TorqueLimit, ...]:
    """τ = Tᵀ (g_τ ∘ v_τ) joint by joint (eq. 5), straight from the counts that TPDOs bring."""
    per_count = robot.gains * robot.control_signal_per_count
    factors = robot.transmission_matrix.T * per_count
    return tuple(
        TorqueLimit(
            joint.name,
            tuple((int(axis), float(row[axis])) for axis in np.flatnonzero(row)),
            joint.torque,
        )
        for joint, row in zip(robot.joint, factors, strict=True)
    )
