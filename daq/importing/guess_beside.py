"""Further channels of a log that are used: second encoders, temperatures, a flag per sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from daq.importing.channels import Channels
from daq.importing.guess_which import Sampled
from daq.importing.log_quantities import POSITION_UNITS
from daq.importing.pieces import bridged
from daq.importing.proof import is_same, slope_between
from ident.listing import listed
from robots import Robot
from robots.arrays import FloatArray

_SAME_SIZE = 0.1
"""Share by which a second encoder's motion may differ from the first one's: far more than a gear winds."""
_NOT_FOLLOWED = "named a reference; the measured one does not follow it (unit? other times?), not used"
_NOT_MEASURED = {"reference", "error", "computed", "external"}


def _is_flag(channel: Channels) -> bool:
    return channel.kind == "complete" and bool(
        np.isin(channel.values, (0.0, 1.0)).all() and channel.values.any()
    )


def without_flagged(channels: Sequence[Channels]) -> list[Channels]:
    """All channels, with nothing of their own in rows that a flag says to be no samples."""
    found = list(channels)
    for flag in filter(_is_flag, channels):
        bad = (flag.values == 0.0).any(axis=1)
        if bad.any():
            found = [
                replace(c, values=bridged(c.values, bad))
                if len(c.values) == len(bad) and not _is_flag(c)
                else c
                for c in found
            ]
    return found


def beside_of(
    others: Sequence[Channels], log: Sampled, robot: Robot, offset: FloatArray
) -> tuple[dict[str, Any], list[str], list[Channels]]:
    """Tables of the map for further channels, a sentence for each, and the channels that they are.

    Args:
        others: groups of columns beside positions and torques.
        log: the joints' positions.
        robot: the arm.
        offset: (n,) added to the positions, rad or m.
    """
    tables: dict[str, Any] = {}
    words, used = list[str](), list[Channels]()
    for channel in others:
        kind, table = _meaning(channel, log, robot, offset)
        if table is not None and kind not in tables:
            tables[kind] = table
            words.append(f"{kind.replace('_', ' ')}: {channel.label}")
            used.append(channel)
    return tables, words, used


def words_of_channels(
    velocity: Sequence[Channels], others: Sequence[Channels], reference: Channels | None
) -> list[str]:
    """A sentence for each kind of channel, used or not."""
    groups: dict[str, list[str]] = {}
    if velocity:
        labels = [c.label for c in velocity]
        groups["velocity, proven as the derivative of the position; not needed"] = labels
    if reference is not None:
        groups["reference, which the position follows"] = [reference.label]
    for c in others:
        if c is reference or c.kind in ("", "time"):
            continue
        second = c.kind == "position" and "second" in c.marks
        what = "second encoder" if second else " ".join([*sorted(c.marks & {"computed", "external"}), c.kind])
        odd = c.kind == "position" and "reference" in c.marks and reference is None
        groups.setdefault(f"{what}, {_NOT_FOLLOWED if odd else 'read and not used'}", []).append(c.label)
    return [f"{what}: {listed(labels)}" for what, labels in groups.items()]


def _meaning(
    channel: Channels, log: Sampled, robot: Robot, offset: FloatArray
) -> tuple[str, dict[str, Any] | None]:
    """The table of the map that a channel belongs into, and what it says; None where it is none of these."""
    file = {} if channel.file is None else {"file": channel.file}
    whole = len(channel.columns) > max(log.moving)
    names = [channel.columns[k] for k in log.moving] if whole else list(channel.columns)
    if not whole and len(names) != 1:
        return "", None
    if channel.kind == "complete":
        return "complete", {"columns": names, **file} if _is_flag(channel) else None
    if channel.kind == "temperature" and not channel.marks & _NOT_MEASURED:
        return "temperature", {"columns": names, **file} if np.isfinite(channel.values).all() else None
    if (
        channel.kind == "position"
        and "second" in channel.marks
        and whole
        and not channel.marks & _NOT_MEASURED
    ):
        unit = _unit(channel, log, robot)
        at = {"offset": offset.tolist()} if offset.any() else {}
        return "second_encoder", None if unit is None else {"columns": names, "unit": unit, **file, **at}
    return "", None


def _unit(channel: Channels, log: Sampled, robot: Robot) -> str | None:
    """In which the channel moves as the position does; None where in none."""
    slides = np.array([joint.kind == "prismatic" for joint in robot.joint])
    values = log.even(channel.values[:, log.moving])
    for unit, (turning, sliding) in POSITION_UNITS.items():
        fits = slides.any() if "m" in unit.replace("deg", "") else not slides.all()
        slope, correlation = slope_between(log.position, values * np.where(slides, sliding, turning))
        if fits and is_same(correlation) and abs(slope - 1.0) < _SAME_SIZE:
            return unit
    return None
