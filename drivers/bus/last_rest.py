"""Where an arm of real drives last stood at rest, and what its drives had as home offset.

A drive that was off has not moved its joint. Where it says otherwise afterwards, or has another home offset
(607Ch), its zero has moved, or somebody has moved the arm: somebody has to look before it moves again.
"""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime

import numpy as np

from drivers.bus import state_folder
from drivers.bus.lockout import channel_name, keeps_notes
from drivers.errors import BusError
from drivers.frames.channel import Channel
from robots.arrays import FloatArray

log = logging.getLogger(__name__)

TOLERANCE = 0.02
"""rad or m that a joint may have settled since."""


@dataclass(frozen=True)
class Rest:
    """What was kept.

    Attributes:
        when: UTC.
        offsets: home offset of each drive, counts; None where it has none.
        position: joint positions, rad or m; None where a motion has begun and nobody knows where it ended.
    """

    when: str
    offsets: tuple[int | None, ...]
    position: tuple[float, ...] | None


class LastRest:
    """The record of one arm, known by its drives, or by its bus where those have no serial numbers.

    Args:
        channel: the bus.
        joints: names, for what is said.
        serials: of the drives; fewer than joints where some have none.
    """

    def __init__(self, channel: Channel, joints: Sequence[str], serials: Sequence[str]) -> None:
        self._joints = tuple(joints)
        self.active = keeps_notes(channel)
        """Whether anything is kept at all."""
        known = len(serials) == len(self._joints)
        key = hashlib.sha256(" ".join(serials).encode()).hexdigest()[:16] if known else channel_name(channel)
        self._name = f"rest-{key}.json"

    def keep(self, offsets: Sequence[int | None], position: FloatArray | None) -> None:
        """Keep where the arm stands; a position that is None is one that is not known."""
        if not self.active:
            return
        when = datetime.now(tz=UTC).strftime("%Y-%m-%d %H:%M:%S")
        rest = Rest(when, tuple(offsets), None if position is None else tuple(map(float, position)))
        try:
            with state_folder.writable() as folder:
                folder.write(self._name, json.dumps(asdict(rest)) + "\n")
        except (OSError, BusError) as error:
            log.error("where the arm stands cannot be kept: %s", error)

    def doubt(self, offsets: Sequence[int | None], position: FloatArray) -> str | None:
        """What cannot be, as the drives now say; None where nothing speaks against them."""
        for folder in state_folder.existing() if self.active else ():
            try:
                text = folder.read(self._name)
            except FileNotFoundError:
                continue
            except OSError as error:
                return f"{folder.path / self._name} cannot be read: {error.strerror or error}"
            if text.strip():
                return self._compared(text, offsets, position)
        return None

    def _compared(self, text: str, offsets: Sequence[int | None], position: FloatArray) -> str | None:
        rest = _rest(text)
        if rest is None or len(rest.offsets) != len(self._joints):
            return "the record of where it last stood is damaged"
        for joint, before, now in zip(self._joints, rest.offsets, offsets, strict=True):
            if before != now:
                return (
                    f"home offset (607C) of the drive of {joint} is {now}; it was {before} at {rest.when} UTC"
                )
        if rest.position is None:
            return None
        away = np.abs(position - np.array(rest.position))
        if (away > TOLERANCE).any():
            axis = int(np.argmax(away))
            return (
                f"joint {self._joints[axis]} reads {position[axis]:.6g}, and came to rest at"
                f" {rest.position[axis]:.6g} at {rest.when} UTC"
            )
        return None


def _rest(text: str) -> Rest | None:
    """None where the text is none of a record."""
    try:
        found = json.loads(text)
        position = found["position"]
        offsets = tuple(None if offset is None else int(offset) for offset in found["offsets"])
        where = None if position is None else tuple(map(float, position))
        if where is not None and (len(where) != len(offsets) or not np.isfinite(where).all()):
            return None
        return Rest(str(found["when"]), offsets, where)
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return None
