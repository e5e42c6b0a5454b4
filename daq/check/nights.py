"""The nights of an arm as the comparison takes them: out of the catalogue, beside the baseline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from daq.catalogue import checks, models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import Baseline, CheckRecord, Model, Run
from daq.check.carried import carried_over
from daq.check.recorded import TRAJECTORY_SHA256, reported_celsius
from daq.check.residual import TEACHES, found_nothing
from daq.recording.errors import CaptureError
from daq.session.recorded_runs import CELSIUS
from ident import Fitted
from ident.drift import Comparison, DriftSettings, Night, compare, geometry_of
from robots import Robot

_DAY = 86400.0


def nights_since(
    catalogue: Catalogue,
    baseline: Baseline,
    trajectory_sha256: str,
    names: tuple[str, ...],
    before: int | None = None,
) -> list[Night]:
    """The checks of an arm since its baseline was accepted that drove the same motion, oldest first.

    Those that found something teach nothing: they are marked as not clean.

    Args:
        before: only checks with a smaller number; all where None.
    """
    known = checks.of_arm(catalogue, baseline.arm_id, keys=TEACHES)
    records = {record.model_id: record for record in known if before is None or record.id < before}
    accepted = models.get(catalogue, baseline.model_id)
    found = []
    for model in reversed(models.of_arm(catalogue, baseline.arm_id)):
        record = records.get(model.id)
        if record is None or model.id == baseline.model_id or model.method != accepted.method:
            continue
        if record.baseline_id != baseline.id or tuple(p.name for p in model.parameters) != names:
            continue
        if record.details.get(TRAJECTORY_SHA256) == trajectory_sha256 and model.covariance is not None:
            found.append((model, record))
    made = runs.of_numbers(catalogue, [model.run_id for model, _ in found])
    return [night_of(made[model.run_id], model, record) for model, record in found]


def night_of(run: Run, model: Model, record: CheckRecord | None) -> Night:
    """A model of a run as the comparison takes it."""
    celsius = None if record is None else record.details.get(CELSIUS)
    if celsius is None and CELSIUS in run.facts:
        celsius = [float(run.facts[CELSIUS])] * len(model.torque_rms)
    assert model.covariance is not None
    return Night(
        day=run.started.timestamp() / _DAY,
        values=np.array([parameter.value for parameter in model.parameters]),
        covariance=model.covariance,
        celsius=None if celsius is None else np.array(celsius, dtype=np.float64),
        clean=record is None or found_nothing(record),
        label=f"run {run.id} ({run.started:%Y-%m-%d})",
    )


def compare_nights(
    catalogue: Catalogue,
    baseline: Baseline,
    nights: Sequence[Night],
    fitted: Fitted,
    settings: DriftSettings,
) -> tuple[Comparison, tuple[str, ...]]:
    """Nights beside the baseline, and the parameters of the baseline that the comparison leaves out.

    Args:
        nights: oldest first; the last is the one that is judged.
        fitted: the identification of the last.

    Raises:
        CatalogueError: the catalogue cannot be read.
        IdentificationError: the model has other parameters than the baseline's.
    """
    accepted = models.get(catalogue, baseline.model_id)
    of_baseline = [r for r in checks.of_run(catalogue, baseline.run_id) if r.model_id == accepted.id]
    run = runs.get(catalogue, baseline.run_id)
    first = night_of(run, accepted, of_baseline[-1] if of_baseline else None)
    if first.celsius is None:
        first = replace(first, celsius=_reported(run, fitted.base.model.robot))
    first, lost = carried_over(first, nights[-1], accepted, fitted)
    geometry = geometry_of(fitted.base, fitted.rows, fitted.least_squares.sigma, first.values)
    return compare(first, nights, geometry, settings), lost


def _reported(run: Run, robot: Robot) -> np.ndarray | None:
    """(n,) what the drives reported during a run that was no check, such as that of a commissioning, °C."""
    try:
        found = None if run.capture is None else reported_celsius(Path(run.capture), robot)
    except CaptureError:  # no recording of ours, or not there any more
        return None
    return None if found is None else np.array(found)
