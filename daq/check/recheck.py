"""Judge a check again: the same recording beside the baseline and the nights of then."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from daq.catalogue import baselines, checks, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import CatalogueError, CheckRecord
from daq.check.judged import comparison_json
from daq.check.nights import compare_nights, night_of, nights_since
from daq.check.recorded import TRAJECTORY_SHA256
from daq.keeping.again import Rerun, refuse_unrecorded, rerun
from daq.text.progress import Steps
from ident.drift import Comparison, DriftSettings


@dataclass(frozen=True)
class Recheck:
    """What came out.

    Attributes:
        again: the identification of the recording.
        record: the verdict of then.
        comparison: of now; None where there was no baseline then.
        differs: what the comparison says otherwise than then, one sentence each.
    """

    again: Rerun
    record: CheckRecord
    comparison: Comparison | None
    differs: tuple[str, ...]


def recheck(catalogue: Catalogue, run_id: int, steps: Steps, out: Path | None = None) -> Recheck:
    """Identify a check's recording again and compare it as it was compared then; nothing is driven or kept.

    Args:
        catalogue: where the run is.
        run_id: of the run.
        steps: shows progress.
        out: folder for report and model file of the identification; nothing is written where None.

    Raises:
        CatalogueError: there is no such check, or its recording is gone or another one.
        IdentificationError: the model has other parameters than the baseline's.
    """
    run = runs.get(catalogue, run_id)
    refuse_unrecorded(run)
    records = checks.of_run(catalogue, run_id)
    if not records:
        raise CatalogueError(
            f"run {run_id}: was never compared with a baseline; allowed: runs of armhil check"
        )
    record = records[-1]
    again = rerun(catalogue, run_id, steps, out)
    compared = None if record.baseline_id is None else _compared(catalogue, record, again)
    return Recheck(again, record, compared, _differs(record, compared))


def _compared(catalogue: Catalogue, record: CheckRecord, again: Rerun) -> Comparison:
    with catalogue.reading() as connection:
        baseline = baselines.get_in(connection, int(record.baseline_id or 0))
    fitted, earlier = again.result.fitted, again.earlier
    if earlier is None:
        raise CatalogueError(f"run {record.run_id}: its model is not in the catalogue")
    sha256 = str(record.details.get(TRAJECTORY_SHA256, ""))
    history = nights_since(catalogue, baseline, sha256, fitted.base.names, before=record.id)
    estimate = next(e for e in fitted.result.estimates if e.method == earlier.method)
    celsius = record.details.get("celsius")
    tonight = replace(
        night_of(runs.get(catalogue, earlier.run_id), earlier, None),
        values=np.array([parameter.value for parameter in estimate.parameters]),
        covariance=np.asarray(estimate.covariance),
        celsius=None if celsius is None else np.array(celsius, dtype=np.float64),
    )
    known = {
        field.name for field in fields(DriftSettings)
    }  # older checks kept settings of rules that are gone
    kept = {key: value for key, value in record.details.get("settings", {}).items() if key in known}
    settings = DriftSettings(**kept)
    return compare_nights(catalogue, baseline, [*history, tonight], fitted, settings)[0]


def _differs(record: CheckRecord, compared: Comparison | None) -> tuple[str, ...]:
    then: dict[str, Any] = record.details.get("comparison") or {}
    if compared is None or not then:
        return ()
    now = json.loads(json.dumps(comparison_json(compared)))
    said = [key for key in ("state", "sentence") if then.get(key) != now[key]]
    found = [f"{key} was: {then.get(key)}; is: {now[key]}" for key in said]
    others = [key for key in now if key not in said and then.get(key) != now[key]]
    return (*found, *([f"otherwise in {', '.join(others)}"] if others else []))
