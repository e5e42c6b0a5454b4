"""Diagnose again what a run recorded, with the settings of then: are the same effects found?"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from daq.catalogue import findings, models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import description_of
from daq.catalogue.values import CatalogueError, CatalogueFinding, Model, Run
from daq.diagnosis.diagnose import run_diagnose
from daq.diagnosis.diagnose_result import DiagnoseRequest, DiagnoseResult
from daq.files.found_model import found_of_json
from daq.files.model_file import SUFFIX, read_model
from daq.identification.carried import Carried
from daq.keeping.again import Sameness, furthest, refuse_unrecorded, sameness_of, unchanged
from daq.text.progress import Steps
from ident.discrepancy import Finding

DIAGNOSE = "diagnose"
"""``command`` among the settings of a model that a diagnosis ended with."""

BY_EVIDENCE = "evidence"
"""``search`` among these settings; ``rules``, or nothing, is that of a search that there is no more."""


@dataclass(frozen=True)
class DiagnosedAgain:
    """What came out; the attributes are those of :class:`daq.keeping.again.Rerun`.

    Attributes:
        request: of now, for whoever keeps it.
        found: what was found then.
    """

    run: Run
    earlier: Model
    found: tuple[CatalogueFinding, ...]
    request: DiagnoseRequest
    result: DiagnoseResult
    sameness: Sameness
    largest: float | None
    largest_name: str
    remarks: tuple[str, ...]


def diagnosis_of(catalogue: Catalogue, run_id: int) -> Model | None:
    """The model of the newest diagnosis of a run's recording; None where there was none."""
    made = [model for model in models.of_run(catalogue, run_id) if model.settings.get("command") == DIAGNOSE]
    return made[-1] if made else None


def diagnose_again(
    catalogue: Catalogue, run_id: int, steps: Steps, out: Path | None = None
) -> DiagnosedAgain:
    """Diagnose again; no motion is planned.

    Args:
        catalogue: where the run is.
        run_id: of the run.
        steps: shows progress.
        out: folder for page, result and model file; nothing stays where None.

    Raises:
        CatalogueError: there is no such run, its recording was never diagnosed, is gone, or is not the one
            of then.
        CaptureError, RobotFileError, ModelFileError, IdentificationError, OutputError: as in a diagnosis.
    """
    run = runs.get(catalogue, run_id)
    earlier = diagnosis_of(catalogue, run_id)
    if earlier is None:
        refuse_unrecorded(run)
        raise CatalogueError(
            f"run {run.id}: was never diagnosed with --out; `armhil diagnose {run.capture}` does it"
        )
    paths = tuple(unchanged(run, source) for source in earlier.sources)
    found = tuple(entry for entry in findings.of_run(catalogue, run_id) if entry.model_id == earlier.id)
    with ExitStack() as stack:
        folder = out if out is not None else Path(stack.enter_context(TemporaryDirectory()))
        request = _request_of(earlier.settings, paths, folder)
        result = run_diagnose(request, steps)
        model = read_model(folder / f"{result.robot.name}{SUFFIX}")
    then = [(p.name, p.value, p.sigma) for p in earlier.parameters]
    now = [(p.name, p.value, p.sigma) for p in model.parameter]
    remarks = _remarks(earlier, found, result)
    same_words = not [remark for remark in remarks if remark.startswith("found")]
    same_words = same_words and earlier.rows == model.estimate.rows
    largest, name = furthest(then, now)
    sameness = sameness_of(then, now, earlier.covariance, model.covariance, largest, same_words=same_words)
    if out is None:
        result = replace(result, folder=None)
    return DiagnosedAgain(run, earlier, found, request, result, sameness, largest, name, remarks)


def _request_of(settings: Mapping[str, Any], paths: tuple[Path, ...], out: Path) -> DiagnoseRequest:
    columns = settings.get("columns")
    return DiagnoseRequest(
        paths,
        tuple(Path(path) for path in settings.get("validation", [])),
        settings.get("robot"),
        None if columns is None else Path(columns),
        settings.get("split_half", False),
        tuple(settings.get("without", [])),
        settings.get("prior"),
        out,
        evaluations=0,
        found=found_of_json(settings.get("found")),
        carried=tuple(map(Carried.of_json, settings.get("carried", []))),
    )


def _remarks(earlier: Model, found: tuple[CatalogueFinding, ...], result: DiagnoseResult) -> tuple[str, ...]:
    remarks = []
    if earlier.armhil != version("armhil"):
        remarks.append(f"armhil was {earlier.armhil} then and is {version('armhil')} now")
    if description_of(result.robot).sha256 != earlier.description_sha256:
        remarks.append("the arm's description was changed since")
    if earlier.settings.get("search") != BY_EVIDENCE:
        remarks.append("names were given by rules then, and are given by evidence now")
    then = [(entry.effect, tuple(entry.joints)) for entry in found]
    now = [(entry.effect, tuple(entry.joints)) for entry in result.diagnosis.findings]
    if then != now:
        remarks.append(f"found then: {_names(found)}; now: {_names(result.diagnosis.findings)}")
    return tuple(remarks)


def _names(found: tuple[CatalogueFinding, ...] | tuple[Finding, ...]) -> str:
    if not found:
        return "nothing"
    return ", ".join(f"{entry.effect} (joint {'+'.join(map(str, entry.joints)) or '–'})" for entry in found)
