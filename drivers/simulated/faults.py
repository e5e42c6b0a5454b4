"""Faults on demand: what goes wrong in a run, and when.

Cycles count the SYNCs from the one that enabled the first axis, which is cycle 0.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple, Self


class LostFrames(NamedTuple):
    """Frames of one node that never arrive: from ``cycle`` on, so many ``cycles`` long."""

    node: int
    cycle: int
    cycles: int = 1

    def covers(self, node: int, cycle: int) -> bool:
        """Whether this node's frame of this cycle is lost."""
        return node == self.node and self.cycle <= cycle < self.cycle + self.cycles


class EmergencyAt(NamedTuple):
    """A drive that finds a fault of its own at a cycle and sends this EMCY code."""

    node: int
    cycle: int
    code: int


class DeadAt(NamedTuple):
    """A drive that loses its supply at a cycle: its brake falls in, and it is silent from then on."""

    node: int
    cycle: int


class FrozenEncoder(NamedTuple):
    """An encoder that says the same from a cycle on, to the drive and its controller too."""

    node: int
    cycle: int


class HotMotor(NamedTuple):
    """A motor that heats up from a cycle on, K/s beside what its current does."""

    node: int
    cycle: int
    rate: float


class WrongIdentity(NamedTuple):
    """Another device than expected: its product code (1018:02)."""

    node: int
    product: int


class BusOff(NamedTuple):
    """The master's controller goes off the bus at a cycle: it is told so, and no frame passes any more."""

    cycle: int


@dataclass(frozen=True)
class Faults:
    """Everything that goes wrong in one session of the simulated arm; nothing by default."""

    lost_tpdos: tuple[LostFrames, ...] = ()
    lost_rpdos: tuple[LostFrames, ...] = ()
    late_tpdos: tuple[LostFrames, ...] = ()
    """Frames that arrive, but only after the next SYNC."""
    late_rpdos: tuple[LostFrames, ...] = ()
    emergencies: tuple[EmergencyAt, ...] = ()
    dead: tuple[DeadAt, ...] = ()
    frozen_encoders: tuple[FrozenEncoder, ...] = ()
    hot_motors: tuple[HotMotor, ...] = ()
    identities: tuple[WrongIdentity, ...] = ()
    bus_off: tuple[BusOff, ...] = ()

    def loses_tpdo(self, node: int, cycle: int) -> bool:
        """Whether the TPDO of this cycle never arrives."""
        return any(lost.covers(node, cycle) for lost in self.lost_tpdos)

    def loses_rpdo(self, node: int, cycle: int) -> bool:
        """Whether the RPDO that this cycle would latch never arrives."""
        return any(lost.covers(node, cycle) for lost in self.lost_rpdos)

    def delays_tpdo(self, node: int, cycle: int) -> bool:
        """Whether the TPDO of this cycle comes after the next SYNC."""
        return any(late.covers(node, cycle) for late in self.late_tpdos)

    def delays_rpdo(self, node: int, cycle: int) -> bool:
        """Whether the RPDO that this cycle would latch comes after its SYNC."""
        return any(late.covers(node, cycle) for late in self.late_rpdos)

    def as_dict(self) -> dict[str, Any]:
        """Plain lists and numbers, for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse of :meth:`as_dict`, also after a JSON round trip."""
        return cls(**{name: tuple(kind(*v) for v in values.get(name, ())) for name, kind in _KINDS.items()})


_KINDS: dict[str, Callable[..., Any]] = {
    "lost_tpdos": LostFrames,
    "lost_rpdos": LostFrames,
    "late_tpdos": LostFrames,
    "late_rpdos": LostFrames,
    "emergencies": EmergencyAt,
    "dead": DeadAt,
    "frozen_encoders": FrozenEncoder,
    "hot_motors": HotMotor,
    "identities": WrongIdentity,
    "bus_off": BusOff,
}

NO_FAULTS = Faults()
