"""Faults on demand: what goes wrong in a run, and when.

Cycles count the SYNCs from the one that enabled the first axis, which is cycle 0.
"""

from __future__ import annotations

from collections.abc import Mapping
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


@dataclass(frozen=True)
class Faults:
    """Everything that goes wrong in one session of the simulated arm; nothing by default."""

    lost_tpdos: tuple[LostFrames, ...] = ()
    lost_rpdos: tuple[LostFrames, ...] = ()
    emergencies: tuple[EmergencyAt, ...] = ()
    dead: tuple[DeadAt, ...] = ()

    def loses_tpdo(self, node: int, cycle: int) -> bool:
        """Whether the TPDO of this cycle never arrives."""
        return any(lost.covers(node, cycle) for lost in self.lost_tpdos)

    def loses_rpdo(self, node: int, cycle: int) -> bool:
        """Whether the RPDO that this cycle would latch never arrives."""
        return any(lost.covers(node, cycle) for lost in self.lost_rpdos)

    def as_dict(self) -> dict[str, Any]:
        """Plain lists and numbers, for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """The inverse of :meth:`as_dict`, also after a JSON round trip."""
        return cls(
            lost_tpdos=tuple(LostFrames(*v) for v in values["lost_tpdos"]),
            lost_rpdos=tuple(LostFrames(*v) for v in values["lost_rpdos"]),
            emergencies=tuple(EmergencyAt(*v) for v in values["emergencies"]),
            dead=tuple(DeadAt(*v) for v in values["dead"]),
        )


NO_FAULTS = Faults()
