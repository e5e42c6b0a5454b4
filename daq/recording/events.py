"""What the drives said beside their samples, in words: emergencies, changes of state, boot-ups, the bus."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from daq.recording.cdr import CdrDecoder, CdrEncoder
from daq.recording.frames import Frames
from drivers.bus.error_frames import ERROR_FLAG, error_report
from drivers.cia402.emergency import EmergencyMessage
from drivers.cia402.states import State, state_of
from drivers.frames.layout import emcy_cob_id, heartbeat_cob_id
from drivers.frames.samples import Samples
from robots import Robot
from robots.arrays import BoolArray, IntArray

INFO, WARN, ERROR, FATAL = 20, 30, 40, 50
EMERGENCY, STATE, NMT, BUS = "EMCY", "state", "NMT", "bus"

_STATES = tuple(State)
_STATE_INDEX = np.array([_STATES.index(state_of(word)) for word in range(0x80)])
_STATE_LEVELS = {State.FAULT: ERROR, State.FAULT_REACTION: ERROR, State.QUICK_STOP: WARN, State.UNKNOWN: WARN}
_NMT_STATES = {0: "has booted", 4: "is stopped", 5: "is operational", 127: "is pre-operational"}
_BOOTED, _STOPPED = 0, 4


@dataclass(frozen=True)
class DriveEvent:
    """One thing that happened."""

    stamp: int
    """ns since the epoch."""
    level: int
    """As ROS has it: 20 info, 30 warning, 40 error, 50 fatal."""
    joint: str
    """Whose drive said so; ``bus`` where it is none's."""
    kind: str
    """EMCY, state, NMT or bus."""
    code: int
    """Error code of an EMCY (603Fh), statusword, NMT state, or class of a controller's report."""
    text: str
    """In words."""

    @property
    def is_fault(self) -> bool:
        """Whether a run ends with it."""
        return self.level >= ERROR

    def encode(self) -> bytes:
        """As ``rcl_interfaces/msg/Log``."""
        encoder = CdrEncoder()
        encoder.primitive("int32", self.stamp // 1_000_000_000)
        encoder.primitive("uint32", self.stamp % 1_000_000_000)
        encoder.primitive("uint8", self.level)
        for text in (self.joint, self.text, "", self.kind):
            encoder.string(text)
        encoder.primitive("uint32", self.code)
        return encoder.finish()

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """The inverse of :meth:`encode`.

        Raises:
            daq.recording.cdr.CdrError: the bytes are no such message.
        """
        decoder = CdrDecoder(data)
        seconds, nanoseconds = int(decoder.primitive("int32")), int(decoder.primitive("uint32"))
        level = int(decoder.primitive("uint8"))
        joint, text, _, kind = (decoder.string() for _ in range(4))
        code = int(decoder.primitive("uint32"))
        return cls(seconds * 1_000_000_000 + nanoseconds, level, joint, kind, code, text)


class EventFinder:
    """Finds events in frames and samples as they come; each change is told once.

    Args:
        robot: whose nodes and joints to name.
    """

    def __init__(self, robot: Robot) -> None:
        self._joints = tuple(joint.name for joint in robot.joint)
        # An arm that is described for logs alone has no nodes.
        drives = zip(robot.drive, self._joints, strict=True) if robot.has_drives else ()
        nodes = {drive.node_id: joint for drive, joint in drives}
        self._emergency_ids = {emcy_cob_id(node): joint for node, joint in nodes.items()}
        self._heartbeat_ids = {heartbeat_cob_id(node): joint for node, joint in nodes.items()}
        self._ids = np.array([*self._emergency_ids, *self._heartbeat_ids], dtype=np.uint32)
        self._nmt: dict[str, int] = {}
        self._states: IntArray | None = None

    def in_frames(self, frames: Frames) -> list[DriveEvent]:
        """Emergencies, boot-ups, changes of NMT state, and what the controller says of the bus."""
        matter = frames.is_error | (np.isin(frames.can_id, self._ids) & ~frames.is_rtr & ~frames.is_extended)
        found = (self._in_frame(frames, int(row)) for row in np.flatnonzero(matter))
        return [event for event in found if event is not None]

    def _in_frame(self, frames: Frames, row: int) -> DriveEvent | None:
        cob_id, stamp = int(frames.can_id[row]), int(frames.stamp[row])
        data = frames.data[row, : frames.dlc[row]].tobytes()
        if frames.is_error[row]:
            report = error_report(cob_id | ERROR_FLAG, data)
            if report is None:
                return None
            return DriveEvent(stamp, FATAL if report.fatal else WARN, BUS, BUS, cob_id, report.text)
        if (joint := self._emergency_ids.get(cob_id)) is not None:
            message = EmergencyMessage.decode(data)
            if message is None:
                return DriveEvent(stamp, WARN, joint, EMERGENCY, 0, "EMCY that is too short to hold a code")
            level = INFO if message.is_reset else ERROR
            return DriveEvent(stamp, level, joint, EMERGENCY, message.code, str(message))
        return self._heartbeat(stamp, self._heartbeat_ids[cob_id], data)

    def _heartbeat(self, stamp: int, joint: str, data: bytes) -> DriveEvent | None:
        state = data[0] & 0x7F if data else -1
        if state < 0 or (self._nmt.get(joint) == state and state != _BOOTED):
            return None
        self._nmt[joint] = state
        words = _NMT_STATES.get(state, f"is in NMT state {state}, which the standard does not have")
        level = WARN if state in (_BOOTED, _STOPPED) else INFO
        return DriveEvent(stamp, level, joint, NMT, state, words)

    def in_samples(self, samples: Samples, stamps: IntArray) -> list[DriveEvent]:
        """Changes of the power state (6041h); the first sample tells the state of each drive.

        Args:
            samples: rows of one stream.
            stamps: (N,) their times, ns since the epoch.
        """
        if not len(samples):
            return []
        states = _STATE_INDEX[samples.statusword & 0x7F]
        if self._states is not None and (states == self._states).all():
            return []
        before = np.full(len(self._joints), -1) if self._states is None else self._states
        self._states = states[-1].copy()
        changed = np.diff(np.vstack([before, states]), axis=0) != 0
        return list(self._changes(samples, stamps, states, changed))

    def _changes(
        self,
        samples: Samples,
        stamps: IntArray,
        states: IntArray,
        changed: BoolArray,
    ) -> Iterator[DriveEvent]:
        for row, axis in np.argwhere(changed):
            state = _STATES[states[row, axis]]
            yield DriveEvent(
                stamp=int(stamps[row]),
                level=_STATE_LEVELS.get(state, INFO),
                joint=self._joints[axis],
                kind=STATE,
                code=int(samples.statusword[row, axis]),
                text=f"{state.value} (cycle {samples.cycle[row]})",
            )


def first_fault(events: Sequence[DriveEvent]) -> DriveEvent | None:
    """The first event that a run ends with."""
    return next((event for event in events if event.is_fault), None)
