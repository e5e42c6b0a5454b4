"""Delete old recordings; never one that a baseline rests on, never one that armhil did not record."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from daq.catalogue import baselines, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import Run
from daq.files.checksum import file_sha256
from daq.recording.who import is_gone
from daq.session.spool import spool_path


@dataclass(frozen=True)
class Prunable:
    """A recording that may go."""

    run: Run
    path: Path
    size: int
    """Bytes."""


@dataclass(frozen=True)
class Kept:
    """A recording that stays, and why."""

    run: Run
    reason: str


@dataclass(frozen=True)
class PrunePlan:
    """What would be deleted, and what would not."""

    prunable: tuple[Prunable, ...]
    kept: tuple[Kept, ...]


def plan_prune(catalogue: Catalogue, before: datetime, arm: str | None = None) -> PrunePlan:
    """Look which recordings of runs that were started before a time may go.

    Args:
        catalogue: where.
        before: of the start of the runs.
        arm: label; all arms where None.
    """
    prunable, kept = [], []
    guarded = baselines.guarded_captures(catalogue)
    for run in runs.every(catalogue, arm=arm, before=before):
        if run.capture is None:
            continue
        reason = _reason_to_keep(run, Path(run.capture), guarded)
        if reason:
            kept.append(Kept(run, reason))
        else:
            prunable.append(Prunable(run, Path(run.capture), Path(run.capture).stat().st_size))
    return PrunePlan(tuple(prunable), tuple(kept))


def prune(catalogue: Catalogue, planned: PrunePlan) -> PrunePlan:
    """Delete what was planned; each recording is looked at again just before it goes.

    Whoever accepts a baseline meanwhile waits until the recording is gone or kept. What is known of a run
    stays in the catalogue: its models, findings and verdicts, and the checksum of the recording.

    Returns:
        What was deleted, and what of the plan was kept after all.
    """
    deleted, kept = [], []
    for entry in planned.prunable:
        with catalogue.writing() as connection:
            baselines.lock_arm(connection, entry.run.arm_id)
            guarded = baselines.guarded_captures_in(connection)
            run = runs.get_in(connection, entry.run.id, change=True)
            reason = _reason_to_keep(run, entry.path, guarded)
            if not reason:
                try:
                    entry.path.unlink()
                    spool_path(entry.path).unlink(missing_ok=True)
                except OSError as error:
                    reason = f"{entry.path}: cannot be deleted: {error.strerror}"
            if not reason:
                runs.forget_capture_in(connection, run.id)
        if reason:
            kept.append(Kept(entry.run, reason))
        else:
            deleted.append(entry)
    return PrunePlan(tuple(deleted), tuple(kept))


def _reason_to_keep(run: Run, path: Path, guarded: frozenset[str]) -> str:
    """Why a recording has to stay; empty where it may go."""
    if run.kind == "import":
        return "it was imported, not recorded by armhil"
    if run.state == "running":
        return "the run goes on"
    if run.process and not is_gone(run.process):
        return "it waits for its verdict"
    if not path.is_file():
        return "it is gone already"
    sha256 = file_sha256(path)
    if sha256 in guarded:
        return "a baseline rests on it"
    if run.capture_sha256 is not None and sha256 != run.capture_sha256:
        return "another file is in its place"
    return ""
