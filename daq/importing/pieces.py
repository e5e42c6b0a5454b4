"""The uninterrupted pieces of a recording: what no drive has answered is never data."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from daq.recording.errors import CaptureError
from ident import Recording
from ident.recording import JITTER_ALLOWED
from ident.signals import lendable
from robots.arrays import BoolArray, FloatArray
from robots.description import Identification

SHORTEST_PIECE = 2.0
"""s; a shorter piece between two gaps is hardly more than the ends that filtering costs."""
_LONGEST_PART = 250_000
"""Samples that are filtered together: an eighth of a gigabyte of six axes; the ends cost two thousandths."""
_NEAR = 0.75
"""Of a period: a time without a sample that near has none."""


def long_pieces(
    path: Path,
    lengths: Sequence[int],
    period: float,
    make: Callable[[int, str], Recording],
    remedy: str = "",
) -> tuple[tuple[Recording, ...], str]:
    """The pieces that are long enough, and a sentence on the others (empty where there are none).

    Args:
        path: of the recording.
        lengths: of all pieces in their order, samples.
        period: between samples, s.
        make: gets the number of a piece and its name.
        remedy: what to do where none is long enough, for the message.

    Raises:
        CaptureError: none is long enough.
    """
    seconds = [length * period for length in lengths]
    long = [number for number, length in enumerate(seconds) if length >= SHORTEST_PIECE]
    if not long:
        longest = f"{max(seconds):.3g} s long" if seconds else "0 s long: some drive never answered"
        raise CaptureError(
            f"{path}: its longest piece without a gap is {longest};"
            f" allowed: pieces of at least {SHORTEST_PIECE:g} s{remedy}"
        )
    names = [path.name] if len(long) == 1 else [f"{path.name}, piece {k}" for k in range(1, len(long) + 1)]
    recordings = tuple(make(number, name) for number, name in zip(long, names, strict=True))
    left_out = [length for length in seconds if length < SHORTEST_PIECE]
    if not left_out:
        return recordings, ""
    return recordings, (
        f"{path}: pieces between gaps shorter than {SHORTEST_PIECE:g} s were left out:"
        f" {len(left_out)} of {len(seconds)}, {sum(left_out):.3g} of {sum(seconds):.3g} s"
    )


def answered_pieces(
    path: Path, recording: Recording, complete: BoolArray, remedy: str = ""
) -> tuple[tuple[Recording, ...], str]:
    """A recording, cut where some drive has not answered; as :func:`long_pieces`.

    Args:
        path: of the recording.
        recording: N samples.
        complete: N × n, whether each drive has answered.
        remedy: what to do where no piece is long enough, for the message.
    """
    if complete.all():
        return (recording,), ""
    good = np.flatnonzero(complete.all(axis=1))
    cuts = np.flatnonzero(np.diff(good) != 1) + 1
    pieces = [slice(int(run[0]), int(run[-1]) + 1) for run in np.split(good, cuts) if run.size]

    def make(number: int, name: str) -> Recording:
        return recording.piece(pieces[number], name)

    lengths = [rows.stop - rows.start for rows in pieces]
    return long_pieces(path, lengths, recording.sample_time, make, remedy)


def in_parts(recording: Recording, settings: Identification) -> tuple[Recording, ...]:
    """A recording of hours in parts, which are filtered one after the other; a shorter one as it is.

    Each part goes on into its neighbours for as long as the filters remember, so that no row knows of a seam;
    and seams are a whole number of rows apart, so that the rows are those of the whole.

    Args:
        recording: of any length.
        settings: filters, decimation and trim of the rows.
    """
    samples, more = recording.time.size, lendable(settings, recording.sample_time)
    count = min(-(-samples // _LONGEST_PART), samples // (2 * more + 1))
    if count < 2:
        return (recording,)
    last, every = samples - settings.trim_samples[1], settings.decimation
    even = np.linspace(0, last, count + 1)[1:-1]
    ends = [0, *(last - every * np.round((last - even) / every).astype(int)).tolist(), samples]
    parts = []
    for number, (begin, end) in enumerate(pairwise(ends), start=1):
        first, behind = max(begin - more, 0), min(end + more, samples)
        name = f"{recording.name}, part {number}"
        parts.append(recording.piece(slice(first, behind), name, (begin - first, behind - end)))
    return tuple(parts)


def bridged(values: FloatArray, bad: BoolArray) -> FloatArray:
    """Rows that are no samples as straight lines between those around them, changed where they stand.

    They are cut out later; until then nothing that looks at a whole column is to see what stands in them.

    Args:
        values: N × channels.
        bad: (N,) rows that are no samples.
    """
    good, at = np.flatnonzero(~bad), np.flatnonzero(bad)
    if good.size and at.size:
        for column in values.T:
            column[at] = np.interp(at, good, column[good])
    return values


def set_aside(channels: Mapping[str, FloatArray], complete: BoolArray) -> dict[str, FloatArray]:
    """What stands in rows that some drive did not answer, by channel; the rows are bridged.

    Args:
        channels: N × any each, changed where they stand.
        complete: N × n, whether each drive has answered.
    """
    bad = np.asarray(~complete.all(axis=1))
    there = {name: values[bad].copy() for name, values in channels.items()}
    for values in channels.values():
        bridged(values, bad)
    return there


def put_back(recording: Recording, there: Mapping[str, FloatArray], complete: BoolArray) -> None:
    """The reverse of :func:`set_aside`: a capture of the log keeps what stands there, though not as data."""
    bad = np.asarray(~complete.all(axis=1))
    for name, rows in there.items():
        values = getattr(recording, name, None)
        if values is not None:
            values[bad] = rows


def complete_at(grid: FloatArray, time: FloatArray, complete: BoolArray) -> BoolArray:
    """Whether there is a sample at each time of a grid, and those on both sides of it are complete: M × n.

    Args:
        grid: (M,) s, evenly spaced.
        time: (N,) s, of the samples.
        complete: N × n.
    """
    after = np.clip(np.searchsorted(time, grid), 0, len(time) - 1)
    before = np.clip(np.searchsorted(time, grid, side="right") - 1, 0, len(time) - 1)
    since, until = np.abs(grid - time[before]), np.abs(time[after] - grid)
    period = (grid[-1] - grid[0]) / max(len(grid) - 1, 1)
    there = np.minimum(since, until) <= _NEAR * period
    # At a sample, to the rounding of the clock, that one says it; its neighbours have no part in it.
    before, after = (
        np.where(until <= JITTER_ALLOWED * period, after, before),
        np.where(since <= JITTER_ALLOWED * period, before, after),
    )
    return np.asarray(complete[before] & complete[after] & there[:, np.newaxis], dtype=np.bool_)
