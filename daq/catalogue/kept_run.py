"""A run that is in the catalogue from its first moment on, however it ends."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import ArmIdentity, CatalogueError, RunKind, RunOutcome
from daq.files.checksum import file_sha256
from drivers import StreamResult
from trajectories import Trajectory

log = logging.getLogger(__name__)


@dataclass
class KeptRun:
    """What is going to be said of a run when it ends; ``number`` is None where there is no catalogue."""

    number: int | None
    outcome: RunOutcome | Literal[""] = ""
    reason: str = ""
    capture: Path | None = None
    facts: dict[str, Any] = field(default_factory=dict)

    def streamed(self, result: StreamResult, capture: Path) -> None:
        """A stream has ended, and its recording is closed."""
        self.outcome, self.reason, self.capture = result.outcome, result.reason, capture
        self.facts |= {
            "cycles": result.cycles,
            "missed_cycles": result.missed_cycles,
            "late_cycles": result.late_cycles,
            "incomplete_cycles": result.incomplete_cycles,
            **({"doubtful": list(result.doubtful)} if result.doubtful else {}),
            "ending": result.ending,
        }


@contextmanager
def kept_run(
    catalogue: Catalogue | None,
    identity: ArmIdentity,
    kind: RunKind,
    *,
    stage: str = "",
    capture: Path | None = None,
    trajectory: str = "",
    facts: Mapping[str, Any] | None = None,
    note: str = "",
) -> Iterator[KeptRun]:
    """Keep a run from the beginning of the block to its end, by whatever way it is left.

    Args:
        catalogue: where; nothing is kept where None.
        identity, kind, stage, capture, trajectory, facts, note: as in :func:`daq.catalogue.runs.begin`.

    Raises:
        CatalogueError: it cannot be written.
    """
    if catalogue is None:
        yield KeptRun(None)
        return
    begun = runs.begin(
        catalogue,
        identity,
        kind,
        stage=stage,
        capture=None if capture is None else str(capture.absolute()),
        trajectory=trajectory,
        facts=facts,
        note=note,
    )
    kept = KeptRun(begun.id)
    try:
        yield kept
    except BaseException as error:
        if not kept.outcome:
            kept.outcome = "stopped" if isinstance(error, KeyboardInterrupt) else "failed"
            kept.reason = " ".join(str(error).split()) or type(error).__name__
        try:
            _finish(catalogue, begun.id, kept)
        except CatalogueError as unkept:
            log.warning("%s", unkept)  # what went wrong first is what has to be told
        raise
    _finish(catalogue, begun.id, kept)


def _finish(catalogue: Catalogue, number: int, kept: KeptRun) -> None:
    capture = kept.capture
    runs.finish(
        catalogue,
        number,
        kept.outcome or "completed",
        reason=kept.reason,
        capture=None if capture is None else str(capture.absolute()),
        capture_sha256=None if capture is None else file_sha256(capture),
        facts=kept.facts,
    )


def trajectory_words(trajectory: Trajectory) -> str:
    """What was driven, in a few words."""
    slow = "" if trajectory.speed == 1.0 else f", at {100 * trajectory.speed:g} % speed"
    return f"{trajectory.family}, seed {trajectory.seed}, {trajectory.duration:.1f} s{slow}"
