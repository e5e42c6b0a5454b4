"""What outlives the process: a stream on real drives ended by itself, and nobody has acknowledged it yet.

A timer that starts the next motion is not somebody who has looked. So the reason is kept in a file beside the
lock of the bus, for every later process of this machine until it restarts, and only an acknowledgement takes
it away.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import tempfile
from pathlib import Path

from drivers.bus.channel import Channel

log = logging.getLogger(__name__)


class Lockout:
    """The note of one bus; buses that only simulated drives can be on have none.

    Args:
        channel: which bus.
    """

    def __init__(self, channel: Channel) -> None:
        name = re.sub(r"[^A-Za-z0-9.]+", "-", f"armhil-lockout-{channel}")
        self.path = None if channel.only_simulated else Path(tempfile.gettempdir()) / f"{name}.txt"

    @property
    def reason(self) -> str | None:
        """Why nothing may move; None where it may."""
        if self.path is None:
            return None
        try:
            return self.path.read_text(encoding="utf-8").strip() or None
        except FileNotFoundError:
            return None
        except OSError as error:
            return f"{self.path} cannot be read: {error.strerror}"

    def keep(self, reason: str) -> None:
        """Note why; where the file cannot be written, the log says so."""
        if self.path is None:
            return
        try:
            descriptor = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
            with os.fdopen(descriptor, "w", encoding="utf-8") as file:
                file.write(reason + "\n")
        except OSError as error:
            log.error("%s cannot be written: %s", self.path, error.strerror)

    def lift(self) -> None:
        """It was acknowledged.

        Raises:
            OSError: the note is another user's.
        """
        if self.path is None or not self.path.exists():
            return
        # An empty note is none: in a shared folder only its owner may remove the file.
        self.path.write_text("", encoding="utf-8")
        with contextlib.suppress(PermissionError):
            self.path.unlink()
