"""The raw frames of a capture for CAN tools: BLF and ASC, as python-can writes them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import can

from daq.recording.frames import Frames
from daq.recording.reader import iterate_frames

WRITERS = {"blf": can.BLFWriter, "asc": can.ASCWriter}


def write_frames(capture: Path, out: Path, kind: str) -> int:
    """Write all raw frames, in the order of their arrival.

    Args:
        capture: the file.
        out: the new file, which is there and empty.
        kind: ``blf`` or ``asc``.

    Returns:
        How many.

    Raises:
        OSError: ``out`` cannot be written.
    """
    count = 0
    with WRITERS[kind](str(out)) as writer:
        for frames in iterate_frames(capture):
            for message in messages(frames):
                writer.on_message_received(message)
            count += len(frames)
    return count


def messages(frames: Frames) -> Iterator[can.Message]:
    """Frames as python-can's messages."""
    for row in range(len(frames)):
        dlc = int(frames.dlc[row])
        is_remote = bool(frames.is_rtr[row])
        yield can.Message(
            timestamp=int(frames.stamp[row]) / 1e9,
            arbitration_id=int(frames.can_id[row]),
            is_extended_id=bool(frames.is_extended[row]),
            is_remote_frame=is_remote,
            is_error_frame=bool(frames.is_error[row]),
            is_rx=True,
            channel=0,
            dlc=dlc,
            data=None if is_remote else frames.data[row, :dlc].tobytes(),
        )
