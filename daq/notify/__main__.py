"""The process that sends one message: gets it on stdin, ends with 0 where everybody was reached."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from daq.notify.notify import Message
from daq.notify.sending import log_file, send_all
from daq.notify.settings import read_notify
from daq.notify.told import note_told


def main() -> int:
    """Send what stdin says."""
    order = json.load(sys.stdin)
    file = Path(order["settings"])
    settings = read_notify(file)
    if not send_all(settings, Message(**order["message"]), log_file(settings, file)):
        return 1
    if order["check"] is not None:
        note_told(int(order["check"]), file)
    return 0


if __name__ == "__main__":
    sys.exit(main())
