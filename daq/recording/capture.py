"""What a capture is once it has been read: the samples, what was recorded with them, what is missing."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from daq.recording.errors import CAPTURE_SUFFIX as CAPTURE_SUFFIX
from daq.recording.errors import CaptureError as CaptureError
from daq.recording.events import DriveEvent
from daq.recording.temperatures import Temperature
from drivers.frames.samples import Samples
from robots.arrays import FloatArray

PROFILE = "armhil"

DESCRIPTION = "armhil.description"
MESHES = "meshes"
"""Key of that record: checksums of the URDF's meshes, JSON."""
RUN = "armhil.run"
TRAJECTORY = "armhil.trajectory"
OUTCOME = "armhil.outcome"
RECOVERY = "armhil.recovery"
"""In a capture that was rebuilt from a damaged one."""
IMPORT = "armhil.import"
"""In a capture that was made of a log of somebody else."""
FAULT = "armhil.fault"
"""In a capture that a fault triggered."""
CHECKSUM_KEY = "sha256"
UNKNOWN = "unknown"
"""In place of a count in an outcome: the cyclic process has died and could not say."""

Facts = Mapping[str, str]


def facts_checksum(facts: Facts) -> str:
    """Checksum of one metadata record. MCAP itself protects chunks but not metadata."""
    rest = {key: value for key, value in facts.items() if key != CHECKSUM_KEY}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Gap:
    """Cycles ``first`` to ``last`` (both included) that were streamed and are not in the file."""

    first: int
    last: int

    @property
    def cycles(self) -> int:
        return self.last - self.first + 1


@dataclass(frozen=True)
class Damage:
    """What could not be read back from a capture. A capture without damage is whole."""

    gaps: tuple[Gap, ...] = ()
    unreadable_bytes: int = 0
    closed: bool = True
    """False where the recorder never got to close the file: killed, or cut off afterwards."""
    lost_records: tuple[str, ...] = ()
    """Metadata records that are missing or do not match their checksum."""
    lost_frames: int = 0
    """Raw frames that were recorded and are not in the file."""
    unknown_end: bool = False
    """Whether the outcome does not say how many cycles there were: the cyclic process has died."""
    beyond: int = 0
    """Cycles that are in the file and, by its outcome, never were."""

    def __bool__(self) -> bool:
        lost = self.lost_records or self.lost_frames
        end = not self.closed or self.unknown_end or self.beyond
        return bool(self.gaps or self.unreadable_bytes or end or lost)

    def sentences(self, period: float) -> tuple[str, ...]:
        """What is missing, in words; ``period`` is the SYNC period in s."""
        parts = [
            f"cycles {gap.first} to {gap.last} are missing ({gap.cycles * period:.3f} s)" for gap in self.gaps
        ]
        if self.lost_frames:
            parts.append(f"{self.lost_frames} raw frames are missing")
        if self.unreadable_bytes:
            parts.append(f"{self.unreadable_bytes} bytes are damaged and were skipped")
        if not self.closed:
            parts.append("the recording was not closed: what followed the last cycle is not known")
        if self.unknown_end:
            parts.append("the cyclic process died: what followed the last cycle is not known")
        if self.beyond:
            parts.append(f"{self.beyond} cycles are in the file beyond those that its outcome tells of")
        parts.extend(f"record {name} is missing or damaged" for name in self.lost_records)
        return tuple(parts)


@dataclass(frozen=True)
class Capture:
    """One run of one arm, as read from its file."""

    path: Path
    sha256: str
    robot_name: str
    robot_text: str
    """The whole ``robot.toml`` that the run was made with."""
    urdf_text: str
    joints: tuple[str, ...]
    period: float
    """SYNC period, s."""
    samples: Samples
    run: Facts
    trajectory: Facts
    outcome: Facts | None
    """None where the recorder did not get to write it."""
    damage: Damage = field(default_factory=Damage)
    events: tuple[DriveEvent, ...] = ()
    """What the drives said beside their samples."""
    temperatures: tuple[Temperature, ...] = ()
    frames: int = 0
    """Raw frames in the file; ``daq.recording.reader.iterate_frames`` reads them."""
    records: Mapping[str, Facts] = field(default_factory=dict)
    """All intact metadata records by name."""
    beside: Mapping[str, FloatArray] = field(default_factory=dict)
    """Further channels of an imported log, samples × joints each: ``daq.recording.joint_channels``."""

    @property
    def has_reference(self) -> bool:
        """Whether the set-points were recorded; logs of others may have none, and theirs are NaN."""
        return self.run.get("reference", "recorded") != "absent"

    @property
    def pauses(self) -> tuple[int, ...]:
        """Cycles before which the arm rested on request: time has passed that is not in the record."""
        told = "" if self.outcome is None else self.outcome.get("pauses", "")
        return tuple(int(cycle) for cycle in told.split(", ") if cycle.isdecimal() and cycle.isascii())

    def segments(self) -> tuple[Samples, ...]:
        """The samples of :meth:`segment_rows`."""
        return tuple(select(self.samples, rows) for rows in self.segment_rows())

    def segment_rows(self) -> tuple[NDArray[np.intp], ...]:
        """Pieces without a gap, in which every drive answered every cycle: a gap is never data.

        Where the arm rested in a pause one piece ends and the next begins. The ramps on both sides are part
        of them: they are motion like any other, and their references are what was driven.
        """
        good = np.asarray(self.samples.complete).all(axis=1)
        cycles = np.asarray(self.samples.cycle)[good]
        cuts = np.flatnonzero((np.diff(cycles) != 1) | np.isin(cycles[1:], self.pauses)) + 1
        rows = np.split(np.flatnonzero(good), cuts)
        return tuple(piece for piece in rows if piece.size)


def select(samples: Samples, rows: np.ndarray[tuple[int], np.dtype[np.intp]] | slice) -> Samples:
    """The given rows of some samples."""
    return Samples(
        cycle=samples.cycle[rows],
        time=samples.time[rows],
        reference=samples.reference[rows],
        position=samples.position[rows],
        control_signal=samples.control_signal[rows],
        statusword=samples.statusword[rows],
        complete=samples.complete[rows],
        lateness=samples.lateness[rows],
    )
