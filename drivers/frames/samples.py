"""What a stream brings back: one row per SYNC, and how the stream ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Final, Literal, Self

import numpy as np
from numpy.typing import NDArray

from robots.arrays import BoolArray, FloatArray, IntArray

Outcome = Literal["completed", "stopped", "aborted", "fault"]
ENDED_BY_ITSELF: Final[tuple[Outcome, ...]] = ("aborted", "fault")
"""Nobody asked for the end: somebody has to acknowledge it before anything moves again."""


@dataclass(frozen=True)
class Samples:
    """Rows of N consecutive SYNCs of a stream; arrays over the joints are N × n."""

    cycle: IntArray
    """(N,) number of the SYNC, 0 where the reference begins; gap-free."""
    time: FloatArray
    """(N,) s, cycle · SYNC period."""
    reference: FloatArray
    """N × n, rad or m: the target that the drives latched at this SYNC, decoded from its counts."""
    position: FloatArray
    """N × n, rad or m: measured at this SYNC."""
    control_signal: FloatArray
    """N × n, v_τ of each drive at this SYNC."""
    statusword: NDArray[np.uint16]
    """N × n, 6041h."""
    complete: BoolArray
    """N × n, whether this drive's TPDO came in time, and only one; where not, the values are no sample."""
    lateness: FloatArray
    """(N,) s from the deadline that followed the previous SYNC's to the SYNC; more than one period
    means that deadlines were skipped."""
    velocity: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    """N × n, rad/s or m/s: as the drives report it (606Ch); NaN where they were not asked to."""

    def __post_init__(self) -> None:
        if not self.velocity.size:
            object.__setattr__(self, "velocity", np.full(self.position.shape, np.nan))

    def __len__(self) -> int:
        return len(self.cycle)

    @classmethod
    def empty(cls, n: int) -> Self:
        """No rows of n axes: what a stream brings that was refused before its first row."""
        return cls(
            cycle=np.zeros(0, dtype=np.int64),
            time=np.zeros(0),
            reference=np.zeros((0, n)),
            position=np.zeros((0, n)),
            control_signal=np.zeros((0, n)),
            statusword=np.zeros((0, n), dtype=np.uint16),
            complete=np.zeros((0, n), dtype=np.bool_),
            lateness=np.zeros(0),
        )

    @classmethod
    def concatenate(cls, batches: Sequence[Samples]) -> Self:
        """One batch out of several, in the given order.

        Raises:
            ValueError: there is no batch.
        """
        columns = {f.name: np.concatenate([getattr(b, f.name) for b in batches]) for f in fields(cls)}
        return cls(**columns)


@dataclass(frozen=True)
class StreamResult:
    """How a stream ended."""

    outcome: Outcome
    """``completed``: the whole reference was streamed; ``stopped``: on request; ``aborted``: the master's
    own checks ended it; ``fault``: a drive's."""
    reason: str
    """In words."""
    cycles: int | None
    """SYNCs in the record. This and the other counts are None where the cyclic process has died: what it has
    handed over is there, and nobody knows what else it has done."""
    missed_cycles: int | None
    """Deadlines at which no SYNC was sent."""
    late_cycles: int | None
    """SYNCs sent more than half a period after their deadline."""
    incomplete_cycles: int | None = 0
    """SYNCs that some drive did not answer in time, or answered more than once."""
    incomplete_before: int | None = 0
    """The same between the first commands to the drives and the record."""
    notes: tuple[str, ...] = ()
    """What the cyclic process had to do without, such as real-time priority, and what the bus reported."""
    doubtful: tuple[str, ...] = ()
    """What drives said more than once, or in another length than mapped: in words, for people to see."""
    overflows: int | None = 0
    """Received frames that this machine lost because they were not fetched in time."""
    pauses: tuple[int, ...] = ()
    """Rows before which the arm rested on request: between such a row and the one before, time has passed."""
    cpu_share: float = 0.0
    """Processor time of the cyclic process over the time it ran: 0.1 is a tenth of a core."""
    missed_for: dict[str, int] = field(default_factory=dict)
    """``missed_cycles`` by what kept the cyclic process: see :mod:`drivers.cyclic.delays`."""
    torque_unconfirmed: tuple[str, ...] = ()
    """Drives that have not confirmed at the end that their torque is off."""
    rest_unconfirmed: tuple[str, ...] = ()
    """Drives that were not seen at rest at the end."""

    restarted: tuple[str, ...] = ()
    """Drives that have sent a boot-up message: they have lost their configuration."""

    @property
    def cycles_words(self) -> str:
        """How many cycles there are, and of how many deadlines, in words."""
        if self.cycles is None:
            return "an unknown number of cycles"
        if not self.missed_cycles:
            return f"{self.cycles} cycles"
        missed = self.missed_cycles
        deadlines = "deadline" if missed == 1 else "deadlines"
        return f"{self.cycles} of {self.cycles + missed} cycles ({missed} {deadlines} missed)"

    @property
    def ending(self) -> str:
        """How the arm was left, in words."""
        if not (self.torque_unconfirmed or self.rest_unconfirmed):
            return "the arm is at rest and its torque is off"
        if self.rest_unconfirmed == self.torque_unconfirmed:
            return f"NOT KNOWN to be at rest and without torque: {', '.join(self.rest_unconfirmed)}"
        parts = ["the arm is at rest"] if not self.rest_unconfirmed else []
        parts += ["torque is off"] if not self.torque_unconfirmed else []
        for what, drives in (("at rest", self.rest_unconfirmed), ("without torque", self.torque_unconfirmed)):
            parts += [f"NOT KNOWN to be {what}: {', '.join(drives)}"] if drives else []
        return "; ".join(parts)
