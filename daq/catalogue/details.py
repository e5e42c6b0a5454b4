"""Everything that the catalogue knows of one run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from daq.catalogue import baselines, checks, findings, models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import Baseline, CatalogueFinding, CheckRecord, Model, Run
from daq.files.checksum import source_sha256

CaptureState = Literal["none", "intact", "changed", "gone"]


@dataclass(frozen=True)
class RunDetails:
    """A run with what was made of it; ``capture`` says whether its recording is the one of then."""

    run: Run
    models: tuple[Model, ...]
    findings: tuple[CatalogueFinding, ...]
    checks: tuple[CheckRecord, ...]
    baselines: tuple[Baseline, ...]
    capture: CaptureState


def details(catalogue: Catalogue, run_id: int) -> RunDetails:
    """Look a run up, and its recording.

    Raises:
        CatalogueError: there is no such run.
    """
    run = runs.get(catalogue, run_id)
    return RunDetails(
        run,
        models.of_run(catalogue, run_id),
        findings.of_run(catalogue, run_id),
        checks.of_run(catalogue, run_id),
        tuple(entry for entry in baselines.of_arm(catalogue, run.arm_id) if entry.run_id == run_id),
        _capture_state(run),
    )


def _capture_state(run: Run) -> CaptureState:
    if run.capture is None:
        return "none" if run.capture_sha256 is None else "gone"
    if not Path(run.capture).exists():
        return "gone"
    if run.capture_sha256 is None or source_sha256(Path(run.capture)) == run.capture_sha256:
        return "intact"
    return "changed"
