"""How full the bus gets, at worst, with the mapping that is used; and the fastest cycle that is safe.

Frame lengths with worst-case bit stuffing: R. I. Davis, A. Burns, R. J. Bril, J. J. Lukkien, "Controller Area
Network (CAN) schedulability analysis: refuted, revisited and revised", Real-Time Systems 35 (2007), eq. 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from drivers.errors import DriveError
from drivers.frames.job import Budgets
from drivers.frames.layout import RPDO, DriveLink
from drivers.frames.period import interpolation_period
from robots.description import Robot

_CONTROL_BITS, _STUFFABLE, _UNSTUFFED = 34, 33, 13
SDO_PER_SECOND = 100
"""Requests with their answers that are allowed for beside the cycle, 8 bytes each."""
EMCY_PER_SECOND = 1
"""Of each drive."""
_HEARTBEATS_PER_WATCH = 4
_LONGEST_CYCLE = 1.0
_VELOCITY_BITS = 32
"""Of 606Ch (CiA 402-2)."""
SIXTEEN_BIT_SIGNALS = frozenset({0x6077, 0x6074, 0x6078})
"""Torque actual value, torque demand, current actual value: INTEGER16 in CiA 402-2."""


def frame_bits(size: int) -> int:
    """Bits of a data frame with an 11-bit id at worst, with interframe space; 55 + 10 for each byte.

    34 control bits and the data are stuffed, at worst every fourth bit after the first.
    """
    data = 8 * size
    return _CONTROL_BITS + data + _UNSTUFFED + (_STUFFABLE + data) // 4


@dataclass(frozen=True)
class FrameKind:
    """So many frames of one length.

    Attributes:
        name: what they are.
        size: payload, bytes.
        per_cycle, per_second: how many come with each SYNC, and how many beside.
    """

    name: str
    size: int
    per_cycle: float = 0.0
    per_second: float = 0.0


@dataclass(frozen=True)
class BusBudget:
    """Worst-case traffic of one arm.

    Attributes:
        kinds: all frames.
        bitrate: bit/s.
        cycle_time: SYNC period, s.
        limit: largest load, as a share of the bit rate.
        sample_time: of the drives' controllers, s: a cycle is a multiple of it.
    """

    kinds: tuple[FrameKind, ...]
    bitrate: int
    cycle_time: float
    limit: float
    sample_time: float

    @classmethod
    def of(cls, robot: Robot, links: Sequence[DriveLink], budgets: Budgets) -> Self:
        """Of the links as they are mapped."""
        tpdos: dict[int, int] = {}
        for link in links:
            sizes = [pdo.layout.size for pdo in link.transmitted()]
            sizes += [sum(entry.bits for entry in pdo.objects) // 8 for pdo in link.idle_tpdos]
            for size in sizes:
                tpdos[size] = tpdos.get(size, 0) + 1
        beats = sum(1 / link.heartbeat for link in links if link.heartbeat > 0)
        beats += _HEARTBEATS_PER_WATCH / budgets.watch_seconds
        n = len(links)
        kinds = (
            FrameKind("SYNC", 0, per_cycle=1),
            FrameKind("RPDO", RPDO.size, per_cycle=n),
            *(FrameKind("TPDO", size, per_cycle=count) for size, count in sorted(tpdos.items())),
            FrameKind("heartbeat", 1, per_second=beats),
            FrameKind("SDO", 8, per_second=2 * SDO_PER_SECOND),
            FrameKind("EMCY", 8, per_second=n * EMCY_PER_SECOND),
        )
        bus = robot.bus
        return cls(kinds, bus.bitrate, bus.cycle_time, bus.load_limit, robot.controller.sample_time)

    @property
    def bits_per_cycle(self) -> int:
        """Of what comes with each SYNC."""
        return sum(round(kind.per_cycle) * frame_bits(kind.size) for kind in self.kinds)

    @property
    def bits_per_second(self) -> float:
        """Of what comes beside the cycle."""
        return sum(kind.per_second * frame_bits(kind.size) for kind in self.kinds)

    def load_at(self, cycle_time: float) -> float:
        """Share of the bit rate at a SYNC period, s."""
        return (self.bits_per_cycle / cycle_time + self.bits_per_second) / self.bitrate

    @property
    def load(self) -> float:
        """Share of the bit rate that is used at worst."""
        return self.load_at(self.cycle_time)

    def fastest_cycle(self) -> float | None:
        """The shortest SYNC period within the limit that drives can be given; None where there is none."""
        for steps in range(1, round(_LONGEST_CYCLE / self.sample_time) + 1):
            period = round(steps * self.sample_time, 9)
            if self.load_at(period) <= self.limit and _expressible(period):
                return period
        return None

    def check(self) -> None:
        """Refuse a bus that is too full.

        Raises:
            DriveError: load, limit, and the fastest cycle that is safe.
        """
        if self.load <= self.limit:
            return
        fastest = self.fastest_cycle()
        advice = "no cycle is safe" if fastest is None else f"the fastest safe cycle is {1e3 * fastest:g} ms"
        raise DriveError(
            f"bus.cycle_time {1e3 * self.cycle_time:g} ms loads a bus of {self.bitrate / 1000:g} kbit/s with "
            f"{100 * self.load:.0f} % at worst; allowed: {100 * self.limit:.0f} % (bus.load_limit); {advice}"
        )


def nominal_links(robot: Robot) -> tuple[DriveLink, ...]:
    """The links as they will be mapped, as far as the description tells: before any drive was asked."""
    return tuple(
        DriveLink(
            node=drive.node_id,
            name=joint.name,
            control_signal_bits=16 if drive.control_signal.index in SIXTEEN_BIT_SIGNALS else 32,
            velocity_bits=0 if drive.velocity is None else _VELOCITY_BITS,
            heartbeat=0.1,
        )
        for joint, drive in zip(robot.joint, robot.drive, strict=True)
    )


def _expressible(period: float) -> bool:
    try:
        interpolation_period(period)
    except DriveError:
        return False
    return True
