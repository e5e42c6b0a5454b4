"""What one capture or log holds, ready to identify from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ident import Recording
from robots import Identification

if TYPE_CHECKING:
    from daq.recording.capture import Capture


@dataclass(frozen=True)
class LoadedRecordings:
    """What one path holds, ready to identify from.

    Attributes:
        path: the capture, log or folder.
        recordings: the uninterrupted pieces.
        settings: how rows are made of them: the robot's, or what the column map puts in their place.
        capture: what was recorded with the samples; None for a log of somebody else.
        warnings: what is missing or was left out, one sentence each, for the user to read.
    """

    path: Path
    recordings: tuple[Recording, ...]
    settings: Identification
    capture: Capture | None
    warnings: tuple[str, ...] = ()
