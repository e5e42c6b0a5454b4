"""Models in the catalogue: parameters with their whole covariance, bit for bit, and how they were made."""

from __future__ import annotations

import zlib
from dataclasses import asdict
from datetime import datetime
from typing import Any

import numpy as np
from sqlalchemy import Connection, Row, Select, insert, select

from daq.catalogue import runs
from daq.catalogue.database import Catalogue
from daq.catalogue.schema import models, parameters
from daq.catalogue.schema import runs as runs_table
from daq.catalogue.values import CatalogueError, CatalogueParameter, Course, Model, NewModel, Source
from daq.recording.who import user
from ident.effects.entry import EffectEntry
from robots.arrays import FloatArray, IntArray
from robots.errors import one_line

_PLAIN = (
    "method",
    "verdict",
    "recommendation",
    "rows",
    "relative_error_percent",
    "covariance_kind",
    "description_sha256",
    "armhil",
    "file",
    "report",
)


def add(catalogue: Catalogue, run_id: int, new: NewModel) -> Model:
    """Keep a model that was made from the recording of a run.

    Raises:
        CatalogueError: there is no such run.
    """
    with catalogue.writing() as connection:
        run = runs.get_in(connection, run_id)
        values = {key: getattr(new, key) for key in _PLAIN} | {
            "arm_id": run.arm_id,
            "run_id": run_id,
            "created": runs.time_of(catalogue, run),
            "who": user(),
            "gates": dict(new.gates),
            "torque_rms": list(new.torque_rms),
            "effects": list(new.effects),
            "found": [entry.as_json() for entry in new.found],
            "covariance": _packed(new.covariance),
            "settings": dict(new.settings),
            "sources": [asdict(source) for source in new.sources],
        }
        number = connection.execute(insert(models).values(values)).inserted_primary_key
        model_id = int(number[0])  # type: ignore[index]
        rows = [{"model_id": model_id, "place": place, **asdict(p)} for place, p in enumerate(new.parameters)]
        if rows:
            connection.execute(insert(parameters), rows)
        return get_in(connection, model_id)


def get(catalogue: Catalogue, model_id: int) -> Model:
    """The model of a number.

    Raises:
        CatalogueError: there is none.
    """
    with catalogue.reading() as connection:
        return get_in(connection, model_id)


def get_in(connection: Connection, model_id: int) -> Model:
    """As :func:`get`, inside a transaction."""
    found = _found(connection, select(models).where(models.c.id == model_id))
    if not found:
        raise CatalogueError(f"model {model_id}: is not in the catalogue")
    return found[0]


def of_run(catalogue: Catalogue, run_id: int) -> tuple[Model, ...]:
    """The models that were made from a run, oldest first."""
    with catalogue.reading() as connection:
        return _found(connection, select(models).where(models.c.run_id == run_id).order_by(models.c.id))


def of_arm(catalogue: Catalogue, arm_id: int, *, limit: int | None = None) -> tuple[Model, ...]:
    """The models of an arm, newest first."""
    wanted = select(models).where(models.c.arm_id == arm_id).order_by(models.c.id.desc()).limit(limit)
    with catalogue.reading() as connection:
        return _found(connection, wanted)


def torques_of_arm(catalogue: Catalogue, arm_id: int) -> dict[int, tuple[float, ...]]:
    """What each model of an arm leaves of the joints' torque, rms, N·m or N, by the model's number."""
    wanted = select(models.c.id, models.c.torque_rms).where(models.c.arm_id == arm_id)
    with catalogue.reading() as connection:
        return {row.id: tuple(row.torque_rms) for row in connection.execute(wanted)}


def latest_of(catalogue: Catalogue, run_id: int) -> Model:
    """The newest model of a run.

    Raises:
        CatalogueError: there is no such run, or it has no model.
    """
    found = of_run(catalogue, run_id)
    if not found:
        capture = runs.get(catalogue, run_id).capture or "CAPTURE"
        raise CatalogueError(
            f"run {run_id}: has no model; make one: `armhil identify {capture} --out FOLDER`"
        )
    return found[-1]


def courses(catalogue: Catalogue, arm_id: int, name: str | None = None) -> tuple[Course, ...]:
    """The course of each parameter of an arm over its models, in the order in which the models have them.

    Args:
        catalogue: where.
        arm_id: of the arm.
        name: of one parameter; all where None.
    """
    made = select(models.c.id, models.c.run_id, runs_table.c.started)
    made = made.join(runs_table, runs_table.c.id == models.c.run_id).where(models.c.arm_id == arm_id)
    p = parameters.c
    # What all parameters of a model share is asked for once a model, not once a parameter.
    listed = select(p.model_id, p.name, p.value, p.sigma, p.unit)
    listed = listed.join(models, models.c.id == p.model_id).where(models.c.arm_id == arm_id)
    if name is not None:
        listed = listed.where(p.name == name)
    with catalogue.reading() as connection:
        known = connection.execute(made.order_by(runs_table.c.started, models.c.id)).all()
        found = connection.execute(listed.order_by(p.model_id, p.place)).all()
        place = {row.id: k for k, row in enumerate(known)}
        rows_of: dict[str, list[tuple[int, float, float, str]]] = {}
        for model_id, symbol, value, sigma, unit in found:
            if model_id in place:
                rows_of.setdefault(symbol, []).append((place[model_id], value, sigma, unit))
        at = [row.started for row in known]
        seconds = np.array([time.timestamp() for time in at])
        numbers = np.array([(row.id, row.run_id) for row in known], dtype=np.int64).reshape(-1, 2)
        return tuple(_course_of(symbol, rows, numbers, at, seconds) for symbol, rows in rows_of.items())


def _course_of(
    name: str,
    rows: list[tuple[int, float, float, str]],
    numbers: IntArray,
    at: list[datetime],
    seconds: FloatArray,
) -> Course:
    """Of the rows of one parameter: place of the model in time, value, σ, unit."""
    places, values, sigmas, units = zip(*sorted(rows), strict=True)
    chosen = np.array(places)
    return Course(
        name,
        units[0],
        numbers[chosen, 0],
        numbers[chosen, 1],
        tuple(at[k] for k in places),
        seconds[chosen],
        np.array(values, dtype=np.float64),
        np.array(sigmas, dtype=np.float64),
    )


def _parameter_columns() -> tuple[Any, ...]:
    p = parameters.c
    return (p.name, p.value, p.sigma, p.unit, p.expression)


def _found(connection: Connection, wanted: Select[Any]) -> tuple[Model, ...]:
    rows = connection.execute(wanted).all()
    numbers = [row.id for row in rows]
    belonging: dict[int, list[CatalogueParameter]] = {number: [] for number in numbers}
    listed = select(parameters.c.model_id, *_parameter_columns())
    listed = listed.where(parameters.c.model_id.in_(numbers))
    for model_id, *values in connection.execute(listed.order_by(parameters.c.model_id, parameters.c.place)):
        belonging[model_id].append(CatalogueParameter(*values))
    return tuple(_model_of(row, tuple(belonging[row.id])) for row in rows)


def _model_of(row: Row[Any], belonging: tuple[CatalogueParameter, ...]) -> Model:
    fields = dict(row._mapping)
    try:
        fields["torque_rms"] = tuple(fields["torque_rms"])
        fields["effects"] = tuple(fields["effects"])
        # A catalogue of before has none there.
        fields["found"] = tuple(EffectEntry.of_json(entry) for entry in fields["found"] or ())
        fields["sources"] = tuple(Source(**source) for source in fields["sources"])
        fields["covariance"] = _unpacked(fields["covariance"], len(belonging))
    except (zlib.error, ValueError, TypeError, KeyError, AttributeError) as error:
        reason = one_line(str(error))[:120]
        raise CatalogueError(
            f"model {row.id} holds a value that no armhil wrote ({reason}): the catalogue's file is damaged;"
            " put a backup in its place"
        ) from error
    return Model(parameters=belonging, **fields)


def _packed(covariance: FloatArray | None) -> bytes | None:
    """The lower triangle, bit for bit, in a sixth of the room of its digits."""
    if covariance is None:
        return None
    lower = np.asarray(covariance, dtype="<f8")[np.tril_indices(len(covariance))]
    return zlib.compress(lower.tobytes())


def _unpacked(data: bytes | None, size: int) -> FloatArray | None:
    if data is None:
        return None
    covariance = np.empty((size, size))
    rows, columns = np.tril_indices(size)
    lower = np.frombuffer(zlib.decompress(data), dtype="<f8")
    covariance[rows, columns] = lower
    covariance[columns, rows] = lower
    return covariance
