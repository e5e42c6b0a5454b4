"""What outlives the process: a stream on real drives that nobody knows to have ended well.

The note is written before the drives get torque, and taken away after an end that somebody asked for. So it
is there as well where nobody was left to write it: all processes killed, the machine without power. A timer
that starts the next motion is not somebody who has looked: only an acknowledgement takes it away otherwise.
The first cause stays; what comes of it later does not replace it.
"""

from __future__ import annotations

import json
import logging
import os
import re
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime

from drivers.bus import state_folder
from drivers.bus.state_folder import StateFolder
from drivers.errors import BusError, DriveError
from drivers.frames.channel import Channel

log = logging.getLogger(__name__)

_PREFIX, _SUFFIX = "lockout-", ".json"


def keeps_notes(channel: Channel) -> bool:
    """Whether a bus has notes at all: those that only simulated drives can be on have none."""
    return not channel.only_simulated


def channel_name(channel: Channel) -> str:
    """A channel as part of a file name."""
    return re.sub(r"[^A-Za-z0-9.]+", "-", str(channel))


@dataclass(frozen=True)
class Note:
    """What stands.

    Attributes:
        channel: bus on which it was.
        arm: name of the description.
        serials: of the drives, as far as they have any: vendor, product and serial number.
        begun: when the stream began, UTC.
        process: that drove the arm.
        reason: why the stream ended; None as long as nobody has said so.
    """

    channel: str
    arm: str
    serials: tuple[str, ...]
    begun: str
    process: int
    reason: str | None = None

    def words(self) -> str:
        """Why nothing may move."""
        if self.reason is not None:
            return self.reason
        return (
            f"the stream that process {self.process} began at {self.begun} UTC was cut off:"
            " nobody knows how it ended"
        )


class Lockout:
    """The notes that concern one arm: those of its bus, and those of its drives on whatever bus they were.

    Args:
        channel: which bus.
        arm: name of the description.
        serials: of the drives, as in a note.
    """

    def __init__(self, channel: Channel, arm: str = "", serials: tuple[str, ...] = ()) -> None:
        self._channel, self._arm, self._serials = channel, arm, serials
        self._active = keeps_notes(channel)
        self._name = f"{_PREFIX}{channel_name(channel)}{_SUFFIX}"

    def of_drives(self, arm: str, serials: tuple[str, ...]) -> Lockout:
        """The same with the drives known."""
        return Lockout(self._channel, arm, serials)

    @property
    def reason(self) -> str | None:
        """Why nothing may move: the oldest cause that stands; None where nothing does."""
        return next((words for _, words in self._standing()), None)

    def begin(self) -> None:
        """A stream is about to begin: from now on nothing else may, until this is lifted.

        Raises:
            DriveError: it cannot be written, so nothing must move.
        """
        if not self._active:
            return
        begun = datetime.now(tz=UTC).strftime("%Y-%m-%d %H:%M:%S")
        note = Note(str(self._channel), self._arm, self._serials, begun, os.getpid())
        try:
            with state_folder.writable() as folder:
                folder.write(self._name, _text(note))
        except (OSError, BusError) as error:
            raise DriveError(f"nothing moves, because no note of it can be kept: {error}") from error

    def keep(self, reason: str) -> None:
        """A stream has ended by itself. Where a cause is noted already, that one stays."""
        if not self._active:
            return
        try:
            with state_folder.writable() as folder:
                found = self._own(folder)
                if found is None:
                    begun = datetime.now(tz=UTC).strftime("%Y-%m-%d %H:%M:%S")
                    found = Note(str(self._channel), self._arm, self._serials, begun, os.getpid())
                if found.reason is None:
                    folder.write(self._name, _text(replace(found, reason=reason)))
        except (OSError, BusError) as error:
            log.error("the lock-out of %s cannot be noted: %s", self._channel, error)

    def lift(self) -> None:
        """It was acknowledged, or the stream has ended as somebody wished.

        Raises:
            DriveError: a note is another user's and cannot be taken away.
        """
        if not self._active:
            return
        for folder in state_folder.existing():
            for name in self._names(folder):
                try:
                    folder.remove(name)
                except OSError as error:
                    raise DriveError(
                        f"{folder.path / name}: the lock-out cannot be lifted: {error.strerror or error};"
                        " its owner or root has to acknowledge it"
                    ) from error

    def _standing(self) -> list[tuple[str, str]]:
        """When each stream began that matters here, and why it stands in the way."""
        found = []
        for folder in state_folder.existing() if self._active else ():
            for name in self._names(folder):
                try:
                    note = _note(folder.read(name))
                except OSError as error:
                    found.append(("", f"{folder.path / name} cannot be read: {error.strerror or error}"))
                    continue
                if note is not None:
                    found.append((note.begun, note.words()))
        return sorted(found)

    def _names(self, folder: StateFolder) -> list[str]:
        """Notes that concern this arm."""
        names = [n for n in folder.names() if n.startswith(_PREFIX) and n.endswith(_SUFFIX)]
        return [name for name in names if name == self._name or self._same_drives(folder, name)]

    def _same_drives(self, folder: StateFolder, name: str) -> bool:
        try:
            note = _note(folder.read(name))
        except OSError:
            return False  # another bus's
        return note is not None and not set(note.serials).isdisjoint(self._serials)

    def _own(self, folder: StateFolder) -> Note | None:
        try:
            return _note(folder.read(self._name))
        except FileNotFoundError:
            return None


def _text(note: Note) -> str:
    return json.dumps(asdict(note), indent=1) + "\n"


def _note(text: str) -> Note | None:
    """None where the text is empty; a text that is no note is one of which nothing is known."""
    if not text.strip():
        return None
    try:
        found = json.loads(text)
        reason = found["reason"]
        return Note(
            channel=str(found["channel"]),
            arm=str(found["arm"]),
            serials=tuple(map(str, found["serials"])),
            begun=str(found["begun"]),
            process=int(found["process"]),
            reason=None if reason is None else str(reason),
        )
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return Note("", "", (), "", 0, "the note of the last motion is damaged")
