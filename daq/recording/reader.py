"""Read a capture back: every intact sample of it, and exactly what is missing."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from daq.recording import messages
from daq.recording.capture import (
    CHECKSUM_KEY,
    DESCRIPTION,
    OUTCOME,
    PROFILE,
    RUN,
    TRAJECTORY,
    Capture,
    CaptureError,
    Damage,
    Facts,
    Gap,
    facts_checksum,
)
from daq.recording.mcap_scan import MAGIC, Scan, scan
from daq.recording.recorder import CHANNELS, MEASURED_TOPIC, REFERENCE_TOPIC, STATUS_TOPIC
from drivers.cyclic.samples import Samples

ALLOWED = "allowed: an MCAP capture recorded by armhil"


def read_capture(path: Path) -> Capture:
    """Read a capture, skipping what is damaged and saying so in ``Capture.damage``.

    Raises:
        CaptureError: not a capture, or nothing in it can be read.
    """
    data = _read_bytes(path)
    found = scan(data)
    facts, damaged = _checked_facts(found)
    if found.profile != PROFILE and not facts:
        raise CaptureError(f"{path}: is an MCAP file of profile {found.profile!r}; {ALLOWED}")
    if DESCRIPTION not in facts or RUN not in facts:
        lost = DESCRIPTION if DESCRIPTION not in facts else RUN
        raise CaptureError(f"{path}: its record {lost} is missing or damaged, so its samples have no meaning")
    try:
        return _capture(path, hashlib.sha256(data).hexdigest(), found, facts, damaged)
    except KeyError as error:
        raise CaptureError(f"{path}: its records lack the key {error}; {ALLOWED}") from error


def _capture(path: Path, sha256: str, found: Scan, facts: Mapping[str, Facts], damaged: set[str]) -> Capture:
    description, run = facts[DESCRIPTION], facts[RUN]
    joints = tuple(description["joints"].split("\n"))
    period = _number(path, RUN, "period", run["period"])
    samples, undecodable = _samples(found, joints, period)
    if not len(samples.cycle):
        raise CaptureError(f"{path}: no sample in it can be read")
    outcome = facts.get(OUTCOME)
    cycles = None if outcome is None else int(_number(path, OUTCOME, "cycles", outcome["cycles"]))
    lost_records = [name for name in (TRAJECTORY, OUTCOME) if name not in facts and name in damaged]
    if outcome is None and found.ended:
        lost_records.append(OUTCOME)
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
        damage=Damage(
            gaps=_gaps(samples.cycle, cycles),
            unreadable_bytes=found.unreadable_bytes + undecodable,
            closed=found.ended or outcome is not None,
            lost_records=tuple(dict.fromkeys(lost_records)),
        ),
    )


def _read_bytes(path: Path) -> bytes:
    try:
        data = path.read_bytes()
    except IsADirectoryError:
        raise CaptureError(f"{path}: is a folder; {ALLOWED}") from None
    except FileNotFoundError:
        raise CaptureError(f"{path}: no such file; {ALLOWED}") from None
    except OSError as error:
        raise CaptureError(f"{path}: cannot be read: {error.strerror}") from error
    if not data:
        raise CaptureError(f"{path}: is empty; {ALLOWED}")
    if not data.startswith(MAGIC):
        raise CaptureError(f"{path}: is {_what_it_is(data)}; {ALLOWED}")
    return data


def _what_it_is(data: bytes) -> str:
    head = data[:4096]
    try:
        head.decode()
    except UnicodeDecodeError as error:
        # The cut at 4096 bytes may split one character; anything earlier is not text.
        if error.start < len(head) - 4:
            return "a binary file of another kind"
    return "a text file" if b"\x00" not in head else "a binary file of another kind"


def _checked_facts(found: Scan) -> tuple[dict[str, Facts], set[str]]:
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


def _gaps(cycles: NDArray[np.int64], streamed: int | None) -> tuple[Gap, ...]:
    """Missing cycle numbers between 0 and the last one that was streamed (the last one read where None)."""
    following = int(cycles[-1]) + 1 if streamed is None else streamed
    edges = np.concatenate(([-1], cycles, [following]))
    before = np.flatnonzero(np.diff(edges) > 1)
    return tuple(Gap(int(edges[k]) + 1, int(edges[k + 1]) - 1) for k in before)


def _samples(found: Scan, joints: tuple[str, ...], period: float) -> tuple[Samples, int]:
    """The cycles of which all three messages are there, and how many bytes could not be decoded."""
    layouts = {
        REFERENCE_TOPIC: messages.joint_state_layout(joints),
        MEASURED_TOPIC: messages.joint_state_layout(joints, effort=True),
        STATUS_TOPIC: messages.cycle_status_layout(joints),
    }
    decoded: dict[str, NDArray[np.void]] = {}
    sequences: dict[str, NDArray[np.int64]] = {}
    undecodable = 0
    for number, topic in CHANNELS.items():
        rows = found.messages.get(number, [])
        values = layouts[topic].decode([row.data for row in rows])
        if values is None:
            undecodable += sum(len(row.data) for row in rows)
            values, rows = layouts[topic].decode([]), []
        assert values is not None
        decoded[topic] = values
        sequences[topic] = np.array([row.sequence for row in rows], dtype=np.int64)
    return _aligned(decoded, sequences, period), undecodable


def _aligned(
    decoded: dict[str, NDArray[np.void]], sequences: dict[str, NDArray[np.int64]], period: float
) -> Samples:
    common = sequences[STATUS_TOPIC]
    for topic in (REFERENCE_TOPIC, MEASURED_TOPIC):
        common = np.intersect1d(common, sequences[topic])
    picked = {topic: decoded[topic][_rows_of(sequences[topic], common)] for topic in decoded}
    status = picked[STATUS_TOPIC]
    cycle = status["cycle"].astype(np.int64)
    return Samples(
        cycle=cycle,
        time=np.asarray(cycle * period, dtype=np.float64),
        reference=picked[REFERENCE_TOPIC]["position"].copy(),
        position=picked[MEASURED_TOPIC]["position"].copy(),
        control_signal=status["control_signal"].copy(),
        statusword=status["statusword"].copy(),
        complete=status["complete"].copy(),
        lateness=status["lateness"].copy(),
    )


def _rows_of(sequence: NDArray[np.int64], wanted: NDArray[np.int64]) -> NDArray[np.intp]:
    order = np.argsort(sequence, kind="stable")
    return order[np.searchsorted(sequence[order], wanted)]
