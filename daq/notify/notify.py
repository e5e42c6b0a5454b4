"""Tell somebody that the verdict on an arm has changed: webhook, mail, apprise; never in the check's way."""

from __future__ import annotations

import json
import logging
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from daq.catalogue import checks, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import CatalogueError
from daq.notify.settings import NotifyError, notify_path, read_notify
from daq.notify.told import settle_told

if TYPE_CHECKING:  # the sender is a process of its own, and takes none of the numerics along
    from daq.check.request import CheckResult

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Message:
    """What is told."""

    arm: str
    verdict: str
    previous: str
    sentence: str
    link: str

    @property
    def subject(self) -> str:
        """One line."""
        before = f" (was {self.previous})" if self.previous else ""
        return f"armhil: {self.arm} is {self.verdict}{before}"

    @property
    def text(self) -> str:
        """The sentence and where to read on."""
        return f"{self.sentence}\n\n{self.link}\n"

    def as_dict(self) -> dict[str, str]:
        """What a webhook gets."""
        return {
            "arm": self.arm,
            "verdict": self.verdict,
            "previous": self.previous,
            "sentence": self.sentence,
            "link": self.link,
        }


def message_of(result: CheckResult, base_url: str, told: str) -> Message | None:
    """What is to be told of a check; None where its verdict is the one that was told last.

    Args:
        result: of the check.
        base_url: of the service, for the link; the report's path where empty.
        told: the verdict that was told last; empty where none was.
    """
    if result.verdict.value == told or (not told and result.verdict.value == "ok"):
        return None
    link = f"{base_url.rstrip('/')}/runs/{result.run}" if base_url else str(result.report)
    return Message(result.arm, result.verdict.value, told, result.sentence, link)


def notify_of(
    result: CheckResult, catalogue: Catalogue, path: Path | None = None
) -> subprocess.Popen[bytes] | None:
    """Tell of a new verdict; a process of its own does it and tries again, so that the check never waits.

    A verdict is new where it is not the one that was told last: what nobody was told of, since a check was
    killed or nobody could be reached, is told by the next one.

    Args:
        result: of the check.
        catalogue: says what was told; the sender notes there that it has told.
        path: notify.toml; the user's where None, and nobody is told where there is none.

    Returns:
        the sender, or None where there is nothing to tell or nobody to tell it to.

    Raises:
        NotifyError: the file that was given cannot be read.
    """
    file = path or notify_path()
    if path is None and not file.exists():
        return None
    try:
        settings = read_notify(file)
    except NotifyError as error:
        if path is not None:
            raise
        log.error("%s", error)  # the verdict stands, whatever the file says
        return None
    try:
        settle_told(catalogue, file)
        told = checks.last_told(catalogue, runs.get(catalogue, result.run).arm_id)
    except CatalogueError as error:
        log.error("%s; who is to be told hears of it from the next check", error)
        return None
    message = message_of(result, settings.base_url, told)
    if message is None:
        return None
    return start_sender(file, message, result.check)


def start_sender(file: Path, message: Message, check: int | None = None) -> subprocess.Popen[bytes]:
    """A process of its own session that tells one message; its log is beside the settings.

    Args:
        file: notify.toml.
        message: to be told.
        check: number of the check that is marked as told in the catalogue; none where None.
    """
    order = json.dumps({"settings": str(file.absolute()), "message": message.as_dict(), "check": check})
    process = subprocess.Popen(
        [sys.executable, "-m", "daq.notify"],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        env=dict(os.environ),
    )
    assert process.stdin is not None
    process.stdin.write(order.encode())
    process.stdin.close()
    return process
