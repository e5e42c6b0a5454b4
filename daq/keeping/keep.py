"""Keep what an identification or a diagnosis found, beside the run whose recording it was made from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from daq.catalogue import findings, models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import description_of, identity_of_arm, identity_of_capture
from daq.catalogue.values import CatalogueFinding, CatalogueParameter, Model, NewFinding, NewModel, Source
from daq.diagnosis.diagnose_result import DiagnoseRequest, DiagnoseResult
from daq.files.checksum import source_sha256
from daq.files.found_model import entries_of, found_json
from daq.files.model_file import SUFFIX, ModelFile, read_model
from daq.identification.identification_json import identification_json
from daq.identification.identify import IdentifyRequest, IdentifyResult
from daq.keeping.again import IDENTIFY, Rerun, absolute, identify_settings
from daq.keeping.diagnosed_again import BY_EVIDENCE, DIAGNOSE
from daq.recording.capture import CAPTURE_SUFFIX
from daq.recording.reader import read_capture
from ident import Fitted
from ident.discrepancy import Diagnosis, Finding
from robots import Robot
from robots.arrays import FloatArray


@dataclass(frozen=True)
class Provenance:
    """How something was made of recordings.

    Attributes:
        robot: the arm, with the settings that were used.
        paths: captures or logs, the one that it is kept with first.
        settings: what was asked for, enough to do it again; values that JSON has.
        file, report: that were written; None where none was.
    """

    robot: Robot
    paths: Sequence[Path]
    settings: Mapping[str, Any]
    file: Path | None = None
    report: Path | None = None


def run_of(catalogue: Catalogue, robot: Robot, path: Path) -> int:
    """The run that a recording is of; one of kind "import" is made where it is not known yet."""
    sha256 = source_sha256(path)
    known = runs.of_capture(catalogue, sha256)
    if known is not None:
        return known.id
    is_capture = path.suffix.lower() == CAPTURE_SUFFIX
    identity = identity_of_capture(read_capture(path)) if is_capture else identity_of_arm(robot)
    begun = runs.begin(catalogue, identity, "import", capture=str(path.absolute()))
    return runs.finish(catalogue, begun.id, "completed", capture_sha256=sha256).id


def new_model(fitted: Fitted, provenance: Provenance) -> NewModel:
    """The model that an identification recommends, as the catalogue takes it."""
    result = fitted.result
    estimate = result.recommended
    return NewModel(
        method=estimate.method,
        verdict=result.test.verdict,
        recommendation=result.test.recommendation,
        gates=identification_json(result, [])["test"],
        rows=result.rows,
        relative_error_percent=estimate.relative_error_percent,
        torque_rms=tuple(estimate.torque_rms.tolist()),
        effects=tuple(effect.name for effect in fitted.base.model.effects),
        found=result.found,
        parameters=tuple(
            CatalogueParameter(p.name, float(p.value), float(p.sigma), p.unit, p.expression)
            for p in estimate.parameters
        ),
        covariance_kind=estimate.covariance_kind,
        covariance=estimate.covariance,
        **_origin(provenance),
    )


def keep_identified(
    catalogue: Catalogue, fitted: Fitted, provenance: Provenance, run_id: int | None = None
) -> Model:
    """Keep an identification.

    Args:
        catalogue: where.
        fitted: the identification.
        provenance: how.
        run_id: whose recording it was made from, where that is known.

    Raises:
        CatalogueError: it cannot be written.
    """
    number = run_of(catalogue, provenance.robot, provenance.paths[0]) if run_id is None else run_id
    return models.add(catalogue, number, new_model(fitted, provenance))


def keep_request(catalogue: Catalogue, request: IdentifyRequest, result: IdentifyResult) -> Model | None:
    """Keep what ``armhil identify`` has written; None where it wrote nothing.

    Raises:
        CatalogueError: it cannot be written.
    """
    if result.report is None:
        return None
    robot = result.fitted.base.model.robot
    file = result.report.parent / f"{robot.name}{SUFFIX}"
    provenance = Provenance(
        robot, request.paths, identify_settings(request, result.fitted.known), file, result.report
    )
    return keep_identified(catalogue, result.fitted, provenance)


def keep_rerun(catalogue: Catalogue, again: Rerun) -> Model:
    """Keep what an identification that was done again has written.

    Raises:
        CatalogueError: it cannot be written.
    """
    fitted, report = again.result.fitted, again.result.report
    sources = [] if again.earlier is None else [Path(source.path) for source in again.earlier.sources]
    paths = sources or [Path(again.run.capture or "")]
    settings = {"command": IDENTIFY} if again.earlier is None else again.earlier.settings
    robot = fitted.base.model.robot
    file = None if report is None else report.parent / f"{robot.name}{SUFFIX}"
    return keep_identified(catalogue, fitted, Provenance(robot, paths, settings, file, report), again.run.id)


def keep_diagnosed(
    catalogue: Catalogue, diagnosis: Diagnosis, model: ModelFile, provenance: Provenance
) -> tuple[Model, tuple[CatalogueFinding, ...]]:
    """Keep a diagnosis: the model that it ends with, and its findings.

    Args:
        catalogue: where.
        diagnosis: of the search.
        model: the file that was written of it.
        provenance: how.

    Raises:
        CatalogueError: it cannot be written.
    """
    number = run_of(catalogue, provenance.robot, provenance.paths[0])
    estimate = model.estimate
    new = NewModel(
        method=estimate.estimator,
        verdict=estimate.verdict,
        recommendation=estimate.recommendation,
        gates={},
        rows=estimate.rows,
        relative_error_percent=estimate.relative_error_percent,
        torque_rms=tuple(diagnosis.torque.after.tolist()),
        effects=model.effects,
        found=entries_of(model),
        parameters=tuple(
            CatalogueParameter(p.name, p.value, p.sigma, p.unit, p.expression) for p in model.parameter
        ),
        covariance_kind=estimate.covariance,
        covariance=model.covariance,
        **_origin(provenance),
    )
    kept = models.add(catalogue, number, new)
    found = tuple(_finding(finding) for finding in diagnosis.findings)
    return kept, findings.add(catalogue, number, found, kept.id)


def keep_diagnose_request(
    catalogue: Catalogue, request: DiagnoseRequest, result: DiagnoseResult
) -> Model | None:
    """Keep what ``armhil diagnose`` has written; None where it wrote nothing.

    Raises:
        CatalogueError: it cannot be written.
        ModelFileError: the model file is gone.
    """
    if result.folder is None:
        return None
    file = result.folder / f"{result.robot.name}{SUFFIX}"
    settings = {
        "command": DIAGNOSE,
        "robot": absolute(request.robot),
        "columns": None if request.columns is None else str(request.columns.absolute()),
        "validation": [str(path.absolute()) for path in request.validation],
        "search": BY_EVIDENCE,
        "split_half": request.split_half,
        "without": list(request.without),
        "prior": absolute(request.prior),
        "found": None if request.found is None else found_json(request.found),
        "carried": [one.as_json() for one in request.carried],
    }
    provenance = Provenance(result.robot, request.fit, settings, file, result.folder / "diagnosis.html")
    return keep_diagnosed(catalogue, result.diagnosis, read_model(file), provenance)[0]


def _finding(finding: Finding) -> NewFinding:
    """The gaps are rms torques over the joints on recordings that were not fitted, N·m (or N)."""
    return NewFinding(
        effect=finding.effect,
        joints=tuple(finding.joints),
        sentence=finding.words(),
        parameters=tuple(asdict(parameter) for parameter in finding.parameters),
        p_value=float(finding.p_value),
        gap_before=_rms(finding.gap.before),
        gap_after=_rms(finding.gap.after),
        held_out_gain=float(finding.held_out_gain),
    )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _origin(provenance: Provenance) -> dict[str, Any]:
    return {
        "settings": dict(provenance.settings),
        "sources": tuple(Source(str(path.absolute()), source_sha256(path)) for path in provenance.paths),
        "description_sha256": description_of(provenance.robot).sha256,
        "armhil": version("armhil"),
        "file": None if provenance.file is None else str(provenance.file.absolute()),
        "report": None if provenance.report is None else str(provenance.report.absolute()),
    }
