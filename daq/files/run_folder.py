"""The folder of one run: made and tried before anything moves, so that nothing is lost at the end."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from robots.errors import UserError


class OutputError(UserError):
    """Results cannot be written there; one line that names the folder and the reason."""


def make_run_folder(out: Path | None, name: str) -> Path:
    """Make the folder and try to write in it.

    Args:
        out: where; ``runs/<time>-<name>`` where None.
        name: of the run, for the default folder.

    Raises:
        OutputError: it cannot be made or written to, or holds a run already.
    """
    stamp = datetime.now(tz=UTC).strftime("%Y%m%d-%H%M%S")
    folder = out if out is not None else Path("runs") / f"{stamp}-{name}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".write-test"
        probe.write_bytes(b"")
        probe.unlink()
    except OSError as error:
        raise OutputError(f"{folder}: cannot be written: {error.strerror}; choose another --out") from error
    if (folder / "capture.mcap").exists():
        raise OutputError(
            f"{folder}: holds capture.mcap of an earlier run, never to be overwritten; choose another --out"
        )
    return folder
