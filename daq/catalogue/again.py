"""Identify again what a run recorded, with the settings of then: does it come out the same?"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np

from daq.catalogue import models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import sha256_of
from daq.catalogue.values import CatalogueError, Model, Run, Source
from daq.files.model_file import source_sha256
from daq.identification.identify import IdentifyRequest, IdentifyResult, run_identify
from daq.progress import Steps
from ident.results import Estimate

IDENTIFY = "identify"
"""``command`` among the settings of a model that :func:`rerun` can make again."""

ROUNDING = 1e-6
"""σ: differences below are those of another processor or library."""

Sameness = Literal["identical", "rounding", "different", "first"]


@dataclass(frozen=True)
class Rerun:
    """What came out.

    Attributes:
        run: whose recording it was.
        earlier: the model that is compared with; None where there was none.
        result: of the identification now.
        sameness: ``identical`` is bit for bit in values, covariance, rows and verdict; ``first`` where
            there is nothing to compare with.
        largest: difference of a parameter, in its σ of then; None where the sets differ.
        largest_name: the parameter.
        remarks: what is not as it was then.
    """

    run: Run
    earlier: Model | None
    result: IdentifyResult
    sameness: Sameness
    largest: float | None
    largest_name: str
    remarks: tuple[str, ...]


def identify_settings(request: IdentifyRequest) -> dict[str, Any]:
    """What an identification was asked for, as the catalogue keeps it."""
    return {
        "command": IDENTIFY,
        "robot": _absolute(request.robot),
        "columns": None if request.columns is None else str(request.columns.absolute()),
        "cutoff_hz": request.cutoff_hz,
        "rate_hz": request.rate_hz,
        "method": request.method,
        "covariance": request.covariance,
        "friction": request.friction,
        "essential": request.essential,
        "validate": [str(path.absolute()) for path in request.validate],
    }


def request_of(settings: dict[str, Any], paths: tuple[Path, ...], out: Path | None = None) -> IdentifyRequest:
    """The request that settings were kept of."""
    columns = settings.get("columns")
    return IdentifyRequest(
        paths,
        settings.get("robot"),
        None if columns is None else Path(columns),
        settings.get("cutoff_hz"),
        settings.get("rate_hz"),
        out,
        method=settings.get("method", "auto"),
        covariance=settings.get("covariance"),
        friction=settings.get("friction"),
        essential=settings.get("essential", False),
        validate=tuple(Path(path) for path in settings.get("validate", [])),
    )


def rerun(catalogue: Catalogue, run_id: int, steps: Steps, out: Path | None = None) -> Rerun:
    """Identify again.

    Args:
        catalogue: where the run is.
        run_id: of the run.
        steps: shows progress.
        out: folder for report and model file; nothing is written where None.

    Raises:
        CatalogueError: there is no such run, its recording is gone, or is not the one of then.
        CaptureError, RobotFileError, IdentificationError, OutputError: as in an identification.
    """
    run = runs.get(catalogue, run_id)
    earlier = _identified(catalogue, run_id)
    sources = _source_of(run) if earlier is None else earlier.sources
    settings = {} if earlier is None else dict(earlier.settings)
    paths = tuple(unchanged(run, source) for source in sources)
    result = run_identify(request_of(settings, paths, out), steps)
    if earlier is None:
        return Rerun(run, None, result, "first", None, "", ())
    estimate, test = result.fitted.result.recommended, result.fitted.result.test
    largest, name = _largest(earlier, estimate)
    remarks = _remarks(earlier, result)
    same_words = (earlier.verdict, earlier.method, earlier.rows) == (
        test.verdict,
        estimate.method,
        result.fitted.result.rows,
    )
    sameness: Sameness = "different"
    if same_words and _same_bits(earlier, estimate):
        sameness = "identical"
    elif same_words and largest is not None and largest < ROUNDING:
        sameness = "rounding"
    return Rerun(run, earlier, result, sameness, largest, name, remarks)


def unchanged(run: Run, source: Source) -> Path:
    """The path of a recording that is still there as it was.

    Raises:
        CatalogueError: it is gone, or another file is in its place.
    """
    path = Path(source.path)
    if not path.exists():
        raise CatalogueError(f"run {run.id}: its recording {path} is gone")
    found = source_sha256(path)
    if found != source.sha256:
        raise CatalogueError(
            f"run {run.id}: {path} is not the recording of then: its SHA-256 is {found[:16]}…,"
            f" that of the run {source.sha256[:16]}…"
        )
    return path


def _source_of(run: Run) -> tuple[Source, ...]:
    if run.capture is None or run.capture_sha256 is None:
        raise CatalogueError(f"run {run.id}: has no recording to identify from")
    return (Source(run.capture, run.capture_sha256),)


def _identified(catalogue: Catalogue, run_id: int) -> Model | None:
    """The newest model of a run that an identification made."""
    made = [model for model in models.of_run(catalogue, run_id) if model.settings.get("command") == IDENTIFY]
    return made[-1] if made else None


def _largest(earlier: Model, estimate: Estimate) -> tuple[float | None, str]:
    names = [parameter.name for parameter in earlier.parameters]
    if names != [parameter.name for parameter in estimate.parameters]:
        return None, ""
    sigma = np.array([parameter.sigma for parameter in earlier.parameters])
    then = np.array([parameter.value for parameter in earlier.parameters])
    away = np.abs(estimate.values - then) / np.where(sigma > 0, sigma, 1.0)
    worst = int(np.argmax(away))
    return float(away[worst]), names[worst]


def _same_bits(earlier: Model, estimate: Estimate) -> bool:
    now = [(p.name, p.value, p.sigma) for p in estimate.parameters]
    then = [(p.name, p.value, p.sigma) for p in earlier.parameters]
    covariance = earlier.covariance
    lower = np.tril_indices(len(now))
    return (
        now == then
        and covariance is not None
        and np.array_equal(covariance[lower], np.asarray(estimate.covariance)[lower])
    )


def _remarks(earlier: Model, result: IdentifyResult) -> tuple[str, ...]:
    identification = result.fitted.result
    remarks = []
    if earlier.armhil != version("armhil"):
        remarks.append(f"armhil was {earlier.armhil} then and is {version('armhil')} now")
    robot = result.fitted.base.model.robot
    if sha256_of(robot.source_text) != earlier.description_sha256:
        remarks.append("the arm's robot.toml was changed since")
    if identification.test.verdict != earlier.verdict:
        remarks.append(f"the verdict was {earlier.verdict} and is {identification.test.verdict}")
    if identification.rows != earlier.rows:
        remarks.append(f"{earlier.rows} rows became {identification.rows}")
    if identification.recommended.method != earlier.method:
        remarks.append(f"the estimator was {earlier.method} and is {identification.recommended.method}")
    return tuple(remarks)


def _absolute(robot: str | None) -> str | None:
    """The path of a description, or the name of an arm that ships."""
    return robot if robot is None or not Path(robot).exists() else str(Path(robot).absolute())
