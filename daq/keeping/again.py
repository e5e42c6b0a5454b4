"""Identify again what a run recorded, with the settings of then: does it come out the same?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np

from daq.catalogue import models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.identity import description_of
from daq.catalogue.values import CatalogueError, Model, Run, RunKind, Source
from daq.files.checksum import source_sha256
from daq.files.found_model import found_json, found_of_json
from daq.identification.carried import Carried
from daq.identification.identify import IdentifyRequest, IdentifyResult, run_identify
from daq.text.progress import Steps
from ident.identification.found_effects import FoundModel
from robots import Robot
from robots.arrays import FloatArray

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


def identify_settings(request: IdentifyRequest, known: FoundModel | None = None) -> dict[str, Any]:
    """What an identification was asked for, as the catalogue keeps it.

    Args:
        request: the call.
        known: what its model file held; the file may be gone when it is asked for again.
    """
    return {
        "command": IDENTIFY,
        "robot": absolute(request.robot),
        "columns": None if request.columns is None else str(request.columns.absolute()),
        "cutoff_hz": request.cutoff_hz,
        "rate_hz": request.rate_hz,
        "method": request.method,
        "covariance": request.covariance,
        "friction": request.friction,
        "essential": request.essential,
        "validate": [str(path.absolute()) for path in request.validate],
        "model": None if known is None else found_json(known),
        "carried": [one.as_json() for one in request.carried],
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
        model=found_of_json(settings.get("model")),
        carried=tuple(map(Carried.of_json, settings.get("carried", []))),
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
    identified, test = result.fitted.result, result.fitted.result.test
    # A check keeps the estimate of its baseline's kind, whatever the test recommends.
    kinds = [estimate for estimate in identified.estimates if estimate.method == earlier.method]
    estimate = kinds[0] if kinds else identified.recommended
    then = [(p.name, p.value, p.sigma) for p in earlier.parameters]
    now = [(p.name, p.value, p.sigma) for p in estimate.parameters]
    largest, name = furthest(then, now)
    remarks = _remarks(earlier, result)
    same_words = (earlier.verdict, earlier.method, earlier.rows) == (
        test.verdict,
        estimate.method,
        result.fitted.result.rows,
    )
    covariance = np.asarray(estimate.covariance)
    sameness = sameness_of(then, now, earlier.covariance, covariance, largest, same_words=same_words)
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


def refuse_unrecorded(run: Run) -> None:
    """Has a run a recording? If not, what would make one.

    Raises:
        CatalogueError: it has none.
    """
    if run.capture is not None and run.capture_sha256 is not None:
        return
    if run.capture_sha256 is not None:
        raise CatalogueError(f"run {run.id}: its recording was deleted; what was found in it is kept")
    stage = f", stage {run.stage}" if run.stage else ""
    again = _TO_DRIVE_AGAIN[run.kind].format(arm=run.arm, stage=run.stage.replace(" ", "-") or "plan")
    raise CatalogueError(
        f"run {run.id} ({run.kind}{stage}) has no recording, and rerun moves no arm: it analyses recordings;"
        f" to go through it again: {again}"
    )


_TO_DRIVE_AGAIN: dict[RunKind, str] = {
    "demo": "armhil demo",
    "plan": "armhil plan {arm}",
    "check": "armhil check {arm}",
    "commission": "armhil commission {arm} --from {stage} --move",
    "import": "armhil import FILE --robot {arm}",
    "run": "armhil run {arm} TRAJECTORY",
}


def _source_of(run: Run) -> tuple[Source, ...]:
    refuse_unrecorded(run)
    assert run.capture is not None
    assert run.capture_sha256 is not None
    return (Source(run.capture, run.capture_sha256),)


def _identified(catalogue: Catalogue, run_id: int) -> Model | None:
    """The newest model of a run that an identification made."""
    made = [model for model in models.of_run(catalogue, run_id) if model.settings.get("command") == IDENTIFY]
    return made[-1] if made else None


NamedValue = tuple[str, float, float]
"""Name, value and σ of a parameter."""


def furthest(then: Sequence[NamedValue], now: Sequence[NamedValue]) -> tuple[float | None, str]:
    """The largest difference of a parameter in its σ of then, and whose it is; None where the sets differ."""
    names = [name for name, _, _ in then]
    if names != [name for name, _, _ in now] or not names:
        return None, ""
    (before, sigma), after = np.array([part[1:] for part in then]).T, np.array([part[1] for part in now])
    away = np.abs(after - before) / np.where(sigma > 0, sigma, 1.0)
    worst = int(np.argmax(away))
    return float(away[worst]), names[worst]


def sameness_of(
    then: Sequence[NamedValue],
    now: Sequence[NamedValue],
    covariance_then: FloatArray | None,
    covariance_now: FloatArray | None,
    largest: float | None,
    *,
    same_words: bool,
) -> Sameness:
    """How far two results agree.

    Args:
        then, now: parameters.
        covariance_then, covariance_now: of them, (b, b).
        largest: as :func:`furthest` finds it.
        same_words: whether verdict, estimator and rows are the same.
    """
    if not same_words:
        return "different"
    lower = np.tril_indices(len(now))
    both = covariance_then is not None and covariance_now is not None
    if list(then) == list(now) and both and np.array_equal(covariance_then[lower], covariance_now[lower]):  # type: ignore[index]
        return "identical"
    return "rounding" if largest is not None and largest < ROUNDING else "different"


def _remarks(earlier: Model, result: IdentifyResult) -> tuple[str, ...]:
    identification = result.fitted.result
    remarks = []
    if earlier.armhil != version("armhil"):
        remarks.append(f"armhil was {earlier.armhil} then and is {version('armhil')} now")
    robot = result.fitted.base.model.robot
    if description_of(robot).sha256 != earlier.description_sha256:
        remarks.append("the arm's description was changed since")
    if identification.test.verdict != earlier.verdict:
        remarks.append(f"the verdict was {earlier.verdict} and is {identification.test.verdict}")
    if identification.rows != earlier.rows:
        remarks.append(f"{earlier.rows} rows became {identification.rows}")
    if earlier.method not in [estimate.method for estimate in identification.estimates]:
        remarks.append(f"the estimator was {earlier.method} and is {identification.recommended.method}")
    return tuple(remarks)


def absolute(robot: str | Robot | None) -> str | None:
    """The path of a file, or a name that is none, such as that of an arm that ships."""
    if isinstance(robot, Robot):
        return str(robot.folder.absolute())
    return robot if robot is None or not Path(robot).exists() else str(Path(robot).absolute())
