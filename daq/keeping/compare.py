"""Two runs beside one another: parameters with σ, what lies between them, and what that is in torque."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from pathlib import Path

import numpy as np

from daq.catalogue import models, runs
from daq.catalogue.database import Catalogue
from daq.catalogue.values import CatalogueError, CatalogueParameter, Model, Run
from daq.identification.identify_options import chosen_settings
from daq.importing.load import load_recording
from daq.keeping.accepted_effects import regressor_of
from daq.keeping.again import request_of, unchanged
from daq.recording.described_arm import described
from ident import IdentificationError, base_parameters
from ident.identification.found_effects import end_to_end
from ident.preparation.observation import Rows, observe
from robots.arrays import FloatArray


@dataclass(frozen=True)
class ComparedParameter:
    """One parameter in both runs; ``sigmas`` is the difference in standard deviations of the difference.

    The two estimates are taken as independent. None where both deviations are zero.
    """

    name: str
    unit: str
    first: CatalogueParameter
    second: CatalogueParameter
    difference: float
    sigmas: float | None


@dataclass(frozen=True)
class TorqueDifference:
    """What the two models predict differently on the motion of the first run, rms per joint, N·m (or N)."""

    rms: FloatArray
    share_percent: FloatArray
    """Of the rms torque that was measured, per joint."""


@dataclass(frozen=True)
class Comparison:
    """Two runs, newest model of each.

    Attributes:
        parameters: those that both models have, in the order of the first.
        only_first, only_second: names of the others.
        torque: None where it cannot be computed, for the reason in ``torque_reason``.
    """

    runs: tuple[Run, Run]
    models: tuple[Model, Model]
    parameters: tuple[ComparedParameter, ...]
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]
    torque: TorqueDifference | None
    torque_reason: str
    remarks: tuple[str, ...]


def compare(catalogue: Catalogue, first: int, second: int) -> Comparison:
    """Compare the newest models of two runs.

    Raises:
        CatalogueError: there is no such run, or it has no model.
    """
    pair = runs.get(catalogue, first), runs.get(catalogue, second)
    a, b = models.latest_of(catalogue, first), models.latest_of(catalogue, second)
    of_a = {parameter.name: parameter for parameter in a.parameters}
    of_b = {parameter.name: parameter for parameter in b.parameters}
    torque, reason = _torque(pair[0], a, b)
    return Comparison(
        runs=pair,
        models=(a, b),
        parameters=tuple(_compared(p, of_b[name]) for name, p in of_a.items() if name in of_b),
        only_first=tuple(name for name in of_a if name not in of_b),
        only_second=tuple(name for name in of_b if name not in of_a),
        torque=torque,
        torque_reason=reason,
        remarks=_remarks(*pair, a, b),
    )


def _compared(first: CatalogueParameter, second: CatalogueParameter) -> ComparedParameter:
    sigma = hypot(first.sigma, second.sigma)
    difference = second.value - first.value
    away = difference / sigma if sigma else None
    return ComparedParameter(first.name, first.unit, first, second, difference, away)


def _remarks(first: Run, second: Run, a: Model, b: Model) -> tuple[str, ...]:
    remarks = []
    if first.arm_id != second.arm_id:
        remarks.append(f"they are of two arms: {first.arm} and {second.arm}")
    if a.description_sha256 != b.description_sha256:
        remarks.append("the arm's description was changed between them")
    if a.effects != b.effects:
        remarks.append("the models have different effects")
    if a.method != b.method:
        remarks.append(f"the estimators differ: {a.method} and {b.method}")
    if a.armhil != b.armhil:
        remarks.append(f"armhil {a.armhil} made one, {b.armhil} the other")
    return tuple(remarks)


def _torque(run: Run, a: Model, b: Model) -> tuple[TorqueDifference | None, str]:
    """X (β_b − β_a) on the rows that the first model was made from."""
    names = [parameter.name for parameter in a.parameters]
    if names != [parameter.name for parameter in b.parameters]:
        return None, "the models have different parameters"
    try:
        rows = _rows(run, a, names)
    except (CatalogueError, IdentificationError) as error:
        return None, str(error)
    shift = np.array([q.value - p.value for p, q in zip(a.parameters, b.parameters, strict=True)])
    difference = np.where(rows.used, rows.regressor @ shift, 0.0)
    measured = np.where(rows.used, rows.torque, 0.0)
    count = np.maximum(rows.used.sum(axis=0), 1)
    rms = np.sqrt((difference**2).sum(axis=0) / count)
    level = np.sqrt((measured**2).sum(axis=0) / count)
    share = 100.0 * np.divide(rms, level, out=np.zeros_like(rms), where=level > 0)
    return TorqueDifference(rms, share), ""


def _rows(run: Run, model: Model, names: list[str]) -> Rows:
    paths = tuple(unchanged(run, source) for source in model.sources)
    request = request_of(dict(model.settings), paths)
    with described(request.robot, paths[0]) as (robot, _):
        loaded = [load_recording(Path(path), robot, request.columns) for path in paths]
        recordings = tuple(recording for part in loaded for recording in part.recordings)
        settings = chosen_settings(
            loaded[0].settings,
            recordings[0],
            cutoff_hz=None if request.cutoff_hz == "auto" else request.cutoff_hz,
            rate_hz=request.rate_hz,
            friction=request.friction,
        )
        robot = robot.model_copy(update={"identification": settings})
        base = base_parameters(regressor_of(model, robot))
        if list(base.names) != names:
            raise IdentificationError("the models are not of the arm as it is described now")
        return observe(base, end_to_end(recordings), settings)
