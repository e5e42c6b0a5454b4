"""Rebuild a readable capture from a damaged one, and say exactly what is missing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from mcap.records import Metadata

from daq.files.checksum import file_sha256
from daq.recording.capture import (
    CHECKSUM_KEY,
    DESCRIPTION,
    OUTCOME,
    PROFILE,
    RECOVERY,
    RUN,
    TRAJECTORY,
    Capture,
    CaptureError,
    Facts,
    Gap,
    facts_checksum,
)
from daq.recording.mcap_file import McapFile
from daq.recording.mcap_scan import Scan, chunks
from daq.recording.reader import ALLOWED, open_bytes, read_capture
from daq.recording.topics import CHANNELS, TOPICS
from robots import Robot
from robots.arrays import BoolArray, IntArray

SUFFIX = ".recovered.mcap"


@dataclass(frozen=True)
class Recovery:
    """What came out.

    Attributes:
        source: the damaged file.
        capture: the rebuilt one.
        unanswered: cycles by joint that are there but that its drive did not answer in time.
    """

    source: Path
    capture: Capture
    unanswered: dict[str, tuple[Gap, ...]]

    @property
    def whole(self) -> bool:
        """Whether nothing was missing in the first place."""
        return not self.capture.damage and not self.unanswered


def recover(source: Path, out: Path, robot: Robot | None = None) -> Recovery:
    """Copy every record that is proven intact into a new capture.

    Args:
        source: killed, cut off, or with wrong bits in it.
        out: the new file.
        robot: the arm, for a file whose description is lost; a description that is there wins.

    Raises:
        CaptureError: not a capture, nothing to recover, or ``out`` exists or cannot be written.
    """
    try:
        with out.open("x+b") as file:
            try:
                _copy(source, file, robot)
                capture = read_capture(out, allow_empty=True)
            except BaseException:
                out.unlink()
                raise
    except FileExistsError:
        raise CaptureError(f"{out}: exists already; a capture is never changed or overwritten") from None
    except OSError as error:
        raise CaptureError(f"{out}: cannot be written: {error.strerror}") from error
    out.chmod(0o444)
    return Recovery(source, capture, unanswered_cycles(capture))


def _copy(source: Path, file: BinaryIO, robot: Robot | None) -> None:
    writer = McapFile(file, PROFILE, "armhil", TOPICS)
    result = Scan()
    facts: dict[str, Facts] = {}
    damaged: set[str] = set()
    with open_bytes(source) as data:
        for found in chunks(data, result, CHANNELS.__contains__):
            for record in found.metadata:
                _take_record(record, facts, damaged, writer)
            found.metadata.clear()
            for runs in found.runs.values():
                for run in runs:
                    writer.add(run.channel, run.sequence, run.log_time, run.rows)
            if found.runs:
                found.runs.clear()
                writer.flush()
    if result.profile != PROFILE and not facts:
        raise CaptureError(f"{source}: is an MCAP file of profile {result.profile!r}; {ALLOWED}")
    for name, supplied in _described(source, facts, robot).items():
        _write_record(writer, name, supplied)
    _write_record(writer, RECOVERY, _recovery_facts(source, result, facts, damaged))
    writer.finish()


def _take_record(record: Metadata, facts: dict[str, Facts], damaged: set[str], writer: McapFile) -> None:
    """Copy an intact record the first time it comes."""
    if record.metadata.get(CHECKSUM_KEY) != facts_checksum(record.metadata):
        damaged.add(record.name)
    elif record.name not in facts:
        facts[record.name] = record.metadata
        if record.name != RECOVERY:  # a new one comes at the end
            _write_record(writer, record.name, record.metadata)


def _write_record(writer: McapFile, name: str, record: Facts) -> None:
    for _ in range(2):
        writer.add_metadata(name, {**record, CHECKSUM_KEY: facts_checksum(record)})


def _described(source: Path, facts: dict[str, Facts], robot: Robot | None) -> dict[str, Facts]:
    """The records without which samples have no meaning, where they are lost and the arm is known."""
    lost = [name for name in (DESCRIPTION, RUN) if name not in facts]
    if not lost:
        return {}
    if robot is None:
        raise CaptureError(
            f"{source}: its record {lost[0]} is missing or damaged, so its samples have no meaning;"
            " allowed: --robot names the arm that it was recorded of"
        )
    supplied: dict[str, Facts] = {
        DESCRIPTION: {
            "name": robot.name,
            "robot.toml": robot.source_text,
            "urdf": robot.urdf_path.read_text(encoding="utf-8"),
            "joints": "\n".join(joint.name for joint in robot.joint),
        },
        RUN: {"period": repr(robot.bus.cycle_time)},
    }
    return {name: supplied[name] for name in lost}


def _recovery_facts(source: Path, found: Scan, facts: dict[str, Facts], damaged: set[str]) -> Facts:
    earlier = facts.get(RECOVERY, {})
    lost = [name for name in (DESCRIPTION, RUN, TRAJECTORY, OUTCOME) if name not in facts and name in damaged]
    lost += [name for name in (DESCRIPTION, RUN) if name not in facts]
    if OUTCOME not in facts and found.ended and not earlier:
        lost.append(OUTCOME)
    lost += earlier.get("lost_records", "").split("\n")
    closed = (found.ended or OUTCOME in facts) and earlier.get("closed", "true") == "true"
    unreadable = found.unreadable_bytes + int(earlier.get("unreadable_bytes", "0"))
    return {
        "source": source.name,
        "source_sha256": file_sha256(source),
        "closed": str(closed).lower(),
        "unreadable_bytes": str(unreadable),
        "lost_records": "\n".join(dict.fromkeys(filter(None, lost))),
    }


def unanswered_cycles(capture: Capture) -> dict[str, tuple[Gap, ...]]:
    """Cycles that are recorded but that a joint's drive did not answer in time, by joint."""
    cycles, complete = capture.samples.cycle, capture.samples.complete
    found = {joint: _ranges(cycles, ~complete[:, axis]) for axis, joint in enumerate(capture.joints)}
    return {joint: ranges for joint, ranges in found.items() if ranges}


def _ranges(cycles: IntArray, chosen: BoolArray) -> tuple[Gap, ...]:
    """Runs of consecutive cycle numbers among the chosen ones."""
    numbers = cycles[chosen]
    if not len(numbers):
        return ()
    pieces = np.split(numbers, np.flatnonzero(np.diff(numbers) != 1) + 1)
    return tuple(Gap(int(piece[0]), int(piece[-1])) for piece in pieces)


def recovery_json(recovery: Recovery) -> dict[str, Any]:
    """As ``armhil recover --json`` prints it."""
    capture, damage = recovery.capture, recovery.capture.damage

    def spans(gaps: tuple[Gap, ...]) -> list[dict[str, Any]]:
        return [
            {
                "first": gap.first,
                "last": gap.last,
                "cycles": gap.cycles,
                "seconds": gap.cycles * capture.period,
            }
            for gap in gaps
        ]

    missing = sum(gap.cycles for gap in damage.gaps)
    return {
        "file": str(recovery.source),
        "out": str(capture.path),
        "whole": recovery.whole,
        "cycles": len(capture.samples),
        "seconds": len(capture.samples) * capture.period,
        "missing_cycles": missing,
        "missing_seconds": missing * capture.period,
        "gaps": spans(damage.gaps),
        "unanswered": [
            {"joint": joint, "cycles": sum(gap.cycles for gap in gaps), "gaps": spans(gaps)}
            for joint, gaps in recovery.unanswered.items()
        ],
        "frames": capture.frames,
        "missing_frames": damage.lost_frames,
        "unreadable_bytes": damage.unreadable_bytes,
        "closed": damage.closed,
        "unknown_end": damage.unknown_end,
        "beyond_outcome": damage.beyond,
        "lost_records": list(damage.lost_records),
    }


def recovery_text(recovery: Recovery) -> list[str]:
    """What a person reads, line by line."""
    capture = recovery.capture
    period, total = capture.period, len(capture.samples)
    lines = [
        f"{capture.path}: {total} cycles ({total * period:.3f} s) of {len(capture.joints)} joints,"
        f" {capture.frames} raw frames, {len(capture.events)} events"
    ]
    lines += [f"missing: {sentence}" for sentence in capture.damage.sentences(period)]
    for joint, gaps in recovery.unanswered.items():
        cycles = sum(gap.cycles for gap in gaps)
        places = ", ".join(f"{gap.first} to {gap.last}" for gap in gaps[:5])
        more = f" and {len(gaps) - 5} more places" if len(gaps) > 5 else ""
        lines.append(
            f"missing: {joint} did not answer {cycles} cycles ({cycles * period:.3f} s): {places}{more}"
        )
    if recovery.whole:
        lines.append("nothing is missing")
    return lines
