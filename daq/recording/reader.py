"""Read a capture back: every intact sample of it, and exactly what is missing."""

from __future__ import annotations

import hashlib
import math
import mmap
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from daq.recording.capture import (
    CHECKSUM_KEY,
    DESCRIPTION,
    FAULT,
    OUTCOME,
    PROFILE,
    RECOVERY,
    RUN,
    TRAJECTORY,
    UNKNOWN,
    Capture,
    CaptureError,
    Damage,
    Facts,
    Gap,
    facts_checksum,
)
from daq.recording.cdr import CdrError
from daq.recording.events import DriveEvent
from daq.recording.frames import Frames
from daq.recording.joint_channels import channels_of
from daq.recording.mcap_file import MAGIC
from daq.recording.mcap_scan import Scan, chunks, scan
from daq.recording.sample_messages import samples_of
from daq.recording.temperatures import Temperature
from daq.recording.topics import EVENTS_TOPIC, FRAMES_TOPIC, NUMBERS, TEMPERATURE_TOPIC

ALLOWED = "allowed: an MCAP capture recorded by armhil"
_Message = TypeVar("_Message")


def read_capture(path: Path, *, allow_empty: bool = False) -> Capture:
    """Read a capture, skipping what is damaged and saying so in ``Capture.damage``.

    Args:
        path: the file.
        allow_empty: whether a capture without samples will do, such as one of a fault while nothing moved.

    Raises:
        CaptureError: not a capture, or nothing in it can be read.
    """
    with open_bytes(path) as data:
        found = scan(data, lambda channel: channel != NUMBERS[FRAMES_TOPIC])
        sha256 = hashlib.sha256(data).hexdigest()
    facts, damaged = checked_facts(found)
    if found.profile != PROFILE and not facts:
        raise CaptureError(f"{path}: is an MCAP file of profile {found.profile!r}; {ALLOWED}")
    if DESCRIPTION not in facts or RUN not in facts:
        lost = DESCRIPTION if DESCRIPTION not in facts else RUN
        raise CaptureError(f"{path}: its record {lost} is missing or damaged, so its samples have no meaning")
    try:
        capture = _capture(path, sha256, found, facts, damaged)
    except KeyError as error:
        raise CaptureError(f"{path}: its records lack the key {error}; {ALLOWED}") from error
    if not len(capture.samples.cycle) and not allow_empty:
        raise CaptureError(f"{path}: no sample in it can be read")
    return capture


def iterate_frames(path: Path) -> Iterator[Frames]:
    """The raw frames of a capture, batch by batch in the order of the file; damaged ones are left out.

    Raises:
        CaptureError: not an MCAP file.
    """
    number = NUMBERS[FRAMES_TOPIC]
    with open_bytes(path) as data:
        for found in chunks(data, Scan(), lambda channel: channel == number):
            for run in found.runs.pop(number, ()):
                if (frames := Frames.of_rows(run.rows)) is not None:
                    yield frames


def read_frames(path: Path) -> Frames:
    """All raw frames of a capture at once.

    Raises:
        CaptureError: not an MCAP file.
    """
    return Frames.concatenate(list(iterate_frames(path)))


def _capture(path: Path, sha256: str, found: Scan, facts: Mapping[str, Facts], damaged: set[str]) -> Capture:
    description, run = facts[DESCRIPTION], facts[RUN]
    joints = tuple(description["joints"].split("\n"))
    period = _number(path, RUN, "period", run["period"])
    reference = run.get("reference", "recorded") != "absent"
    samples, undecodable = samples_of(found, joints, period, reference=reference)
    kinds = run.get("beside", "").split(", ")
    beside, bad_beside = channels_of(found, joints, kinds, samples.cycle)
    for values in beside.values():
        samples = replace(samples, complete=samples.complete & np.isfinite(values).all(axis=1, keepdims=True))
    outcome = facts.get(OUTCOME)
    told = UNKNOWN if outcome is None else outcome["cycles"]
    cycles = None if told == UNKNOWN else int(_number(path, OUTCOME, "cycles", told))
    lost_records = [name for name in (TRAJECTORY, OUTCOME) if name not in facts and name in damaged]
    if outcome is None and found.ended and RECOVERY not in facts:
        lost_records.append(OUTCOME)
    events, bad_events = _decoded(found, EVENTS_TOPIC, DriveEvent.decode)
    temperatures, bad_temperatures = _decoded(found, TEMPERATURE_TOPIC, Temperature.decode)
    damage = Damage(
        gaps=_gaps(samples.cycle, cycles, from_start=FAULT not in facts),
        unreadable_bytes=found.unreadable_bytes + undecodable + bad_beside + bad_events + bad_temperatures,
        closed=found.ended or outcome is not None,
        lost_records=tuple(dict.fromkeys(lost_records)),
        lost_frames=_lost_frames(path, found, outcome),
        unknown_end=outcome is not None and cycles is None,
        beyond=0 if cycles is None else int(np.count_nonzero(samples.cycle >= cycles)),
    )
    return Capture(
        path=path,
        sha256=sha256,
        robot_name=description["name"],
        robot_text=description["robot.toml"],
        urdf_text=description["urdf"],
        joints=joints,
        period=period,
        samples=samples,
        run=run,
        trajectory=facts.get(TRAJECTORY, {}),
        outcome=outcome,
        damage=_with_earlier(path, damage, facts.get(RECOVERY)),
        events=tuple(sorted(events, key=lambda event: event.stamp)),
        temperatures=temperatures,
        frames=found.counts.get(NUMBERS[FRAMES_TOPIC], 0),
        records=facts,
        beside=beside,
    )


def _with_earlier(path: Path, damage: Damage, recovery: Facts | None) -> Damage:
    """The damage of a rebuilt capture is that of the file it was rebuilt from, and its own."""
    if recovery is None:
        return damage
    lost = tuple(name for name in recovery["lost_records"].split("\n") if name)
    unreadable = int(_number(path, RECOVERY, "unreadable_bytes", recovery["unreadable_bytes"]))
    return replace(
        damage,
        unreadable_bytes=damage.unreadable_bytes + unreadable,
        closed=damage.closed and recovery["closed"] == "true",
        lost_records=tuple(dict.fromkeys(lost + damage.lost_records)),
    )


def _lost_frames(path: Path, found: Scan, outcome: Facts | None) -> int:
    number = NUMBERS[FRAMES_TOPIC]
    there = found.counts.get(number, 0)
    if outcome is not None and "frames" in outcome:
        return max(0, int(_number(path, OUTCOME, "frames", outcome["frames"])) - there)
    return max(0, found.last.get(number, -1) + 1 - there)


def _decoded(
    found: Scan, topic: str, decode: Callable[[bytes], _Message]
) -> tuple[tuple[_Message, ...], int]:
    """The messages of a topic in the order of the file, and the bytes of those that cannot be decoded."""
    messages: list[_Message] = []
    undecodable = 0
    for run in found.runs.get(NUMBERS[topic], ()):
        for row in run.rows:
            try:
                messages.append(decode(row.tobytes()))
            except CdrError:
                undecodable += row.size
    return tuple(messages), undecodable


@contextmanager
def open_bytes(path: Path) -> Iterator[bytes]:
    """The bytes of an MCAP file, mapped and not read: captures may be larger than memory.

    Raises:
        CaptureError: not there, not readable, or no MCAP file.
    """
    try:
        with path.open("rb") as file:
            head = file.read(4096)
            if not head:
                raise CaptureError(f"{path}: is empty; {ALLOWED}")
            if not head.startswith(MAGIC):
                raise CaptureError(f"{path}: is {_what_it_is(head)}; {ALLOWED}")
            with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
                # A map has all that is used of bytes here: slices, len, find.
                yield cast("bytes", data)
    except IsADirectoryError:
        raise CaptureError(f"{path}: is a folder; {ALLOWED}") from None
    except FileNotFoundError:
        raise CaptureError(f"{path}: no such file; {ALLOWED}") from None
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read: {error.strerror}") from error


def _what_it_is(head: bytes) -> str:
    try:
        head.decode()
    except UnicodeDecodeError as error:
        # The cut at 4096 bytes may split one character; anything earlier is not text.
        if error.start < len(head) - 4:
            return "a binary file of another kind"
    return "a text file" if b"\x00" not in head else "a binary file of another kind"


def checked_facts(found: Scan) -> tuple[dict[str, Facts], set[str]]:
    """Metadata records that match their checksum, and the names of those that do not."""
    facts: dict[str, Facts] = {}
    damaged: set[str] = set()
    for record in found.metadata:
        if record.metadata.get(CHECKSUM_KEY) == facts_checksum(record.metadata):
            facts[record.name] = record.metadata
        else:
            damaged.add(record.name)
    return facts, damaged


def _number(path: Path, record: str, key: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value < 2**53:
        raise CaptureError(f"{path}: {record}: {key}: {text!r}; allowed: a number, at least 0")
    return value


def _gaps(cycles: NDArray[np.int64], streamed: int | None, *, from_start: bool) -> tuple[Gap, ...]:
    """Missing cycle numbers between 0 and the last one that was streamed (the last one read where None).

    What a fault triggered begins in the middle of a stream: nothing is missing before its first cycle.
    """
    last = int(cycles[-1]) + 1 if len(cycles) else 0
    following = last if streamed is None else streamed
    before_first = -1 if from_start or not len(cycles) else int(cycles[0]) - 1
    edges = np.concatenate(([before_first], cycles, [following]))
    before = np.flatnonzero(np.diff(edges) > 1)
    return tuple(Gap(int(edges[k]) + 1, int(edges[k + 1]) - 1) for k in before)
